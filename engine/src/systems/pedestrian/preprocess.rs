//! The way of one foot's samples to the filter: health, standing start, stance, queue.

use std::collections::VecDeque;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::cadence::{Cadence, MOST_PER_S};
use super::causes::WalkCause;
use super::contradictions::Contradiction;
use super::foot::Step;
use super::side::Side;
use super::spike::spike;
use super::tuning::Tuning;
use crate::anomaly::Anomaly;
use crate::detect::sensor_health::{Limits, SensorHealth};
use crate::detect::stance::{StanceDecision, StanceDetector};
use crate::event::Event;
use crate::ins::alignment::{Aligner, StandingStart};
use crate::merge::Queued;
use crate::sample::ImuSample;

/// What no foot does: such a reading is broken.
const LIMITS: Limits = Limits { largest_rate_rad_s: 90.0, largest_force_m_s2: 2000.0 };

/// The samples of one foot on their way.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct FootLine {
    side: Side,
    health: SensorHealth,
    cadence: Cadence,
    /// Empty once the line is open, before which nothing is saved.
    #[serde(skip, default = "no_aligner")]
    aligner: Aligner,
    aligned: bool,
    start: Option<StandingStart>,
    /// Samples that have come after the aligner had enough.
    held: Vec<ImuSample>,
    detector: Option<StanceDetector>,
    /// Samples that wait for the decision about their stance.
    undecided: VecDeque<ImuSample>,
    decided: VecDeque<Step>,
    /// The sample decided last.
    before: Option<ImuSample>,
    zupt_sigma_m_s: f64,
    roll_radius_m: f64,
    shake_time_s: f64,
    first_ns: Option<i64>,
    newest_ns: Option<i64>,
    ended: bool,
    silent: bool,
    anomalies: Vec<Anomaly>,
}

impl FootLine {
    pub(crate) fn new(side: Side, longest_alignment_s: f64) -> Self {
        FootLine {
            side,
            health: SensorHealth::new(side.stream(), LIMITS),
            cadence: Cadence::new(),
            aligner: Aligner::new(longest_alignment_s),
            aligned: false,
            start: None,
            held: Vec::new(),
            detector: None,
            undecided: VecDeque::new(),
            decided: VecDeque::new(),
            before: None,
            zupt_sigma_m_s: 0.0,
            roll_radius_m: 0.0,
            shake_time_s: 0.0,
            first_ns: None,
            newest_ns: None,
            ended: false,
            silent: false,
            anomalies: Vec::new(),
        }
    }

    pub(crate) fn side(&self) -> Side {
        self.side
    }

    /// Time of the first sample that could be used, ns.
    pub(crate) fn first_ns(&self) -> i64 {
        self.first_ns.unwrap_or(0)
    }

    /// From the first to the newest sample, ns.
    pub(crate) fn span_ns(&self) -> i64 {
        self.newest_ns.unwrap_or(0) - self.first_ns()
    }

    pub(crate) fn is_aligned(&self) -> bool {
        self.aligned
    }

    /// The standing start, once [`Self::align`] has been called and there was a sample.
    pub(crate) fn start(&self) -> Option<&StandingStart> {
        self.start.as_ref()
    }

    /// The first sample.
    pub(crate) fn first_sample(&self) -> Option<&ImuSample> {
        self.aligner.samples().first()
    }

    /// Time of a sample of the start, ns.
    pub(crate) fn sample_ns(&self, index: usize) -> i64 {
        self.aligner.samples().get(index).map_or(0, |sample| sample.t_ns)
    }

    /// Notes whether the foot is silent now; says whether it has just become so.
    pub(crate) fn turns_silent(&mut self, silent: bool) -> bool {
        let turned = silent && !self.silent;
        self.silent = silent;
        turned
    }

    /// Takes a sample as it was logged.
    pub(crate) fn push(&mut self, sample: &ImuSample, events: &mut Vec<Event>) {
        let cadence = &mut self.cadence;
        let admitted = self.health.admit_with(sample, &mut self.anomalies, |sample| {
            let per_s = cadence.take(sample.t_ns, &sample.w_ib_b_rad_s)?;
            Some(WalkCause::ImpossibleCadence { per_s, most_per_s: MOST_PER_S })
        });
        events.extend(self.anomalies.drain(..).map(Event::Anomaly));
        let Some(sample) = admitted else { return };
        self.first_ns.get_or_insert(sample.t_ns);
        self.newest_ns = Some(sample.t_ns);
        if self.detector.is_some() {
            self.detect(&sample);
        } else if self.aligned {
            self.held.push(sample);
        } else {
            self.aligned = self.aligner.push(&sample);
        }
    }

    /// No more samples come.
    pub(crate) fn end(&mut self, events: &mut Vec<Event>) {
        if self.ended {
            return;
        }
        self.ended = true;
        self.aligned = true;
        self.health.finish(&mut self.anomalies);
        events.extend(self.anomalies.drain(..).map(Event::Anomaly));
        self.flush();
    }

    /// Takes the standing start from what has come; without any sample there is none.
    pub(crate) fn align(&mut self) {
        self.aligned = true;
        self.start = self.aligner.solve();
    }

    /// The samples may flow: what was held back goes through the detector first.
    pub(crate) fn open(&mut self, tuning: &Tuning, gravity_m_s2: f64) {
        let interval_s = self.start.as_ref().map_or(0.01, |start| start.interval_s);
        self.zupt_sigma_m_s = tuning.zupt_sigma_m_s;
        self.roll_radius_m = tuning.roll_radius_m;
        self.shake_time_s = tuning.shake_time_s;
        self.detector = Some(StanceDetector::new(tuning.stance, interval_s, gravity_m_s2));
        for sample in self.aligner.samples().to_vec() {
            self.detect(&sample);
        }
        for sample in std::mem::take(&mut self.held) {
            self.detect(&sample);
        }
        self.aligner = no_aligner();
        if self.ended {
            self.flush();
        }
    }

    /// A line that was saved is told the detector's thresholds again.
    pub(crate) fn reopen(&mut self, tuning: &Tuning) {
        if let Some(detector) = &mut self.detector {
            detector.set_tuning(tuning.stance);
        }
    }

    /// The next step.
    pub(crate) fn take(&mut self) -> Option<Step> {
        let step = self.decided.pop_front();
        // The standing start is decided all at once; the room that it took is not needed again.
        if self.decided.is_empty() && self.decided.capacity() > 64 {
            self.decided.shrink_to(16);
        }
        step
    }

    fn detect(&mut self, sample: &ImuSample) {
        let Some(detector) = &mut self.detector else { return };
        self.undecided.push_back(*sample);
        let decision = detector.push(&sample.w_ib_b_rad_s.into(), &sample.f_b_m_s2.into());
        if let Some(decision) = decision {
            self.decide(&decision);
        }
    }

    fn flush(&mut self) {
        while let Some(decision) = self.detector.as_mut().and_then(StanceDetector::flush) {
            self.decide(&decision);
        }
    }

    fn decide(&mut self, decision: &StanceDecision) {
        let Some(mut sample) = self.undecided.pop_front() else { return };
        let neighbours = self.before.zip(self.undecided.front().copied());
        if let Some((off_rad_s, between)) =
            neighbours.and_then(|(before, after)| spike(&before, &sample, &after))
        {
            sample = between;
            self.health.note(Contradiction::Spike { off_rad_s }, sample.t_ns, &mut self.anomalies);
        }
        self.before = Some(sample);
        let rolling_m_s = self.roll_radius_m * decision.rate_rms_rad_s;
        let shaking_m_s = self.shake_time_s * decision.unsteadiness_m_s2;
        let zupt_sigma_m_s = (self.zupt_sigma_m_s * self.zupt_sigma_m_s
            + rolling_m_s * rolling_m_s
            + shaking_m_s * shaking_m_s)
            .sqrt();
        self.decided.push_back(Step {
            sensor: 0,
            t_ns: sample.t_ns,
            w_ib_b: Vector3::from(sample.w_ib_b_rad_s),
            f_b: Vector3::from(sample.f_b_m_s2),
            mag_b_ut: sample.mag_b_ut.map(Vector3::from),
            pressure_hpa: sample.pressure_hpa,
            stance: decision.stance,
            doubtful: decision.doubtful,
            // Of single precision, as all that a step holds.
            zupt_sigma_m_s: f64::from(zupt_sigma_m_s as f32),
            opens_epoch: false,
        });
    }
}

impl Queued for FootLine {
    fn next_ns(&self) -> Option<i64> {
        self.decided.front().map(|step| step.t_ns)
    }

    fn newest_ns(&self) -> Option<i64> {
        self.newest_ns
    }

    fn has_ended(&self) -> bool {
        self.ended
    }
}

/// What is there when the standing start has been taken.
fn no_aligner() -> Aligner {
    Aligner::new(0.0)
}
