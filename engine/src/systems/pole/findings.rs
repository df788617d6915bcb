//! What a surveyor has to know of a survey: a sentence each.

use nalgebra::Vector3;

use super::causes::SurveyCause;
use super::contact::Interval;
use super::pass::{Island, Pass};
use super::points::Point;
use super::recording::{Instrument, Quality, Recording, Stop};
use super::states::STATES;
use super::tuning::Tuning;
use crate::anomaly::{Anomaly, Cause as _};

/// A lever arm that is off by so many of its sigmas was measured wrong.
const MOST_ARM_SIGMAS: f64 = 3.0;
/// What is felt for a shorter time may have been no landing, ns: the window alone is as long as two thirds of it.
const SHORTEST_LANDING_NS: i64 = 620_000_000;
/// What parts two stands for less is no step, ns.
const SHORTEST_STEP_NS: i64 = 600_000_000;
/// A tip that slips by less is drawn anew, and nobody need know, m: every third landing on gravel does.
const LEAST_TOLD_M: f64 = 0.01;
/// A point that is known no better than this was not carried by landings, m.
const MOST_ADRIFT_M: f64 = 0.25;
/// Visits of a point that differ by so many sigmas contradict each other.
const MOST_APART_SIGMAS: f64 = 2.5;
/// A gap that closes worse than this is not what the filter takes it for. One that closes a little worse than it should is told by
/// the sigmas, which are as much wider.
const MOST_MISCLOSURE_SIGMAS: f64 = 3.0;

/// What a pass has seen.
pub(super) fn of(
    pass: &Pass,
    recording: &Recording,
    instrument: &Instrument,
    tuning: &Tuning,
    contacts: &[Interval],
    restless: &[bool],
    islands: &[Island],
) -> Vec<Anomaly> {
    let mut findings = Vec::new();
    let mut found = |cause: SurveyCause, t_ns: [i64; 2]| findings.push(cause.anomaly(None, t_ns, 0));
    let steps = Steps::new(pass, contacts, restless);
    for (number, (contact, landing)) in contacts.iter().zip(&pass.landings).enumerate() {
        let t_ns = [contact.from_ns, contact.to_ns];
        let at_s = seconds(contact.from_ns);
        // Nobody has missed a landing that was none.
        let felt = recording.switch.is_none();
        if felt && contact.to_ns - contact.from_ns < SHORTEST_LANDING_NS {
            continue;
        }
        if felt && restless[number] && steps.is_within_one(contact) {
            continue;
        }
        if restless[number] || landing.restless {
            found(SurveyCause::MovingGround { at_s }, t_ns);
        } else if landing.has_slipped() && landing.moved_m > LEAST_TOLD_M {
            found(SurveyCause::Slip { at_s, moved_m: landing.moved_m }, t_ns);
        }
    }
    for closure in pass.closures.iter().filter(|closure| closure.sigmas > MOST_MISCLOSURE_SIGMAS) {
        let [at_s, sigmas] = [closure.at_s, closure.sigmas];
        let t_ns = [at_s - closure.gap_s, at_s].map(|t_s| (t_s * 1e9) as i64);
        found(SurveyCause::Misclosure { at_s, off_m: Vector3::from(closure.off_m).norm(), sigmas }, t_ns);
    }
    for t_ns in &pass.jumps {
        found(SurveyCause::FixJump { at_s: seconds(*t_ns) }, [*t_ns; 2]);
    }
    for island in islands.iter().filter(|island| !island.trusted) {
        let [first, after] = island.fixes;
        let t_ns = [recording.fixes[first].t_ns, recording.fixes[after - 1].t_ns];
        let [from_s, to_s] = t_ns.map(seconds);
        found(SurveyCause::DoubtfulFixes { from_s, to_s }, t_ns);
    }
    let mut episode: Option<[i64; 2]> = None;
    let mut floats = Vec::new();
    for fix in &recording.fixes {
        match (fix.quality, &mut episode) {
            (Quality::Fixed, _) => floats.extend(episode.take()),
            (_, Some(episode)) => episode[1] = fix.t_ns,
            (_, None) => episode = Some([fix.t_ns; 2]),
        }
    }
    floats.extend(episode);
    for t_ns in floats {
        let [from_s, to_s] = t_ns.map(seconds);
        found(SurveyCause::NotFixed { from_s, to_s }, t_ns);
    }
    for (t_ns, gap_s) in &pass.sample_gaps {
        let cause = SurveyCause::SampleGap { until_s: seconds(*t_ns), missing_s: *gap_s };
        found(cause, [*t_ns - (*gap_s * 1e9) as i64, *t_ns]);
    }
    if let Some(rows) = &recording.switch {
        let changes = rows.windows(2).filter(|pair| pair[1].0 - pair[0].0 < 50_000_000).count();
        if instrument.tip_b_m.is_some() && changes > 2 * contacts.len().max(3) {
            found(SurveyCause::Chatter { changes }, [rows[0].0, rows[rows.len() - 1].0]);
        }
    }
    findings.extend(arms(pass, instrument, tuning));
    findings
}

/// The steps between stands.
struct Steps {
    /// From the end of a stand to the start of the next one.
    steps: Vec<Interval>,
    /// What half of them last longer than, ns.
    usual_ns: i64,
}

impl Steps {
    fn new(pass: &Pass, contacts: &[Interval], restless: &[bool]) -> Steps {
        let stands: Vec<&Interval> = (0..contacts.len())
            .filter(|k| !restless[*k] && !pass.landings[*k].restless && pass.landings[*k].looks > 0)
            .map(|k| &contacts[k])
            .collect();
        let steps: Vec<Interval> = stands
            .windows(2)
            .map(|pair| Interval { from_ns: pair[0].to_ns, to_ns: pair[1].from_ns })
            .filter(|step| step.to_ns - step.from_ns > SHORTEST_STEP_NS)
            .collect();
        let mut lasts: Vec<i64> = steps.iter().map(|step| step.to_ns - step.from_ns).collect();
        lasts.sort_unstable();
        let usual_ns = lasts.get(lasts.len() / 2).copied().unwrap_or(0);
        Steps { steps, usual_ns }
    }

    /// Whether what was felt lies within a step that lasts no longer than usual: then no landing is missing, and the tip was
    /// carried evenly.
    fn is_within_one(&self, felt: &Interval) -> bool {
        let within = |step: &&Interval| step.from_ns <= felt.from_ns && felt.to_ns <= step.to_ns;
        self.steps.iter().find(within).is_some_and(|step| step.to_ns - step.from_ns < self.usual_ns * 8 / 5)
    }
}

/// Lever arms that are not as they were told.
fn arms(pass: &Pass, instrument: &Instrument, tuning: &Tuning) -> Vec<Anomaly> {
    let Some(tip_b_m) = instrument.tip_b_m else { return Vec::new() };
    let prior = tuning.start.lever_arm_m;
    let t_ns = pass.looks.last().map_or(0, |look| look.t_ns);
    let mut findings = Vec::new();
    let mut arm = |name: &'static str, told: Vector3<f64>, estimated: Vector3<f64>, block: usize| {
        let left = pass.end.eskf.covariance.block(block, block);
        for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
            let moved = estimated[axis] - told[axis];
            // An estimate moves from what was told by what it has learnt.
            let sigma = (prior * prior - left[(axis, axis)]).max(1e-8).sqrt();
            if moved.abs() > MOST_ARM_SIGMAS * sigma {
                let (told_m, estimated_m) = (told[axis], estimated[axis]);
                let cause = SurveyCause::LeverArm { arm: name, axis: letter, told_m, estimated_m };
                findings.push(cause.anomaly(None, [t_ns; 2], 0));
            }
        }
    };
    arm("antenna_b_m", instrument.antenna_b_m, pass.end.antenna.arm_b_m, STATES.antenna.block());
    if let Some(tip) = pass.end.tip {
        arm("tip_b_m", tip_b_m, tip.arm_b_m, STATES.tip.block());
    }
    findings
}

/// What is to be said of points.
pub(super) fn of_points(points: &[Point], stops: &[Stop], instrument: &Instrument) -> Vec<Anomaly> {
    let mut findings = Vec::new();
    let mut found = |cause: SurveyCause, t_ns: [i64; 2]| findings.push(cause.anomaly(None, t_ns, 0));
    for point in points {
        let t_ns = [point.visits[0][0], point.visits[point.visits.len() - 1][1]];
        let name = || point.name.clone();
        if !point.stood {
            found(SurveyCause::NotStanding { point: name() }, t_ns);
        }
        let sigma_m =
            (0..3).map(|axis| point.covariance_n_m2[(axis, axis)].max(0.0).sqrt()).fold(0.0, f64::max);
        if sigma_m > point.moved_m + MOST_ADRIFT_M {
            found(SurveyCause::Adrift { point: name(), sigma_m }, t_ns);
        }
        if point.moved_m > 0.0 {
            found(SurveyCause::MovedOnPoint { point: name(), moved_m: point.moved_m }, t_ns);
        }
        if point.apart_sigmas > MOST_APART_SIGMAS {
            let (apart_m, sigmas) = (point.apart_m, point.apart_sigmas);
            found(SurveyCause::VisitsApart { point: name(), apart_m, sigmas }, t_ns);
        }
    }
    for stop in stops.iter().filter(|stop| points.iter().all(|point| point.name != stop.name)) {
        let point = stop.name.clone();
        let cause = match instrument.tip_b_m {
            None => SurveyCause::WithoutTip { point },
            Some(_) => SurveyCause::NotCovered { point },
        };
        found(cause, [stop.t_start_ns, stop.t_end_ns]);
    }
    findings
}

fn seconds(t_ns: i64) -> f64 {
    t_ns as f64 * 1e-9
}
