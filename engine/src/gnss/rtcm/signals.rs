//! What the numbers of signals stand for (tables of DF395).

use crate::gnss::satellite::Constellation;

/// Band and way of tracking of a signal's number, as RINEX 3 spells them.
pub(super) fn signal(constellation: Constellation, number: u32) -> Option<(u8, u8)> {
    let name: &[u8; 2] = match (constellation, number) {
        (Constellation::Beidou, _) => return beidou(number),
        (_, 2) => b"1C",
        (Constellation::Gps, 3) => b"1P",
        (Constellation::Gps, 4) => b"1W",
        (Constellation::Gps, 8) => b"2C",
        (Constellation::Gps, 9) => b"2P",
        (Constellation::Gps, 10) => b"2W",
        (Constellation::Gps | Constellation::Qzss, 15) => b"2S",
        (Constellation::Gps | Constellation::Qzss, 16) => b"2L",
        (Constellation::Gps | Constellation::Qzss, 17) => b"2X",
        (Constellation::Gps | Constellation::Qzss, 30) => b"1S",
        (Constellation::Gps | Constellation::Qzss, 31) => b"1L",
        (Constellation::Gps | Constellation::Qzss, 32) => b"1X",
        (Constellation::Qzss, 9) => b"6S",
        (Constellation::Qzss, 10) => b"6L",
        (Constellation::Qzss, 11) => b"6X",
        (Constellation::Galileo, 3) => b"1A",
        (Constellation::Galileo, 4) => b"1B",
        (Constellation::Galileo, 5) => b"1X",
        (Constellation::Galileo, 6) => b"1Z",
        (Constellation::Galileo, 8) => b"6C",
        (Constellation::Galileo, 9) => b"6A",
        (Constellation::Galileo, 10) => b"6B",
        (Constellation::Galileo, 11) => b"6X",
        (Constellation::Galileo, 12) => b"6Z",
        (Constellation::Galileo, 14) => b"7I",
        (Constellation::Galileo, 15) => b"7Q",
        (Constellation::Galileo, 16) => b"7X",
        (Constellation::Galileo, 18) => b"8I",
        (Constellation::Galileo, 19) => b"8Q",
        (Constellation::Galileo, 20) => b"8X",
        (_, 22) => b"5I",
        (_, 23) => b"5Q",
        (_, 24) => b"5X",
        _ => return None,
    };
    Some((name[0] - b'0', name[1]))
}

fn beidou(number: u32) -> Option<(u8, u8)> {
    let name: &[u8; 2] = match number {
        2 => b"2I",
        3 => b"2Q",
        4 => b"2X",
        8 => b"6I",
        9 => b"6Q",
        10 => b"6X",
        14 => b"7I",
        15 => b"7Q",
        16 => b"7X",
        22 => b"5D",
        23 => b"5P",
        24 => b"5X",
        25 => b"7D",
        30 => b"1D",
        31 => b"1P",
        32 => b"1X",
        _ => return None,
    };
    Some((name[0] - b'0', name[1]))
}
