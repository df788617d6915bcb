//! A WitMotion dump out of packets whose sums are right, which bytes at random hardly ever are.

use lodestep_engine::parse::ReadOptions;

use crate::any_log;

/// The first byte: whether a rate is given, and where the dump is cut. Then nine bytes a packet, its kind and
/// its data; or, where the kind's first bit is set, these bytes as they are.
pub(crate) fn run(bytes: &[u8]) {
    let Some((said, packets)) = bytes.split_first() else { return };
    let mut dump = Vec::with_capacity(2 * packets.len());
    for packet in packets.chunks(9) {
        match packet {
            [kind, data @ ..] if *kind < 0x80 && data.len() == 8 => {
                let from = dump.len();
                dump.extend([0x55, 0x50 | kind & 0x0F]);
                dump.extend(data);
                dump.push(dump[from..].iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte)));
            }
            junk => dump.extend(junk),
        }
    }
    let rate_hz = (said & 1 != 0).then_some(200.0);
    let field_ut_per_count = (said & 2 != 0).then_some(0.15);
    any_log::check(
        &ReadOptions { rate_hz, field_ut_per_count, ..ReadOptions::default() },
        &dump,
        1 + usize::from(*said),
    );
}
