//! Observations: MSM4 to MSM7 of one system and one time.

use super::bits::{Bits, two_to};
use super::signals;
use crate::gnss::satellite::{Constellation, Satellite};
use crate::gnss::signal::{LIGHT_M_S, wavelength_m};

/// Metres that light goes in a millisecond.
const MILLISECOND_M: f64 = LIGHT_M_S * 1e-3;
/// So many cells at most (DF396).
const MOST_CELLS: u64 = 64;

/// One signal of one satellite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cell {
    pub(super) satellite: Satellite,
    pub(super) band: u8,
    pub(super) attribute: u8,
    /// 0 where there is none.
    pub(super) code_m: f64,
    pub(super) phase_cycles: f64,
    pub(super) strength_db_hz: f32,
    /// The signal has been held at least so long, and less than that, ms.
    pub(super) held_ms: [u64; 2],
    pub(super) half_cycle: bool,
}

/// A message.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Msm {
    pub(super) constellation: Constellation,
    /// Milliseconds of the system's own week.
    pub(super) tow_ms: u64,
    /// Others of the same time follow.
    pub(super) more: bool,
    pub(super) cells: Vec<Cell>,
}

/// The system and the kind (4 to 7) of a message's number.
pub(super) fn kind(number: u64) -> Option<(Constellation, u64)> {
    let constellation = match number / 10 {
        107 => Constellation::Gps,
        109 => Constellation::Galileo,
        111 => Constellation::Qzss,
        112 => Constellation::Beidou,
        _ => return None,
    };
    (4..=7).contains(&(number % 10)).then_some((constellation, number % 10))
}

/// Whether a message is an MSM of a system that is not read here.
pub(super) fn is_other(number: u64) -> bool {
    matches!(number / 10, 108 | 110 | 113)
}

/// For how long a signal has been held by the indicator of MSM4 and 5 (DF402): at least, and less than, ms.
fn held_coarse_ms(indicator: u64) -> [u64; 2] {
    let least = |indicator: u64| if indicator == 0 { 0 } else { 16 << indicator };
    [least(indicator), if indicator >= 15 { u64::MAX } else { least(indicator + 1) }]
}

/// The same of MSM6 and 7 (DF407).
fn held_fine_ms(indicator: u64) -> [u64; 2] {
    const LAST: u64 = 704;
    let least = |indicator: u64| match indicator {
        0..32 => indicator,
        _ => (32 + indicator % 32) << ((indicator - 32) / 32),
    };
    let indicator = indicator.min(LAST);
    [least(indicator), if indicator == LAST { u64::MAX } else { least(indicator + 1) }]
}

/// Reads a message behind its number.
pub(super) fn read(bits: &mut Bits<'_>, constellation: Constellation, kind: u64) -> Option<Msm> {
    let (fine, with_rates) = (kind >= 6, kind == 5 || kind == 7);
    bits.skip(12)?;
    let tow_ms = bits.unsigned(30)?;
    let more = bits.flag()?;
    bits.skip(3 + 7 + 2 + 2 + 1 + 3)?;
    let satellites = numbers(bits.unsigned(64)?, 64);
    let signals = numbers(bits.unsigned(32)?, 32);
    let count = (satellites.len() * signals.len()) as u64;
    if count > MOST_CELLS || tow_ms >= 604_800_000 {
        return None;
    }
    let mask = bits.unsigned(count as u32)?;
    let is_there = |cell: u64| mask >> (count - 1 - cell) & 1 == 1;
    let cells: Vec<(usize, u32)> = (0..count)
        .filter(|cell| is_there(*cell))
        .map(|cell| (cell as usize / signals.len(), signals[cell as usize % signals.len()]))
        .collect();
    let rough_ms = column(satellites.len(), || bits.unsigned(8))?;
    if with_rates {
        column(satellites.len(), || bits.unsigned(4))?;
    }
    let rough_parts = column(satellites.len(), || bits.unsigned(10))?;
    if with_rates {
        column(satellites.len(), || bits.signed(14))?;
    }
    let (code_bits, phase_bits, held_bits, strength_bits) =
        if fine { (20, 24, 10, 10) } else { (15, 22, 4, 6) };
    let n = cells.len();
    let codes = column(n, || bits.signed(code_bits))?;
    let phases = column(n, || bits.signed(phase_bits))?;
    let held = column(n, || bits.unsigned(held_bits))?;
    let halves = column(n, || bits.flag())?;
    let strengths = column(n, || bits.unsigned(strength_bits))?;
    let (code_step, phase_step) = if fine { (two_to(-29), two_to(-31)) } else { (two_to(-24), two_to(-29)) };
    let known = |value: i64, length: u32| value != -(1 << (length - 1));
    let mut all = Vec::with_capacity(n);
    for (k, (place, signal)) in cells.into_iter().enumerate() {
        let number = satellites[place] as u8;
        let Some((band, attribute)) = signals::signal(constellation, signal) else { continue };
        let Some(wavelength_m) = wavelength_m(constellation, band) else { continue };
        // 255 stands for a range that is not known.
        if rough_ms[place] == 255 {
            continue;
        }
        let rough = rough_ms[place] as f64 + rough_parts[place] as f64 * two_to(-10);
        let range_m = |fine: i64, step: f64| (rough + fine as f64 * step) * MILLISECOND_M;
        let code_m = if known(codes[k], code_bits) { range_m(codes[k], code_step) } else { 0.0 };
        let phase_m = if known(phases[k], phase_bits) { range_m(phases[k], phase_step) } else { 0.0 };
        all.push(Cell {
            satellite: Satellite { constellation, number },
            band,
            attribute,
            code_m,
            phase_cycles: phase_m / wavelength_m,
            strength_db_hz: strengths[k] as f32 * if fine { 0.0625 } else { 1.0 },
            held_ms: if fine { held_fine_ms(held[k]) } else { held_coarse_ms(held[k]) },
            half_cycle: halves[k],
        });
    }
    Some(Msm { constellation, tow_ms, more, cells: all })
}

/// Which bits of a mask are set, counted from 1 at its highest.
fn numbers(mask: u64, length: u32) -> Vec<u32> {
    (1..=length).filter(|number| mask >> (length - number) & 1 == 1).collect()
}

fn column<T>(count: usize, mut read: impl FnMut() -> Option<T>) -> Option<Vec<T>> {
    (0..count).map(|_| read()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lock_times_are_those_of_the_standard_s_tables() {
        assert_eq!([0, 1, 2, 15].map(held_coarse_ms).map(|[least, _]| least), [0, 32, 64, 524_288]);
        // Ends of rows of the table: 2 i − 64, 4 i − 256, 8 i − 768, and the last.
        for (indicator, least) in
            [(63, 63), (64, 64), (95, 126), (96, 128), (128, 256), (160, 512), (704, 67_108_864)]
        {
            assert_eq!(held_fine_ms(indicator)[0], least, "{indicator}");
        }
        assert_eq!(held_fine_ms(1_023), [67_108_864, u64::MAX]);
    }
}
