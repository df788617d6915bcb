//! RTCM 3 out of frames whose checksums are right, which bytes at random hardly ever are; in pieces and in one.

use lodestep_engine::gnss::rtcm::{Decoder, Message};
use lodestep_engine::gnss::time::GpsTime;

/// The first byte: where the stream is cut. Then frames: a byte with the length of a body and that body; or, where the length's
/// first bit is set, so many bytes as they are.
pub(crate) fn run(bytes: &[u8]) {
    let Some((said, mut rest)) = bytes.split_first() else { return };
    let mut stream = Vec::with_capacity(2 * bytes.len());
    while let Some((length, after)) = rest.split_first() {
        let (body, after) = after.split_at(usize::from(length & 0x7F).min(after.len()));
        rest = after;
        if length & 0x80 == 0 {
            let from = stream.len();
            stream.extend([0xD3, 0, body.len() as u8]);
            stream.extend(body);
            let sum = crc24(&stream[from..]).to_be_bytes();
            stream.extend(&sum[1..]);
        } else {
            stream.extend(body);
        }
    }
    let now = GpsTime::from_week(2340, 302_400.0);
    let (mut whole, mut cut) = (Decoder::default(), Decoder::default());
    let at_once = whole.push(&stream, now);
    let piece = 1 + usize::from(*said);
    let in_pieces: Vec<Message> = stream.chunks(piece).flat_map(|piece| cut.push(piece, now)).collect();
    assert_eq!(at_once, in_pieces, "in pieces of {piece}");
    assert_eq!(whole.counts(), cut.counts());
    for message in at_once {
        if let Message::Epoch(epoch) = message {
            for (k, tracked) in epoch.satellites.iter().enumerate() {
                assert!(!epoch.signals_of(tracked).is_empty());
                assert!(epoch.satellites[..k].iter().all(|other| other.satellite != tracked.satellite));
            }
            assert!(
                epoch
                    .signals
                    .iter()
                    .all(|signal| signal.code_m.is_finite() && signal.phase_cycles.is_finite())
            );
        }
    }
}

/// Qualcomm's CRC-24.
fn crc24(bytes: &[u8]) -> u32 {
    bytes.iter().fold(0, |sum, byte| sum << 8 & 0xFF_FFFF ^ TABLE[usize::from((sum >> 16) as u8 ^ byte)])
}

/// What a byte makes of the sum.
const TABLE: [u32; 256] = {
    let mut table = [0; 256];
    let mut byte = 0;
    while byte < 256 {
        let (mut sum, mut bit) = ((byte as u32) << 16, 0);
        while bit < 8 {
            sum = sum << 1 ^ if sum & 0x80_0000 != 0 { 0x186_4CFB } else { 0 };
            bit += 1;
        }
        table[byte] = sum;
        byte += 1;
    }
    table
};
