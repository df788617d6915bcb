//! Systems and their satellites.

use std::fmt;

/// A satellite system whose orbits are known here.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Constellation {
    /// GPS.
    Gps,
    /// BeiDou.
    Beidou,
    /// Galileo.
    Galileo,
    /// QZSS.
    Qzss,
}

impl Constellation {
    /// All, in the order in which they are worked on.
    pub const ALL: [Constellation; 4] =
        [Constellation::Gps, Constellation::Beidou, Constellation::Galileo, Constellation::Qzss];

    /// The system that RINEX spells with this letter; none of those whose orbits are not known here.
    pub fn from_letter(letter: u8) -> Option<Constellation> {
        match letter {
            b'G' => Some(Constellation::Gps),
            b'C' => Some(Constellation::Beidou),
            b'E' => Some(Constellation::Galileo),
            b'J' => Some(Constellation::Qzss),
            _ => None,
        }
    }

    /// As RINEX spells it.
    pub fn letter(self) -> char {
        match self {
            Constellation::Gps => 'G',
            Constellation::Beidou => 'C',
            Constellation::Galileo => 'E',
            Constellation::Qzss => 'J',
        }
    }

    /// Its place in [`Constellation::ALL`].
    pub fn index(self) -> usize {
        self as usize
    }
}

/// One satellite.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Satellite {
    /// Its system.
    pub constellation: Constellation,
    /// Its number within the system.
    pub number: u8,
}

impl Satellite {
    /// Reads `G05`, `G 5`, or `5` where `system` stands for the missing letter. None of another system, or where no number stands.
    pub fn read(text: &[u8], system: u8) -> Option<Satellite> {
        let letter = *text.first()?;
        let letter = if letter == b' ' { system } else { letter };
        let digits = text.get(1..3)?;
        let number = match digits {
            [b' ', unit] if unit.is_ascii_digit() => unit - b'0',
            [ten, unit] if ten.is_ascii_digit() && unit.is_ascii_digit() => (ten - b'0') * 10 + unit - b'0',
            _ => return None,
        };
        let constellation = Constellation::from_letter(letter)?;
        // RINEX 2 numbers QZSS from 193 on, and 3 from 1: two digits hold only the latter.
        (number > 0).then_some(Satellite { constellation, number })
    }

    /// Whether it is a geostationary one of BeiDou, whose orbit is told in an inclined frame.
    pub fn is_beidou_geostationary(self) -> bool {
        self.constellation == Constellation::Beidou && (self.number <= 5 || self.number >= 59)
    }
}

impl fmt::Display for Satellite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{:02}", self.constellation.letter(), self.number)
    }
}

impl fmt::Debug for Satellite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_satellite_is_read_with_a_blank_and_without_a_letter() {
        for text in ["G05", "G 5", "  5"] {
            assert_eq!(Satellite::read(text.as_bytes(), b'G').unwrap().to_string(), "G05");
        }
        assert_eq!(Satellite::read(b"R05", b'G'), None);
        assert_eq!(Satellite::read(b"G  ", b'G'), None);
        assert!(Satellite::read(b"C59", b'G').unwrap().is_beidou_geostationary());
    }
}
