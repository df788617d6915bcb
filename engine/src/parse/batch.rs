//! What a device sends at once: some readings of one stream, numbered.

use crate::parse::error::{ParseError, ParseErrorKind};
use crate::sample::ImuSample;
use crate::stream::{Readings, StreamId};

/// Which stream a batch is of: a frame says it by its number within the session, a message by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StreamKey {
    /// Its number.
    Number(u8),
    /// Its name.
    Id(StreamId),
}

/// A run of readings of one stream; each stream counts its own batches from 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Batch {
    /// The stream.
    pub stream: StreamKey,
    /// Which batch of this stream it is, from 0.
    pub sequence: u64,
    /// The readings in the order of the stream's log.
    pub readings: Readings,
}

impl Batch {
    /// The most samples that one batch may hold: five seconds at 200 Hz.
    pub const MOST_SAMPLES: usize = 1_000;

    /// Of an inertial sensor.
    pub fn imu(stream: StreamId, sequence: u64, samples: Vec<ImuSample>) -> Batch {
        Batch { stream: StreamKey::Id(stream), sequence, readings: Readings::Imu(samples) }
    }
}

/// Refuses a batch that is empty or would hold more than [`Batch::MOST_SAMPLES`].
pub(super) fn check_size(samples: usize) -> Result<(), ParseError> {
    if (1..=Batch::MOST_SAMPLES).contains(&samples) {
        return Ok(());
    }
    Err(ParseError::new(
        ParseErrorKind::BatchSize,
        format!("1 to {} samples in a batch", Batch::MOST_SAMPLES),
        format!("{samples}"),
        "send the samples in several batches with consecutive sequence numbers",
    ))
}

/// The ten channels of a sample as they stand in a frame or an array; NaN for a missing value.
pub(super) fn channels(sample: &ImuSample) -> [f64; 10] {
    let [gx, gy, gz] = sample.w_ib_b_rad_s;
    let [ax, ay, az] = sample.f_b_m_s2;
    let [mx, my, mz] = sample.mag_b_ut.unwrap_or([f64::NAN; 3]);
    [gx, gy, gz, ax, ay, az, mx, my, mz, sample.pressure_hpa.unwrap_or(f64::NAN)]
}

/// A sample from its time and ten channels. A magnetometer that lacks one axis says nothing; a gyro
/// or accelerometer reading that is not a number stays, for the session to report.
pub(super) fn sample(t_ns: i64, c: [f64; 10]) -> ImuSample {
    let mag = [c[6], c[7], c[8]];
    ImuSample {
        t_ns,
        w_ib_b_rad_s: [c[0], c[1], c[2]],
        f_b_m_s2: [c[3], c[4], c[5]],
        mag_b_ut: (!mag.iter().any(|m| m.is_nan())).then_some(mag),
        pressure_hpa: (!c[9].is_nan()).then_some(c[9]),
    }
}
