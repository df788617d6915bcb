//! What a surveyor has to know of a survey: a sentence each.

use nalgebra::Vector3;

use super::contact::Interval;
use super::pass::{Island, Pass};
use super::points::Point;
use super::recording::{Instrument, Quality, Recording, Stop};
use super::states::STATES;
use super::tuning::Tuning;

/// One finding.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Finding {
    /// What kind it is, in a word.
    pub kind: &'static str,
    /// From, s.
    pub t_start_s: f64,
    /// Until, s.
    pub t_end_s: f64,
    /// The sentence.
    pub detail: String,
}

fn finding(kind: &'static str, t_ns: [i64; 2], detail: String) -> Finding {
    let [t_start_s, t_end_s] = t_ns.map(|t_ns| t_ns as f64 * 1e-9);
    Finding { kind, t_start_s, t_end_s, detail }
}

/// A lever arm that is off by so many of its sigmas was measured wrong.
const MOST_ARM_SIGMAS: f64 = 3.0;
/// Visits of a point that differ by so many sigmas contradict each other.
const MOST_APART_SIGMAS: f64 = 2.5;

/// What a pass has seen.
pub(super) fn of(
    pass: &Pass,
    recording: &Recording,
    instrument: &Instrument,
    tuning: &Tuning,
    contacts: &[Interval],
    restless: &[bool],
    islands: &[Island],
) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (number, (contact, landing)) in contacts.iter().zip(&pass.landings).enumerate() {
        let t_ns = [contact.from_ns, contact.to_ns];
        let t_s = contact.from_ns as f64 * 1e-9;
        if restless[number] || landing.restless {
            let detail = format!("the ground under the tip moved at {t_s:.1} s: this landing was left out");
            findings.push(finding("moving_ground", t_ns, detail));
        } else if landing.refused > 0 {
            let detail = format!(
                "the tip slipped by {:.3} m while it stood at {t_s:.1} s: it was taken to stand anew",
                landing.moved_m
            );
            findings.push(finding("slip", t_ns, detail));
        }
    }
    for t_ns in &pass.jumps {
        let detail = format!(
            "the fixes jumped at {:.1} s, more than what they say of themselves allows: from there on they were believed to half a metre",
            *t_ns as f64 * 1e-9
        );
        findings.push(finding("fix_jump", [*t_ns; 2], detail));
    }
    for island in islands.iter().filter(|island| !island.trusted) {
        let [first, after] = island.fixes;
        let t_ns = [recording.fixes[first].t_ns, recording.fixes[after - 1].t_ns];
        let detail = format!(
            "the fixes from {:.1} to {:.1} s, in the middle of a gap, do not agree with the way there and back, or cannot be held against it: they were believed to half a metre",
            t_ns[0] as f64 * 1e-9,
            t_ns[1] as f64 * 1e-9
        );
        findings.push(finding("doubtful_fixes", t_ns, detail));
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
        let detail = format!(
            "the solutions from {:.1} to {:.1} s are not fixed: they were believed to half a metre at best, as one",
            t_ns[0] as f64 * 1e-9,
            t_ns[1] as f64 * 1e-9
        );
        findings.push(finding("not_fixed", t_ns, detail));
    }
    for (t_ns, gap_s) in &pass.sample_gaps {
        let detail = format!("samples are missing for {gap_s:.2} s until {:.1} s", *t_ns as f64 * 1e-9);
        findings.push(finding("sample_gap", [*t_ns - (*gap_s * 1e9) as i64, *t_ns], detail));
    }
    if let Some(rows) = &recording.switch {
        let short = rows.windows(2).filter(|pair| pair[1].0 - pair[0].0 < 50_000_000).count();
        if instrument.tip_b_m.is_some() && short > 2 * contacts.len().max(3) {
            let t_ns = [rows[0].0, rows[rows.len() - 1].0];
            let detail = format!("the switch chattered: {short} changes within 50 ms of the one before");
            findings.push(finding("chatter", t_ns, detail));
        }
    }
    findings.extend(arms(pass, instrument, tuning));
    findings
}

/// Lever arms that are not as they were told.
fn arms(pass: &Pass, instrument: &Instrument, tuning: &Tuning) -> Vec<Finding> {
    let Some(tip_b_m) = instrument.tip_b_m else { return Vec::new() };
    let prior = tuning.start.lever_arm_m;
    let t_ns = pass.looks.last().map_or(0, |look| look.t_ns);
    let mut findings = Vec::new();
    let mut arm = |name: &str, told: Vector3<f64>, estimated: Vector3<f64>, block: usize| {
        let left = pass.end.eskf.covariance.block(block, block);
        for (axis, letter) in ["x", "y", "z"].iter().enumerate() {
            let moved = estimated[axis] - told[axis];
            // An estimate moves from what was told by what it has learnt.
            let sigma = (prior * prior - left[(axis, axis)]).max(1e-8).sqrt();
            if moved.abs() > MOST_ARM_SIGMAS * sigma {
                let detail = format!(
                    "{name} was told as {:.3} m along {letter} and is estimated as {:.3} m: measure it again",
                    told[axis], estimated[axis]
                );
                findings.push(finding("lever_arm", [t_ns; 2], detail));
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
pub(super) fn of_points(points: &[Point], stops: &[Stop], instrument: &Instrument) -> Vec<Finding> {
    let mut findings = Vec::new();
    for point in points {
        let t_ns = [point.visits[0][0], point.visits[point.visits.len() - 1][1]];
        if !point.stood {
            let detail =
                format!("the tip was not found standing on the point {}: do not trust it", point.name);
            findings.push(finding("not_standing", t_ns, detail));
        }
        if point.apart_sigmas > MOST_APART_SIGMAS {
            let detail = format!(
                "the visits of the point {} are {:.3} m apart, {:.1} times what their sigmas allow",
                point.name, point.apart_m, point.apart_sigmas
            );
            findings.push(finding("visits_apart", t_ns, detail));
        }
    }
    for stop in stops.iter().filter(|stop| points.iter().all(|point| point.name != stop.name)) {
        let why = match instrument.tip_b_m {
            None => "without tip_b_m there is no tip",
            Some(_) => "the track does not cover its time",
        };
        let detail = format!("the point {} has no position: {why}", stop.name);
        findings.push(finding("no_position", [stop.t_start_ns, stop.t_end_ns], detail));
    }
    findings
}
