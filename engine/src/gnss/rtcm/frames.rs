//! Frames among bytes: a preamble, a length, the message and a checksum (CRC-24Q).

const PREAMBLE: u8 = 0xD3;
/// Preamble and length.
const HEAD: usize = 3;
const CHECKSUM: usize = 3;
const POLYNOMIAL: u32 = 0x0186_4CFB;

/// CRC-24Q.
pub(super) fn checksum(bytes: &[u8]) -> u32 {
    let mut crc = 0_u32;
    for byte in bytes {
        crc ^= u32::from(*byte) << 16;
        for _ in 0..8 {
            crc <<= 1;
            if crc & 0x0100_0000 != 0 {
                crc ^= POLYNOMIAL;
            }
        }
    }
    crc & 0x00FF_FFFF
}

/// What the bytes at hand begin with.
#[derive(Debug, PartialEq)]
pub(super) enum Next {
    /// A whole frame whose message is this part of the bytes, and how many bytes the frame has.
    Message(std::ops::Range<usize>, usize),
    /// So many bytes that are no frame; whether a frame seemed to begin there.
    Garbage(usize, bool),
    /// Too little to say.
    Wait,
}

/// Looks at the bytes from their beginning.
pub(super) fn next(bytes: &[u8]) -> Next {
    let Some(start) = bytes.iter().position(|byte| *byte == PREAMBLE) else {
        return if bytes.is_empty() { Next::Wait } else { Next::Garbage(bytes.len(), false) };
    };
    if start > 0 {
        return Next::Garbage(start, false);
    }
    let &[_, high, low, ..] = bytes else { return Next::Wait };
    // Six bits in between are always zero.
    if high & 0xFC != 0 {
        return Next::Garbage(1, false);
    }
    let end = HEAD + (usize::from(high) << 8 | usize::from(low));
    let Some(frame) = bytes.get(..end + CHECKSUM) else { return Next::Wait };
    let told = frame[end..].iter().fold(0_u32, |told, byte| told << 8 | u32::from(*byte));
    // A wrong checksum says nothing of where the frame ends: the next one may begin within.
    if checksum(&frame[..end]) == told {
        Next::Message(HEAD..end, end + CHECKSUM)
    } else {
        Next::Garbage(1, true)
    }
}
