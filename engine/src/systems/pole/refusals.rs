//! What is seen to be wrong only when a survey has been gone through: then there is no point at all.

use nalgebra::Vector3;

use super::causes::SurveyCause;
use super::pass::{Pass, Pose};
use super::recording::{Instrument, Recording};

/// Heading of which no point can be carried under a roof, rad.
const LOST_HEADING_RAD: f64 = 0.035;
/// A pole that leans by less about its standing tip has not been leaned, rad.
const LEAST_LEAN_RAD: f64 = 0.04;
/// A stand that is shorter is a step, ns.
const SHORTEST_STAND_NS: i64 = 5_000_000_000;
/// So large a share of the fixes cannot be refused by chance.
const MOST_REFUSED: f64 = 0.3;
/// Nor can the others fit so badly.
const MOST_NIS: f64 = 8.0;

/// So many landings say something of the tip.
const MOST_LANDINGS: usize = 6;

/// Looks at a pass.
///
/// # Errors
///
/// At what says that no point can be carried.
pub(super) fn look_at(
    pass: &Pass,
    restless: &[bool],
    recording: &Recording,
    instrument: &Instrument,
) -> Result<(), SurveyCause> {
    fits(pass)?;
    if recording.switch.is_some() {
        stands(pass, restless)?;
    }
    found_north(pass, recording, instrument)
}

/// A tip that moves in most of the landings that its switch tells is not where it is said to be.
fn stands(pass: &Pass, restless: &[bool]) -> Result<(), SurveyCause> {
    let landings = pass.landings.len();
    let moved =
        pass.landings.iter().zip(restless).filter(|(landing, restless)| landing.restless || **restless);
    let moved = moved.count();
    if landings >= MOST_LANDINGS && 2 * moved > landings {
        return Err(SurveyCause::NeverStands { moved, landings });
    }
    Ok(())
}

/// The positions of another survey fit in places only.
fn fits(pass: &Pass) -> Result<(), SurveyCause> {
    let used: Vec<f64> = pass.weighed.iter().filter(|fix| fix.used).map(|fix| fix.nis / 3.0).collect();
    let refused = pass.weighed.len() - used.len();
    let nis = used.iter().sum::<f64>() / used.len().max(1) as f64;
    if refused as f64 > MOST_REFUSED * pass.weighed.len() as f64 || nis > MOST_NIS {
        return Err(SurveyCause::DoNotFit { refused, fixes: pass.weighed.len(), nis });
    }
    Ok(())
}

/// Without a heading at the last fix before a gap nothing can be carried into it.
fn found_north(pass: &Pass, recording: &Recording, instrument: &Instrument) -> Result<(), SurveyCause> {
    if instrument.tip_b_m.is_none() || recording.stops.is_empty() {
        return Ok(());
    }
    if let Some((lost_ns, _)) = pass.headings.first()
        && pass.headings.len() > 1
        && let Some(lean_rad) = leaned(&pass.poses, *lost_ns)
        && lean_rad < LEAST_LEAN_RAD
    {
        let lost_s = *lost_ns as f64 * 1e-9;
        return Err(SurveyCause::HeldStill { lean_deg: lean_rad.to_degrees(), lost_s });
    }
    let Some((t_ns, sigma_rad)) = pass.headings.first().filter(|(_, sigma)| *sigma > LOST_HEADING_RAD) else {
        return Ok(());
    };
    let lost_s = *t_ns as f64 * 1e-9;
    Err(SurveyCause::HeadingLost { sigma_deg: sigma_rad.to_degrees(), lost_s })
}

/// How the pole leans about its mean in the longest stand before a time, root mean square, rad; `None` where there is none.
fn leaned(poses: &[Pose], before_ns: i64) -> Option<f64> {
    let before = &poses[..poses.partition_point(|pose| pose.t_ns <= before_ns)];
    let stands = before.split(|pose| !pose.stands);
    let longest = stands.max_by_key(|stand| stand.len())?;
    let (first, last) = (longest.first()?, longest.last()?);
    if last.t_ns - first.t_ns < SHORTEST_STAND_NS {
        return None;
    }
    let leans: Vec<Vector3<f64>> = longest
        .iter()
        .filter_map(|pose| Some(pose.c_nb * (pose.antenna_b_m - pose.tip_b_m?).normalize()))
        .collect();
    let count = leans.len().max(1) as f64;
    let mean: Vector3<f64> = leans.iter().sum::<Vector3<f64>>() / count;
    Some((leans.iter().map(|lean| (lean - mean).xy().norm_squared()).sum::<f64>() / count).sqrt())
}
