//! Numbers of any length in a row of bits, the highest first.

/// Reads one after the other; none beyond the end.
#[derive(Clone, Debug)]
pub(super) struct Bits<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Bits<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Bits<'a> {
        Bits { bytes, at: 0 }
    }

    /// An unsigned number of so many bits, at most 64.
    pub(super) fn unsigned(&mut self, length: u32) -> Option<u64> {
        let end = self.at.checked_add(length as usize)?;
        if length > 64 || end > 8 * self.bytes.len() {
            return None;
        }
        let mut value = 0_u64;
        for at in self.at..end {
            let bit = self.bytes[at / 8] >> (7 - at % 8) & 1;
            value = value << 1 | u64::from(bit);
        }
        self.at = end;
        Some(value)
    }

    /// A number in two's complement.
    pub(super) fn signed(&mut self, length: u32) -> Option<i64> {
        let value = self.unsigned(length)?;
        let above = 64 - length;
        Some((value << above) as i64 >> above)
    }

    /// A signed number in steps of 2 to this power.
    pub(super) fn scaled(&mut self, length: u32, power: i32) -> Option<f64> {
        Some(self.signed(length)? as f64 * two_to(power))
    }

    /// An unsigned one.
    pub(super) fn scaled_unsigned(&mut self, length: u32, power: i32) -> Option<f64> {
        Some(self.unsigned(length)? as f64 * two_to(power))
    }

    pub(super) fn flag(&mut self) -> Option<bool> {
        Some(self.unsigned(1)? == 1)
    }

    pub(super) fn skip(&mut self, length: u32) -> Option<()> {
        self.unsigned(length).map(|_| ())
    }
}

/// 2 to a power, to the last bit.
pub(super) fn two_to(power: i32) -> f64 {
    libm::ldexp(1.0, power)
}
