//! Where a base is: 1005 and 1006.

use super::bits::Bits;

/// A base by its own account.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Station {
    /// Its number with the sender.
    pub number: u16,
    /// The antenna's reference point, Earth-centred, m.
    pub position_m: [f64; 3],
    /// The antenna above it, m; 0 where the message does not say.
    pub antenna_height_m: f64,
}

/// Reads 1005, or 1006 with a height, behind the message's number.
pub(super) fn read(bits: &mut Bits<'_>, has_height: bool) -> Option<Station> {
    const STEP_M: f64 = 0.0001;
    let number = bits.unsigned(12)? as u16;
    bits.skip(6 + 4)?;
    let x = bits.signed(38)?;
    bits.skip(2)?;
    let y = bits.signed(38)?;
    bits.skip(2)?;
    let z = bits.signed(38)?;
    let height = if has_height { bits.unsigned(16)? } else { 0 };
    Some(Station {
        number,
        position_m: [x, y, z].map(|axis| axis as f64 * STEP_M),
        antenna_height_m: height as f64 * STEP_M,
    })
}
