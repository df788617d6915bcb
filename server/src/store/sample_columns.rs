//! Samples by columns, for their column in the database: what a logger wrote with some decimals takes as many bits as
//! those need, and comes back to the bit.
//!
//! Eleven columns, one after the other: the time, then gyr x y z, acc x y z, mag x y z, pressure. Each begins with a
//! byte that says how it is written:
//!
//! | byte | what follows |
//! |---|---|
//! | 0 … 9 | decimals d: of each value v the whole number n = v · 10^d, as the difference to the one before, zigzag, in groups of seven bits, low first; then the places of negative zeros: how many, and each as the distance from the one before |
//! | 253 | whole numbers (the time): the first, then the first difference, then differences of differences, in the same groups |
//! | 254 | nothing: every value is missing |
//! | 255 | every value as eight bytes, little-endian; a missing one is NaN |

use std::cell::Cell;

use lodestep_engine::sample::ImuSample;
use lodestep_engine::stream::Rows;

const WHOLE: u8 = 253;
const MISSING: u8 = 254;
const PLAIN: u8 = 255;
const MOST_DECIMALS: u8 = 9;
/// Larger whole numbers are not exact in a double.
const LARGEST_WHOLE: f64 = 9_007_199_254_740_992.0;
const CHANNELS: usize = 10;

/// Appends the columns of these samples.
pub(super) fn write(samples: &[ImuSample], out: &mut Vec<u8>) {
    let mut values = Vec::with_capacity(samples.len());
    out.push(WHOLE);
    let (mut before, mut step) = (0_i64, 0_i64);
    for sample in samples {
        let difference = sample.t_ns.wrapping_sub(before);
        push_signed(difference.wrapping_sub(step), out);
        (before, step) = (sample.t_ns, difference);
    }
    for channel in 0..CHANNELS {
        values.clear();
        values.extend(samples.iter().map(|sample| value(sample, channel)));
        write_column(channel, &values, out);
    }
}

/// Appends the columns of these rows: how many there are, then the time and each of them as above.
pub(super) fn write_rows(rows: &Rows, out: &mut Vec<u8>) {
    push_unsigned(rows.columns() as u64, out);
    let (mut before, mut step) = (0_i64, 0_i64);
    out.push(WHOLE);
    for (t_ns, _) in rows.iter() {
        let difference = t_ns.wrapping_sub(before);
        push_signed(difference.wrapping_sub(step), out);
        (before, step) = (t_ns, difference);
    }
    let mut values = Vec::with_capacity(rows.len());
    for column in 0..rows.columns() {
        values.clear();
        values.extend(rows.iter().map(|(_, row)| row[column]));
        write_column(column % CHANNELS, &values, out);
    }
}

/// Reads so many rows back.
pub(super) fn read_rows(bytes: &[u8], count: usize) -> Result<Rows, &'static str> {
    if count > bytes.len() {
        return Err("fewer bytes than rows");
    }
    let mut reader = Reader(bytes);
    let columns = usize::try_from(reader.unsigned()?).unwrap_or(usize::MAX);
    if columns > Rows::MOST_COLUMNS {
        return Err("more columns than a row has");
    }
    if reader.byte()? != WHOLE {
        return Err("the time is not written as whole numbers");
    }
    let (mut before, mut step, mut times) = (0_i64, 0_i64, Vec::with_capacity(count));
    for _ in 0..count {
        step = step.wrapping_add(reader.signed()?);
        before = before.wrapping_add(step);
        times.push(before);
    }
    let mut read = vec![Vec::new(); columns];
    for values in &mut read {
        reader.column(count, values)?;
    }
    if !reader.0.is_empty() {
        return Err("more bytes than rows");
    }
    let mut rows = Rows::new(columns);
    for (number, t_ns) in times.into_iter().enumerate() {
        rows.push(t_ns, read.iter().map(|values| values[number]));
    }
    Ok(rows)
}

fn value(sample: &ImuSample, channel: usize) -> f64 {
    match channel {
        0..=2 => sample.w_ib_b_rad_s[channel],
        3..=5 => sample.f_b_m_s2[channel - 3],
        6..=8 => sample.mag_b_ut.map_or(f64::NAN, |mag_ut| mag_ut[channel - 6]),
        _ => sample.pressure_hpa.unwrap_or(f64::NAN),
    }
}

thread_local! {
    /// How many decimals each channel had last: devices seldom change their mind.
    static DECIMALS: Cell<[u8; CHANNELS]> = const { Cell::new([0; CHANNELS]) };
}

fn write_column(channel: usize, values: &[f64], out: &mut Vec<u8>) {
    // Missing is one NaN of all; another may be a reading that broke, and stays what it was.
    if values.iter().all(|value| value.to_bits() == f64::NAN.to_bits()) {
        return out.push(MISSING);
    }
    let start = out.len();
    let mut hints = DECIMALS.get();
    for decimals in std::iter::once(hints[channel]).chain(0..=MOST_DECIMALS) {
        if push_decimals(decimals, values, out) {
            hints[channel] = decimals;
            DECIMALS.set(hints);
            return;
        }
        out.truncate(start);
    }
    out.push(PLAIN);
    for value in values {
        out.extend_from_slice(&value.to_le_bytes());
    }
}

/// Writes a column as whole numbers of that many decimals, where that says all of it.
fn push_decimals(decimals: u8, values: &[f64], out: &mut Vec<u8>) -> bool {
    let scale = 10_f64.powi(i32::from(decimals));
    out.push(decimals);
    let mut before = 0_i64;
    let mut negative_zeros = 0_u64;
    for value in values {
        let whole = nearest_whole(value * scale);
        if whole.is_nan() || whole.abs() >= LARGEST_WHOLE {
            return false;
        }
        let back = whole / scale;
        if back.to_bits() != value.to_bits() {
            return false;
        }
        negative_zeros += u64::from(is_negative_zero(back));
        let whole = whole as i64;
        push_signed(whole - before, out);
        before = whole;
    }
    push_unsigned(negative_zeros, out);
    if negative_zeros > 0 {
        let mut last = 0;
        for (place, _) in values.iter().enumerate().filter(|(_, value)| is_negative_zero(**value)) {
            push_unsigned((place - last) as u64, out);
            last = place;
        }
    }
    true
}

/// The whole number next to a value, the sign of zero kept; larger ones than [`LARGEST_WHOLE`] come out wrong and are
/// turned down by their size. Two additions, where the general rounding is a call for each value on an older processor.
fn nearest_whole(value: f64) -> f64 {
    // From here to twice as much, doubles are whole numbers.
    const WHOLE_FROM: f64 = 4_503_599_627_370_496.0;
    let shift = WHOLE_FROM.copysign(value);
    if value.abs() < WHOLE_FROM { ((value + shift) - shift).copysign(value) } else { value }
}

fn is_negative_zero(value: f64) -> bool {
    value.to_bits() == (-0.0_f64).to_bits()
}

fn push_signed(value: i64, out: &mut Vec<u8>) {
    push_unsigned(((value << 1) ^ (value >> 63)) as u64, out);
}

fn push_unsigned(mut value: u64, out: &mut Vec<u8>) {
    while value >= 0x80 {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

/// Reads so many samples back; what is wrong with the bytes, where they are not what `write` makes.
pub(super) fn read(bytes: &[u8], samples: usize) -> Result<Vec<ImuSample>, &'static str> {
    // Each sample takes a byte at least, so that a wrong count does not ask for memory.
    if samples > bytes.len() {
        return Err("fewer bytes than samples");
    }
    let mut reader = Reader(bytes);
    if reader.byte()? != WHOLE {
        return Err("the time is not written as whole numbers");
    }
    let missing =
        ImuSample { t_ns: 0, w_ib_b_rad_s: [0.0; 3], f_b_m_s2: [0.0; 3], mag_b_ut: None, pressure_hpa: None };
    let mut read = vec![missing; samples];
    let (mut before, mut step) = (0_i64, 0_i64);
    for sample in &mut read {
        step = step.wrapping_add(reader.signed()?);
        before = before.wrapping_add(step);
        sample.t_ns = before;
    }
    let mut mag_ut = vec![[f64::NAN; 3]; samples];
    let mut values = Vec::with_capacity(samples);
    for channel in 0..CHANNELS {
        reader.column(samples, &mut values)?;
        for (k, value) in values.iter().copied().enumerate() {
            match channel {
                0..=2 => read[k].w_ib_b_rad_s[channel] = value,
                3..=5 => read[k].f_b_m_s2[channel - 3] = value,
                6..=8 => mag_ut[k][channel - 6] = value,
                _ => read[k].pressure_hpa = (!value.is_nan()).then_some(value),
            }
        }
    }
    for (sample, mag_ut) in read.iter_mut().zip(mag_ut) {
        // Three NaN stand for a missing reading; one alone is a broken axis, and stays what it was.
        sample.mag_b_ut = (!mag_ut.iter().all(|value| value.is_nan())).then_some(mag_ut);
    }
    if reader.0.is_empty() { Ok(read) } else { Err("more bytes than samples") }
}

struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn byte(&mut self) -> Result<u8, &'static str> {
        let (first, rest) = self.0.split_first().ok_or("it is cut short")?;
        self.0 = rest;
        Ok(*first)
    }

    fn unsigned(&mut self) -> Result<u64, &'static str> {
        let mut value = 0_u64;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7F) << shift;
            if byte < 0x80 {
                return Ok(value);
            }
        }
        Err("a number has too many bytes")
    }

    fn signed(&mut self) -> Result<i64, &'static str> {
        let value = self.unsigned()?;
        Ok((value >> 1) as i64 ^ -((value & 1) as i64))
    }

    fn column(&mut self, samples: usize, values: &mut Vec<f64>) -> Result<(), &'static str> {
        values.clear();
        match self.byte()? {
            MISSING => values.resize(samples, f64::NAN),
            PLAIN => {
                let (plain, rest) = self.0.split_at_checked(8 * samples).ok_or("it is cut short")?;
                self.0 = rest;
                values.extend(plain.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes)));
            }
            decimals @ 0..=MOST_DECIMALS => {
                let scale = 10_f64.powi(i32::from(decimals));
                let mut whole = 0_i64;
                for _ in 0..samples {
                    whole = whole.wrapping_add(self.signed()?);
                    values.push(whole as f64 / scale);
                }
                let mut place = 0_usize;
                for _ in 0..self.unsigned()? {
                    place = place.saturating_add(usize::try_from(self.unsigned()?).unwrap_or(usize::MAX));
                    *values.get_mut(place).ok_or("a negative zero stands beyond the end")? = -0.0;
                }
            }
            _ => return Err("a column is written in an unknown way"),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use lodestep_engine::geo::Site;
    use lodestep_engine::sim::pedestrian::{SensorModel, Simulator, WalkKind};
    use proptest::prelude::*;

    use super::*;

    /// Equal to the bit, NaN included.
    fn bits(samples: &[ImuSample]) -> Vec<(i64, Vec<u64>)> {
        samples
            .iter()
            .map(|s| (s.t_ns, (0..CHANNELS).map(|channel| value(s, channel).to_bits()).collect()))
            .collect()
    }

    fn any_value() -> impl Strategy<Value = f64> {
        prop_oneof![
            4 => (-2_000_000_i64..2_000_000, 0..8_i32).prop_map(|(n, d)| n as f64 / 10_f64.powi(d)),
            1 => any::<f64>().prop_filter("a missing value is told by None", |value| !value.is_nan()),
            1 => Just(-0.0),
        ]
    }

    prop_compose! {
        fn any_sample()(
            t_ns in any::<i64>(),
            w_ib_b_rad_s in prop::array::uniform3(any_value()),
            f_b_m_s2 in prop::array::uniform3(any_value()),
            mag_b_ut in prop::option::of(prop::array::uniform3(any_value())),
            pressure_hpa in prop::option::of(any_value()),
        ) -> ImuSample {
            ImuSample { t_ns, w_ib_b_rad_s, f_b_m_s2, mag_b_ut, pressure_hpa }
        }
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_again_to_the_bit(samples in prop::collection::vec(any_sample(), 0..40)) {
            let mut bytes = Vec::new();
            write(&samples, &mut bytes);
            prop_assert_eq!(bits(&read(&bytes, samples.len()).unwrap()), bits(&samples));
        }

        #[test]
        fn any_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..200), samples in 0_usize..300) {
            if let Ok(read) = read(&bytes, samples) {
                prop_assert_eq!(read.len(), samples);
            }
        }
    }

    #[test]
    fn a_reading_of_which_one_axis_broke_stays_what_it_was() {
        let broken = ImuSample {
            t_ns: 5,
            w_ib_b_rad_s: [0.5, f64::NAN, f64::INFINITY],
            f_b_m_s2: [0.1, -0.0, 9.81],
            mag_b_ut: Some([20.0, f64::NAN, -30.5]),
            pressure_hpa: None,
        };
        let mut bytes = Vec::new();
        write(&[broken, broken], &mut bytes);
        assert_eq!(bits(&read(&bytes, 2).unwrap()), bits(&[broken, broken]));
    }

    #[test]
    fn a_log_with_decimals_takes_a_third_of_its_bytes() {
        let mut simulator = Simulator::new(&WalkKind::Rectangle, 3, &Site::fast(), &SensorModel::cmp10a());
        let samples: Vec<_> = std::iter::from_fn(|| simulator.next_epoch())
            .take(4_000)
            .map(|epoch| epoch.samples[0].as_logged())
            .collect();
        let mut bytes = Vec::new();
        for batch in samples.chunks(20) {
            let start = bytes.len();
            write(batch, &mut bytes);
            assert_eq!(bits(&read(&bytes[start..], batch.len()).unwrap()), bits(batch));
        }
        let per_sample = bytes.len() as f64 / samples.len() as f64;
        assert!(per_sample < 32.0, "{per_sample} bytes a sample, of 88");
    }

    proptest! {
        #[test]
        fn rows_come_back_to_the_bit_and_cut_ones_are_refused(
            columns in 1..6_usize,
            given in prop::collection::vec((any::<i64>(), prop::collection::vec(prop::num::f64::ANY, 0..6)), 1..30),
            cut in 0..40_usize,
        ) {
            let mut rows = Rows::new(columns);
            for (t_ns, values) in &given {
                rows.push(*t_ns, values.iter().copied());
            }
            let mut bytes = Vec::new();
            write_rows(&rows, &mut bytes);
            prop_assert_eq!(&read_rows(&bytes, rows.len()).unwrap(), &rows);
            if cut < bytes.len() {
                prop_assert!(read_rows(&bytes[..cut], rows.len()).is_err());
            }
        }
    }
}
