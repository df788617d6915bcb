//! A whole survey: aligned, filtered, smoothed, and what its points are.

use nalgebra::{Matrix3, Matrix4, Vector3};

use super::alignment::{self, Aligned, NotAligned};
use super::checks;
use super::contact::{self, Interval};
use super::filter::{Certainty, Filter};
use super::findings::{self, Finding};
use super::pass::{self, Island, LONG_GAP_NS, Pass, Pose, Setting, Wanted};
use super::points::{self, Point, VisitOfPoint};
use super::recording::{Fix, Instrument, Recording};
use super::smoothing::{self, Smoothed};
use super::states::STATES;
use super::tuning::Tuning;
use crate::geo::LocalFrame;
use crate::ins::earth::Earth;
use crate::ins::layout::ErrorState::{Attitude, GyroBias, Position, Velocity};
use crate::ins::nav_state::NavState;
use crate::rotation::cayley;

/// What is to be computed.
#[derive(Clone, Debug)]
pub struct Options {
    /// The figures of the filter.
    pub tuning: Tuning,
    /// Whether what came later counts, too.
    pub smoothed: bool,
    /// Poses in the track, a second.
    pub rate_hz: f64,
}

/// A row of the track.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Time, ns.
    pub t_ns: i64,
    /// The tip, m; `None` without one.
    pub tip_n_m: Option<[f64; 3]>,
    /// The antenna's phase centre, m.
    pub antenna_n_m: [f64; 3],
    /// Sigmas of the tip, or of the antenna without one, m.
    pub sigma_n_m: [f64; 3],
    /// Sigma of the heading, rad.
    pub sigma_heading_rad: f64,
    /// Whether the tip is on the ground.
    pub contact: bool,
}

/// What came out.
#[derive(Debug)]
pub struct Survey {
    /// The track.
    pub rows: Vec<Row>,
    /// The points, in the order in which their names come first.
    pub points: Vec<Point>,
    /// What a surveyor has to know.
    pub findings: Vec<Finding>,
    /// What was used, and what not.
    pub figures: Figures,
}

/// What the filter saw.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Figures {
    /// Fixes that were used.
    pub fixes_used: usize,
    /// Fixes that were refused.
    pub fixes_refused: usize,
    /// Mean normalised innovation squared of the fixes used, by degree of freedom: 1 where all is as the filter takes it.
    pub fix_nis: f64,
    /// Landings that were used.
    pub landings: usize,
    /// Landings in which the tip slipped.
    pub slipped: usize,
    /// Landings on ground that moved.
    pub moved: usize,
    /// Sigma of the heading at the end of each stretch of fixes, as the filter had it: time, s, and degrees.
    pub heading_sigma_deg: Vec<(f64, f64)>,
    /// Lever arm of the antenna as estimated, m.
    pub antenna_b_m: [f64; 3],
    /// Lever arm of the tip as estimated, m.
    pub tip_b_m: Option<[f64; 3]>,
    /// How far the tip rolls as the pole leans by one, m.
    pub roundness_m: f64,
    /// When the first attitude was found: from and until, s.
    pub aligned_s: [f64; 2],
}

/// Why a survey cannot be computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SurveyError {
    /// In a sentence.
    #[error("{0}")]
    Sentence(String),
}

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

/// Computes a survey.
///
/// # Errors
///
/// Where inputs do not belong together, or do not say where north is: in a sentence.
pub fn compute(
    recording: &Recording,
    instrument: &Instrument,
    frame: &LocalFrame,
    options: &Options,
) -> Result<Survey, SurveyError> {
    checks::check(recording, instrument)?;
    let earth = Earth::turning(frame);
    let tuning = &options.tuning;
    let imu = &recording.imu;
    let aligned =
        alignment::align(imu, &recording.fixes, &instrument.antenna_b_m, &earth).map_err(why_not)?;
    let contacts = contacts(recording, instrument, &earth, &aligned);
    let start = starting(&aligned, instrument, tuning);
    // The first attitude may be some degrees off: what was recorded up to it says it better, about itself.
    let until = imu.partition_point(|sample| sample.t_ns <= aligned.window_ns[1]);
    let opening = |start: &Filter| {
        let setting = Setting {
            tuning,
            earth: &earth,
            imu: &imu[..until],
            fixes: &recording.fixes
                [..recording.fixes.partition_point(|fix| fix.t_ns <= aligned.window_ns[1])],
            islands: &[],
            contacts: &contacts,
            restless: &vec![false; contacts.len()],
        };
        pass::go(&setting, start, aligned.sample, Wanted::Start, i64::MAX / 4)
    };
    let start = match tuning.zero_velocity_m_s {
        None => restarted(&start, opening(&start)),
        Some(_) => start,
    };
    let mut islands = match tuning.zero_velocity_m_s {
        None => islands(&recording.fixes),
        Some(_) => Vec::new(),
    };
    let every_ns = libm::round(1e9 / options.rate_hz) as i64;
    let go = |restless: &[bool], islands: &[Island], start: &Filter, wanted: Wanted| {
        let setting = Setting {
            tuning,
            earth: &earth,
            imu,
            fixes: &recording.fixes,
            islands,
            contacts: &contacts,
            restless,
        };
        pass::go(&setting, start, aligned.sample, wanted, every_ns)
    };
    let mut restless = vec![false; contacts.len()];
    let pass = if options.smoothed {
        let again = if tuning.zero_velocity_m_s.is_some() {
            start
        } else {
            let first = go(&restless, &islands, &start, Wanted::Start);
            for (restless, landing) in restless.iter_mut().zip(&first.landings) {
                *restless = landing.restless;
            }
            restarted(&start, first)
        };
        let pass = go(&restless, &islands, &again, Wanted::Smoothed);
        if pass.doubts.is_empty() {
            pass
        } else {
            let smoothed = smoothing::smooth(pass, &[]).ok_or_else(not_smoothed)?;
            for (island, off_n_m, covariance) in &smoothed.islands {
                islands[*island].trusted = agrees(off_n_m, covariance);
            }
            go(&restless, &islands, &again, Wanted::Smoothed)
        }
    } else {
        go(&restless, &islands, &start, Wanted::Filtered)
    };
    fits(&pass)?;
    found_north(&pass, recording, instrument)?;
    let figures = figures(&pass, &aligned);
    let mut findings = findings::of(&pass, recording, instrument, tuning, &contacts, &restless, &islands);
    let looks: Vec<i64> = pass.looks.iter().map(|look| look.t_ns).collect();
    let asked: Vec<usize> =
        recording.stops.iter().map(|stop| nearest(&looks, (stop.t_start_ns + stop.t_end_ns) / 2)).collect();
    let Smoothed { poses, covariances, between, .. } = if options.smoothed {
        smoothing::smooth(pass, &asked).ok_or_else(not_smoothed)?
    } else {
        filtered(pass, &asked)
    };
    let rows: Vec<Row> = poses.iter().map(|pose| row(pose, &looks, &covariances)).collect();
    let visits = visits(recording, instrument, &poses);
    let numbers: Vec<usize> = visits.iter().map(|visit| visit.stop).collect();
    let mut points = points::combine(&recording.stops, &visits, |a, b| between[numbers[a]][numbers[b]]);
    for point in &mut points {
        let from_ns = point.visits[0][0];
        let last = recording.fixes.partition_point(|fix| fix.t_ns <= from_ns);
        let since = last.checked_sub(1).map_or(0, |last| from_ns - recording.fixes[last].t_ns);
        point.since_fix_s = if since > LONG_GAP_NS { since as f64 * 1e-9 } else { 0.0 };
    }
    findings.extend(findings::of_points(&points, &recording.stops, instrument));
    Ok(Survey { rows, points, findings, figures })
}

fn not_smoothed() -> SurveyError {
    SurveyError::Sentence(
        "expected errors that stay finite on the way back, found others: the inputs do not belong together"
            .to_owned(),
    )
}

fn why_not(why: NotAligned) -> SurveyError {
    SurveyError::Sentence(match why {
        NotAligned::NoFixes => {
            "expected positions while the sensor ran, found none: check both logs".to_owned()
        }
        NotAligned::NoManoeuvre { sigma_rad, residual_m_s2 } if residual_m_s2 > 0.5 => format!(
            "expected positions that move as the sensor feels, found them {residual_m_s2:.1} m/s² apart (heading sigma {:.0}°): the positions are of another day, of another pole, or antenna_b_m is wrong",
            sigma_rad.to_degrees()
        ),
        NotAligned::NoManoeuvre { sigma_rad, .. } => format!(
            "expected a manoeuvre under open sky that says where north is, found none (heading sigma {:.0}°): lean the pole about its tip in all directions for a minute before the sky is lost",
            sigma_rad.to_degrees()
        ),
    })
}

/// When the tip is on the ground.
fn contacts(
    recording: &Recording,
    instrument: &Instrument,
    earth: &Earth,
    aligned: &Aligned,
) -> Vec<Interval> {
    let end_ns = recording.imu.last().map_or(0, |sample| sample.t_ns);
    match (&recording.switch, instrument.tip_b_m) {
        (_, None) => Vec::new(),
        (Some(rows), Some(_)) => contact::by_switch(rows, end_ns),
        (None, Some(_)) => {
            let gravity_m_s2 = earth.gravity_n(&aligned.antenna_n_m).norm();
            contact::by_feel(&recording.imu, instrument, gravity_m_s2, &aligned.gyro_bias_b)
        }
    }
}

/// Stretches of fixes that are neither the first nor the last.
fn islands(fixes: &[Fix]) -> Vec<Island> {
    let mut cuts = vec![0];
    cuts.extend((1..fixes.len()).filter(|k| fixes[*k].t_ns - fixes[k - 1].t_ns > LONG_GAP_NS));
    cuts.push(fixes.len());
    let stretches: Vec<[usize; 2]> = cuts.windows(2).map(|pair| [pair[0], pair[1]]).collect();
    let middle = stretches.len().saturating_sub(1);
    stretches
        .get(1..middle)
        .unwrap_or_default()
        .iter()
        .map(|fixes| Island { fixes: *fixes, trusted: false })
        .collect()
}

/// Whether an island is where everything else says: within three sigmas, and these small enough to tell.
fn agrees(off_n_m: &Vector3<f64>, covariance: &Matrix3<f64>) -> bool {
    (0..3).all(|axis| {
        // What the solution is off by itself is allowed for.
        let sigma = (covariance[(axis, axis)].max(0.0) + 0.015 * 0.015).sqrt();
        sigma < 0.1 && off_n_m[axis].abs() < 3.0 * sigma
    })
}

/// The positions of another survey fit in places only.
fn fits(pass: &Pass) -> Result<(), SurveyError> {
    let used: Vec<f64> = pass.weighed.iter().filter(|fix| fix.used).map(|fix| fix.nis / 3.0).collect();
    let refused = pass.weighed.len() - used.len();
    let nis = used.iter().sum::<f64>() / used.len().max(1) as f64;
    if refused as f64 > MOST_REFUSED * pass.weighed.len() as f64 || nis > MOST_NIS {
        return Err(SurveyError::Sentence(format!(
            "expected positions that move as the sensor feels, found {refused} of {} that do not (normalised innovation squared {nis:.1} where 1 is right): check that both are of one survey, and antenna_b_m and tip_b_m, in metres",
            pass.weighed.len()
        )));
    }
    Ok(())
}

/// Without a heading at the last fix before a gap nothing can be carried into it.
fn found_north(pass: &Pass, recording: &Recording, instrument: &Instrument) -> Result<(), SurveyError> {
    if instrument.tip_b_m.is_none() || recording.stops.is_empty() {
        return Ok(());
    }
    if let Some((lost_ns, _)) = pass.headings.first()
        && pass.headings.len() > 1
        && let Some(lean_rad) = leaned(&pass.poses, *lost_ns)
        && lean_rad < LEAST_LEAN_RAD
    {
        return Err(SurveyError::Sentence(format!(
            "expected a manoeuvre under open sky, found the pole held still (it leans by {:.1}°, root mean square) before the sky is lost at {:.1} s: lean it about its tip in all directions for a minute before",
            lean_rad.to_degrees(),
            *lost_ns as f64 * 1e-9
        )));
    }
    let Some((t_ns, sigma_rad)) = pass.headings.first().filter(|(_, sigma)| *sigma > LOST_HEADING_RAD) else {
        return Ok(());
    };
    Err(SurveyError::Sentence(format!(
        "expected a manoeuvre under open sky that says where north is, found a heading of {:.1}° (1σ) when the sky is lost at {:.1} s: lean the pole about its tip in all directions for a minute before",
        sigma_rad.to_degrees(),
        *t_ns as f64 * 1e-9
    )))
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

fn figures(pass: &Pass, aligned: &Aligned) -> Figures {
    let used: Vec<f64> = pass.weighed.iter().filter(|fix| fix.used).map(|fix| fix.nis / 3.0).collect();
    let seconds = |t_ns: i64| t_ns as f64 * 1e-9;
    Figures {
        fixes_used: used.len(),
        fixes_refused: pass.weighed.len() - used.len(),
        fix_nis: used.iter().sum::<f64>() / used.len().max(1) as f64,
        landings: pass.landings.iter().filter(|landing| landing.looks > 0 && !landing.restless).count(),
        slipped: pass.landings.iter().filter(|landing| landing.refused > 0 && !landing.restless).count(),
        moved: pass.landings.iter().filter(|landing| landing.restless).count(),
        heading_sigma_deg: pass.headings.iter().map(|(t, s)| (seconds(*t), s.to_degrees())).collect(),
        antenna_b_m: pass.end.antenna.arm_b_m.into(),
        tip_b_m: pass.end.tip.map(|tip| tip.arm_b_m.into()),
        roundness_m: pass.end.roundness_m,
        aligned_s: aligned.window_ns.map(seconds),
    }
}

/// The filter at its start.
fn starting(aligned: &Aligned, instrument: &Instrument, tuning: &Tuning) -> Filter {
    let c_nb = aligned.c_nb;
    let nav = NavState {
        c_nb,
        v_n: aligned.antenna_n_m_s,
        p_n: aligned.antenna_n_m - c_nb * instrument.antenna_b_m,
        gyro_bias_b: aligned.gyro_bias_b,
        accelerometer_bias_b: Vector3::zeros(),
    };
    // What the accelerometer reads too much tilts the attitude.
    let mut attitude = aligned.covariance.fixed_view::<3, 3>(0, 0).into_owned();
    for (axis, sigma) in [0.02, 0.02, 0.03].into_iter().enumerate() {
        attitude[(axis, axis)] += sigma * sigma;
    }
    let certainty = Certainty { attitude, position_m: 0.1 };
    Filter::new(tuning, nav, &certainty, instrument.antenna_b_m, instrument.tip_b_m)
}

/// The same start, as everything that came later corrects it: about that the errors are small enough to be linear.
fn restarted(start: &Filter, pass: Pass) -> Filter {
    let mut again = start.clone();
    let Some(errors) = smoothing::errors_at_start(pass) else { return again };
    let states = STATES.imu;
    let nav = &mut again.strapdown.nav;
    nav.c_nb = cayley(&errors[states.block(Attitude)]) * nav.c_nb;
    nav.p_n -= errors[states.block(Position)];
    nav.v_n -= errors[states.block(Velocity)];
    nav.gyro_bias_b += errors[states.block(GyroBias)];
    again.walking_b += errors[STATES.walking.block()];
    again
}

/// The filter's own track, in the form of a smoothed one.
fn filtered(pass: Pass, asked: &[usize]) -> Smoothed {
    let covariances: Vec<Matrix4<f64>> = pass.looks.iter().map(|look| look.after).collect();
    let mut between = vec![vec![Matrix3::zeros(); asked.len()]; asked.len()];
    for (number, look) in asked.iter().enumerate() {
        between[number][number] = covariances[*look].fixed_view::<3, 3>(0, 0).into_owned();
    }
    Smoothed { poses: pass.poses, covariances, between, islands: Vec::new() }
}

fn nearest(times: &[i64], t_ns: i64) -> usize {
    let after = times.partition_point(|t| *t < t_ns).min(times.len().saturating_sub(1));
    match after.checked_sub(1) {
        Some(before) if t_ns - times[before] < times[after] - t_ns => before,
        _ => after,
    }
}

/// Where the tip touches the ground at each stop: the mean over the stop.
fn visits(recording: &Recording, instrument: &Instrument, poses: &[Pose]) -> Vec<VisitOfPoint> {
    let mut visits = Vec::new();
    for (number, stop) in recording.stops.iter().enumerate() {
        let from = poses.partition_point(|pose| pose.t_ns < stop.t_start_ns);
        let to = poses.partition_point(|pose| pose.t_ns <= stop.t_end_ns);
        let of = &poses[from..to];
        let touches: Vec<(Vector3<f64>, f64)> =
            of.iter().filter(|pose| pose.stands).filter_map(touch).collect();
        let stood = 2 * touches.len() > of.len() && !of.is_empty();
        let seen = if touches.is_empty() { of.iter().filter_map(touch).collect() } else { touches };
        if seen.is_empty() || instrument.tip_b_m.is_none() {
            continue;
        }
        let count = seen.len() as f64;
        let sum: Vector3<f64> = seen.iter().map(|(touch, _)| touch).sum();
        let tilt_rad = seen.iter().map(|(_, tilt)| tilt).sum::<f64>() / count;
        visits.push(VisitOfPoint { stop: number, p_n_m: sum / count, stood, tilt_rad });
    }
    visits
}

/// Where the tip touches the ground, or would, and how the pole leans.
fn touch(pose: &Pose) -> Option<(Vector3<f64>, f64)> {
    let tip_b_m = pose.tip_b_m?;
    let up_n = pose.c_nb * (pose.antenna_b_m - tip_b_m).normalize();
    let lean_n = Vector3::new(up_n.x, up_n.y, 0.0);
    let touch_n_m = pose.p_n + pose.c_nb * tip_b_m - lean_n * pose.roundness_m;
    Some((touch_n_m, libm::asin(lean_n.norm().min(1.0))))
}

fn row(pose: &Pose, looks: &[i64], covariances: &[Matrix4<f64>]) -> Row {
    let tip = pose.tip_b_m.map(|tip_b_m| pose.p_n + pose.c_nb * tip_b_m);
    // Between two looks variances lie on a line.
    let next = pose.after.min(covariances.len() - 1);
    let last = next.saturating_sub(1);
    let share = (pose.t_ns - looks[last]) as f64 / (looks[next] - looks[last]).max(1) as f64;
    let share = share.clamp(0.0, 1.0);
    let covariance = covariances[last] * (1.0 - share) + covariances[next] * share;
    let sigma = |axis: usize| covariance[(axis, axis)].max(0.0).sqrt();
    Row {
        t_ns: pose.t_ns,
        tip_n_m: tip.map(Into::into),
        antenna_n_m: (pose.p_n + pose.c_nb * pose.antenna_b_m).into(),
        sigma_n_m: [sigma(0), sigma(1), sigma(2)],
        sigma_heading_rad: sigma(3),
        contact: pose.stands,
    }
}

#[cfg(test)]
#[path = "survey_tests.rs"]
mod tests;
