//! The binary device frame: little-endian, 16 bytes of header, then the readings, as `docs/wire.md` lays it out. Any
//! microcontroller can write it with a `memcpy`.
//!
//! Version 1 is of an inertial sensor. Version 2 says in byte 14 what the readings are, and in byte 15 how many numbers a
//! row has where they are rows.

use crate::parse::batch::{self, Batch, StreamKey};
use crate::parse::error::{ParseError, ParseErrorKind};
use crate::stream::{Readings, Rows};

const MAGIC: [u8; 2] = *b"LS";
const HEADER_BYTES: usize = 16;
const SAMPLE_BYTES: usize = 88;
/// Byte 14 of version 2: samples of an inertial sensor, or rows of numbers.
const IMU: u8 = 0;
const VALUES: u8 = 1;

/// The length of the longest frame, bytes.
pub const MOST_BYTES: usize = HEADER_BYTES + 8 * (1 + Rows::MOST_COLUMNS) * Batch::MOST_SAMPLES;

/// What a header says.
struct Header {
    stream: u8,
    sequence: u64,
    readings: usize,
    /// Numbers in a row; `None` for samples of an inertial sensor.
    columns: Option<usize>,
}

impl Header {
    fn reading_bytes(&self) -> usize {
        self.columns.map_or(SAMPLE_BYTES, |columns| 8 * (1 + columns))
    }

    fn frame_bytes(&self) -> usize {
        HEADER_BYTES + self.readings * self.reading_bytes()
    }
}

/// Appends a batch to `out` as one frame, under the number of its stream: of version 1 where that can say it.
///
/// # Errors
///
/// When the batch holds no reading or more than [`Batch::MOST_SAMPLES`].
pub fn encode(number: u8, batch: &Batch, out: &mut Vec<u8>) -> Result<(), ParseError> {
    batch::check_size(batch.readings.len())?;
    let n = u16::try_from(batch.readings.len()).expect("check_size allows at most 1,000");
    let (version, kind, columns) = match &batch.readings {
        Readings::Imu(_) if number < 2 => (1, 0, 0),
        Readings::Imu(_) => (2, IMU, 0),
        Readings::Values(rows) => (2, VALUES, u8::try_from(rows.columns()).unwrap_or(u8::MAX)),
    };
    out.extend_from_slice(&MAGIC);
    out.extend_from_slice(&[version, number]);
    out.extend_from_slice(&batch.sequence.to_le_bytes());
    out.extend_from_slice(&n.to_le_bytes());
    out.extend_from_slice(&[kind, columns]);
    match &batch.readings {
        Readings::Imu(samples) => {
            out.reserve(SAMPLE_BYTES * samples.len());
            for sample in samples {
                out.extend_from_slice(&sample.t_ns.to_le_bytes());
                for value in batch::channels(sample) {
                    out.extend_from_slice(&value.to_le_bytes());
                }
            }
        }
        Readings::Values(rows) => {
            for (t_ns, values) in rows.iter() {
                out.extend_from_slice(&t_ns.to_le_bytes());
                for value in values {
                    out.extend_from_slice(&value.to_le_bytes());
                }
            }
        }
    }
    Ok(())
}

/// How long the frame is that `bytes` begin with, by its header, bytes: where frames stand one after the other.
///
/// # Errors
///
/// When there is no header of a frame of a known version.
pub fn length(bytes: &[u8]) -> Result<usize, ParseError> {
    let (header, _) = header(bytes)?;
    batch::check_size(header.readings)?;
    Ok(header.frame_bytes())
}

/// Reads one frame, which must be exactly as long as its header says.
///
/// # Errors
///
/// When the header is not that of a frame of a known version, or the length does not fit it.
pub fn decode(bytes: &[u8]) -> Result<Batch, ParseError> {
    let (header, body) = header(bytes)?;
    batch::check_size(header.readings)?;
    if bytes.len() != header.frame_bytes() {
        let a_reading = header.reading_bytes();
        return Err(ParseError::new(
            ParseErrorKind::FrameLength,
            format!("{} bytes, for {} samples", header.frame_bytes(), header.readings),
            format!("{} bytes", bytes.len()),
            format!("send 16 + {a_reading}·n bytes, with n in bytes 12 and 13"),
        ));
    }
    let number = |bytes: &[u8; 8]| f64::from_le_bytes(*bytes);
    let readings = match header.columns {
        None => {
            let (samples, _) = body.as_chunks::<SAMPLE_BYTES>();
            let samples = samples.iter().map(|bytes| {
                let (words, _) = bytes.as_chunks::<8>();
                let channels = std::array::from_fn(|channel| number(&words[1 + channel]));
                batch::sample(i64::from_le_bytes(words[0]), channels)
            });
            Readings::Imu(samples.collect())
        }
        Some(columns) => {
            let (words, _) = body.as_chunks::<8>();
            let mut rows = Rows::new(columns);
            for row in words.chunks_exact(1 + columns) {
                rows.push(i64::from_le_bytes(row[0]), row[1..].iter().map(number));
            }
            Readings::Values(rows)
        }
    };
    Ok(Batch { stream: StreamKey::Number(header.stream), sequence: header.sequence, readings })
}

/// The header of a frame, and what follows it.
fn header(bytes: &[u8]) -> Result<(Header, &[u8]), ParseError> {
    let Some((header, body)) = bytes.split_first_chunk::<HEADER_BYTES>() else {
        return Err(ParseError::new(
            ParseErrorKind::FrameLength,
            format!("a frame of at least {} bytes", HEADER_BYTES + SAMPLE_BYTES),
            format!("{} bytes", bytes.len()),
            "send each frame whole, as one binary message",
        ));
    };
    if header[..2] != MAGIC {
        return Err(wrong_header(
            "the bytes 4C 53 at the start",
            format!("{:02X} {:02X}", header[0], header[1]),
        ));
    }
    let found = format!("{:02X} {:02X}", header[14], header[15]);
    let columns = match (header[2], header[14], header[15]) {
        (1, 0, 0) => None,
        (1, ..) => return Err(wrong_header("zeros in bytes 14 and 15", found)),
        (2, IMU, 0) => None,
        (2, VALUES, columns) if (1..=Rows::MOST_COLUMNS).contains(&usize::from(columns)) => {
            Some(usize::from(columns))
        }
        (2, ..) => {
            let expected = format!(
                "00 00 (inertial sensor), or 01 and the numbers in a row, 1 to {}, in bytes 14 and 15",
                Rows::MOST_COLUMNS
            );
            return Err(wrong_header(&expected, found));
        }
        (version, ..) => return Err(wrong_header("version 1 or 2 in byte 2", format!("{version}"))),
    };
    if header[2] == 1 && header[3] > 1 {
        return Err(wrong_header("stream 0 or 1 in byte 3 of version 1", format!("{}", header[3])));
    }
    let mut sequence = [0; 8];
    sequence.copy_from_slice(&header[4..12]);
    let header = Header {
        stream: header[3],
        sequence: u64::from_le_bytes(sequence),
        readings: usize::from(u16::from_le_bytes([header[12], header[13]])),
        columns,
    };
    Ok((header, body))
}

fn wrong_header(expected: &str, found: String) -> ParseError {
    ParseError::new(
        ParseErrorKind::FrameHeader,
        expected,
        found,
        "build the frame as the device protocol lays it out: \"LS\", version, stream, sequence, count, kind, columns",
    )
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::sample::ImuSample;

    fn finite() -> impl Strategy<Value = f64> {
        prop::num::f64::ANY.prop_filter("missing values are told apart by NaN", |x| !x.is_nan())
    }

    prop_compose! {
        fn any_sample()(
            t_ns in any::<i64>(),
            w_ib_b_rad_s in prop::array::uniform3(finite()),
            f_b_m_s2 in prop::array::uniform3(finite()),
            mag_b_ut in prop::option::of(prop::array::uniform3(finite())),
            pressure_hpa in prop::option::of(finite()),
        ) -> ImuSample {
            ImuSample { t_ns, w_ib_b_rad_s, f_b_m_s2, mag_b_ut, pressure_hpa }
        }
    }

    fn one_sample() -> Batch {
        let sample = ImuSample {
            t_ns: 5,
            w_ib_b_rad_s: [0.1, 0.2, 0.3],
            f_b_m_s2: [0.0, 0.0, 9.8],
            mag_b_ut: None,
            pressure_hpa: Some(900.0),
        };
        Batch { stream: StreamKey::Number(1), sequence: 7, readings: Readings::Imu(vec![sample]) }
    }

    fn samples(batch: &mut Batch) -> &mut Vec<ImuSample> {
        let Readings::Imu(samples) = &mut batch.readings else { panic!("samples") };
        samples
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_again(
            right in any::<bool>(),
            sequence in any::<u64>(),
            samples in prop::collection::vec(any_sample(), 1..20),
        ) {
            let number = u8::from(right);
            let n = samples.len();
            let batch = Batch { stream: StreamKey::Number(number), sequence, readings: Readings::Imu(samples) };
            let mut bytes = Vec::new();
            encode(number, &batch, &mut bytes).unwrap();
            prop_assert_eq!(bytes.len(), 16 + 88 * n);
            prop_assert_eq!(decode(&bytes).unwrap(), batch);
        }

        #[test]
        fn rows_that_are_written_are_read_again(
            number in any::<u8>(),
            sequence in any::<u64>(),
            columns in 1..=Rows::MOST_COLUMNS,
            given in prop::collection::vec((any::<i64>(), prop::num::f64::ANY), 1..20),
        ) {
            let mut rows = Rows::new(columns);
            for (t_ns, value) in given {
                rows.push(t_ns, [value]);
            }
            let batch = Batch { stream: StreamKey::Number(number), sequence, readings: Readings::Values(rows) };
            let mut bytes = Vec::new();
            encode(number, &batch, &mut bytes).unwrap();
            prop_assert_eq!(length(&bytes).unwrap(), bytes.len());
            prop_assert_eq!(decode(&bytes).unwrap(), batch);
        }

        #[test]
        fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
            let _ = decode(&bytes);
        }

        #[test]
        fn a_damaged_header_never_panics(at in 0_usize..16, value in any::<u8>()) {
            let mut bytes = Vec::new();
            encode(1, &one_sample(), &mut bytes).unwrap();
            bytes[at] = value;
            let _ = decode(&bytes);
        }
    }

    #[test]
    fn a_frame_is_exactly_as_long_as_it_says() {
        let mut bytes = Vec::new();
        encode(1, &one_sample(), &mut bytes).unwrap();
        assert_eq!(decode(&bytes[..bytes.len() - 1]).unwrap_err().code(), "frame_length");
        bytes.push(0);
        let error = decode(&bytes).unwrap_err();
        assert_eq!(
            error.to_string(),
            "expected 104 bytes, for 1 samples, found 105 bytes; send 16 + 88·n bytes, with n in bytes 12 and 13"
        );
        assert_eq!(decode(b"LS").unwrap_err().code(), "frame_length");
    }

    #[test]
    fn a_wrong_header_is_named() {
        let mut good = Vec::new();
        encode(1, &one_sample(), &mut good).unwrap();
        for (at, code) in
            [(0, "frame_header"), (2, "frame_header"), (3, "frame_header"), (15, "frame_header")]
        {
            let mut bytes = good.clone();
            bytes[at] = 9;
            assert_eq!(decode(&bytes).unwrap_err().code(), code, "byte {at}");
        }
        let mut bytes = good.clone();
        bytes[12] = 0;
        assert_eq!(decode(&bytes).unwrap_err().code(), "batch_size");
        bytes[12..14].copy_from_slice(&1001_u16.to_le_bytes());
        assert_eq!(decode(&bytes).unwrap_err().code(), "batch_size");
    }

    #[test]
    fn a_magnetometer_without_one_axis_says_nothing() {
        let mut bytes = Vec::new();
        let mut batch = one_sample();
        samples(&mut batch)[0].mag_b_ut = Some([1.0, 2.0, f64::NAN]);
        samples(&mut batch)[0].w_ib_b_rad_s[0] = f64::NAN;
        encode(1, &batch, &mut bytes).unwrap();
        let mut read = decode(&bytes).unwrap();
        assert_eq!(samples(&mut read)[0].mag_b_ut, None);
        assert!(samples(&mut read)[0].w_ib_b_rad_s[0].is_nan());
    }
}
