//! What a device has to tell, in the order in which it tells it.

use lodestep_engine::geo::Site;
use lodestep_engine::parse::batch::Batch;
use lodestep_engine::parse::frame;
use lodestep_engine::parse::live_message::{DeviceMessage, VisitMessage};
use lodestep_engine::sample::ImuSample;
use lodestep_engine::sim::pedestrian::{SensorModel, WalkKind, simulate};
use lodestep_engine::systems::pedestrian::Side;

/// Samples in a batch: a fifth of a second.
const BATCH: usize = 20;
/// The visit of the standing start is told after so many seconds of the walk.
const VISIT_AFTER_S: usize = 13;

/// The marker that every walk visits, and where it is: a little off from where the walks begin.
pub const MARKER: (&str, [f64; 3]) = ("A1", [0.6, -0.4, 0.1]);

/// A walk as its device tells it.
#[derive(Debug)]
pub struct Script {
    /// What is told, one after the other.
    pub steps: Vec<Step>,
    /// The samples, by foot.
    pub samples: [Vec<ImuSample>; 2],
}

/// One message of a device.
#[derive(Clone, Debug)]
pub enum Step {
    /// Some samples.
    Batch {
        /// Of this foot.
        foot: Side,
        /// With this number.
        sequence: u64,
        /// As a binary frame.
        frame: Vec<u8>,
    },
    /// The inspector stood at the marker; the text is the message.
    Visit(String),
}

impl Script {
    /// A walk of so many metres; another seed is another walk.
    pub fn walk(metres: f64, seed: u64) -> Script {
        let walk = simulate(&WalkKind::Line { metres }, seed, &Site::fast(), &SensorModel::cmp10a());
        let samples = [walk.left, walk.right];
        let mut steps = Vec::new();
        for sequence in 0..samples[0].len().div_ceil(BATCH) {
            for foot in Side::BOTH {
                let of_foot = samples[foot.index()].chunks(BATCH).nth(sequence).unwrap_or_default();
                if !of_foot.is_empty() {
                    steps.push(batch(foot, sequence as u64, of_foot));
                }
            }
            if (sequence + 1) * BATCH == VISIT_AFTER_S * 100 {
                let visit = VisitMessage {
                    marker: MARKER.0.to_owned(),
                    t_start_ns: 4_000_000_000,
                    t_end_ns: 11_000_000_000,
                };
                steps.push(Step::Visit(DeviceMessage::Visit(visit).to_json()));
            }
        }
        Script { steps, samples }
    }

    /// How many batches there are of this foot.
    pub fn batches(&self, foot: Side) -> u64 {
        self.samples[foot.index()].len().div_ceil(BATCH) as u64
    }

    /// The samples of the first so many batches of this foot.
    pub fn first(&self, foot: Side, batches: u64) -> &[ImuSample] {
        let samples = &self.samples[foot.index()];
        &samples[..samples.len().min(batches as usize * BATCH)]
    }
}

fn batch(foot: Side, sequence: u64, samples: &[ImuSample]) -> Step {
    let mut bytes = Vec::new();
    let batch = Batch::imu(foot.stream(), sequence, samples.to_vec());
    frame::encode(foot.index() as u8, &batch, &mut bytes).expect("a batch of a script has an allowed size");
    Step::Batch { foot, sequence, frame: bytes }
}
