//! The walks that the devices walk: a few, made once, as frames ready to be sent.

use anyhow::{Context, Result};
use bytes::Bytes;
use lodestep_engine::geo::Site;
use lodestep_engine::parse::batch::Batch;
use lodestep_engine::parse::frame;
use lodestep_engine::sample::ImuSample;
use lodestep_engine::sim::pedestrian::{SensorModel, Simulator, WalkKind};
use lodestep_engine::systems::pedestrian::Side;

use crate::cli::failure::Failure;
use crate::cli::progress;

/// Different walks; the inspectors share them.
const WALKS: u64 = 4;
/// A walk along FAST's road takes this long; for longer a straight line is walked, s.
const ROAD_S: u32 = 2_400;
/// The simulator's own rate, samples a second.
const SIMULATED_HZ: u32 = 100;

/// Frames by walk, foot and number.
pub(super) struct Walks {
    frames: Vec<[Vec<Bytes>; 2]>,
    samples: Vec<[Vec<ImuSample>; 2]>,
    per_frame: usize,
}

/// Makes them.
pub(super) fn make(seed: u64, seconds: u32, rate_hz: u32, frame_ms: u32) -> Result<Walks> {
    let per_frame = (rate_hz * frame_ms / 1_000) as usize;
    if per_frame == 0 || !(rate_hz * frame_ms).is_multiple_of(1_000) || per_frame > Batch::MOST_SAMPLES {
        return Err(Failure::usage(format!(
            "a frame of {frame_ms} ms at {rate_hz} Hz holds {:.2} samples: expected a whole number from 1 to {}",
            f64::from(rate_hz * frame_ms) / 1e3,
            Batch::MOST_SAMPLES
        )));
    }
    let mut model = SensorModel::cmp10a();
    model.imu.rate_hz *= f64::from(rate_hz) / f64::from(SIMULATED_HZ);
    let kind = if seconds <= ROAD_S {
        WalkKind::Spiral
    } else {
        WalkKind::Line { metres: 1.5 * f64::from(seconds) }
    };
    let bar = progress::of_count(WALKS, "walks made");
    let mut walks = Walks { frames: Vec::new(), samples: Vec::new(), per_frame };
    for number in 0..WALKS {
        let mut simulator = Simulator::new(&kind, seed + number, &Site::fast(), &model);
        let count = (seconds * rate_hz) as usize / per_frame * per_frame;
        let mut samples = [Vec::with_capacity(count), Vec::with_capacity(count)];
        while samples[0].len() < count {
            let epoch =
                simulator.next_epoch().context("the walk is shorter than the run: ask for fewer seconds")?;
            for (foot, sample) in samples.iter_mut().zip(&epoch.samples) {
                foot.push(sample.as_logged());
            }
        }
        walks.frames.push([
            encoded(Side::Left, &samples[0], per_frame)?,
            encoded(Side::Right, &samples[1], per_frame)?,
        ]);
        walks.samples.push(samples);
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(walks)
}

fn encoded(foot: Side, samples: &[ImuSample], per_frame: usize) -> Result<Vec<Bytes>> {
    samples
        .chunks_exact(per_frame)
        .enumerate()
        .map(|(sequence, samples)| {
            let mut bytes = Vec::new();
            let batch = Batch::imu(foot.stream(), sequence as u64, samples.to_vec());
            frame::encode(foot.index() as u8, &batch, &mut bytes).context("a frame of the load is wrong")?;
            Ok(bytes.into())
        })
        .collect()
}

impl Walks {
    /// Frames of each foot.
    pub(super) fn frames(&self) -> usize {
        self.frames[0][0].len()
    }

    /// Samples in a frame.
    pub(super) fn per_frame(&self) -> usize {
        self.per_frame
    }

    /// A frame of an inspector.
    pub(super) fn frame(&self, inspector: usize, foot: Side, sequence: usize) -> Bytes {
        self.frames[inspector % self.frames.len()][foot.index()][sequence].clone()
    }

    /// What an inspector's foot measures in the whole run.
    pub(super) fn samples(&self, inspector: usize, foot: Side) -> &[ImuSample] {
        &self.samples[inspector % self.samples.len()][foot.index()]
    }
}
