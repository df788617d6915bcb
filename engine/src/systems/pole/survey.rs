//! A whole survey: aligned, filtered, smoothed, and what its points are.

use nalgebra::{Matrix3, Matrix4, Vector3};

use super::alignment::{self, Aligned, NotAligned};
use super::causes::SurveyCause;
use super::contact::Interval;
use super::filter::Filter;
use super::pass::{self, Closure, Island, LONG_GAP_NS, Pass, Setting, Wanted, Weighed};
use super::points::{self, Point};
use super::recording::{Fix, Instrument, Recording};
use super::smoothing::{self, Smoothed};
use super::tuning::Tuning;
use super::{checks, findings, learnt, outcome, refusals, sensor_class, start};
use crate::anomaly::Anomaly;
use crate::event::AidOutcome;
use crate::geo::LocalFrame;
use crate::ins::earth::Earth;

/// Clocks that are less apart are one, s: what is left of it the filter finds.
const LEAST_APART_S: f64 = 0.003;

/// A first pass is made anew at most so often with wider gates, where variances prove to be so many times larger.
const MOST_WIDENED: usize = 2;
const LEAST_WIDENED: f64 = 1.6;

/// What is to be computed.
#[derive(Clone, Debug)]
pub struct Options {
    /// The figures of the filter.
    pub tuning: Tuning,
    /// Whether what came later counts, too.
    pub smoothed: bool,
    /// Poses in the track, a second.
    pub rate_hz: f64,
    /// Whether landings are used, where there is a tip.
    pub lands: bool,
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
    /// Covariance of east and north of the same, m².
    pub covariance_en_m2: f64,
    /// Azimuth of the sensor's x axis, rad in (−π, π].
    pub heading_rad: f64,
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
    pub findings: Vec<Anomaly>,
    /// What was used, and what not.
    pub figures: Figures,
    /// What was measured, and whether it was used: fixes, then landings.
    pub aids: Vec<AidOutcome>,
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
    /// How the gaps close.
    pub closures: Vec<Closure>,
    /// Sigma of the heading at the end of each stretch of fixes, as the filter had it: time, s, and degrees.
    pub heading_sigma_deg: Vec<(f64, f64)>,
    /// Lever arm of the antenna as estimated, m.
    pub antenna_b_m: [f64; 3],
    /// Lever arm of the tip as estimated, m.
    pub tip_b_m: Option<[f64; 3]>,
    /// How far the tip rolls as the pole leans by one, m.
    pub roundness_m: f64,
    /// What the receiver's clock shows more than the sensor's, s.
    pub clock_apart_s: f64,
    /// When the first attitude was found: from and until, s.
    pub aligned_s: [f64; 2],
}

/// Computes a survey.
///
/// # Errors
///
/// Where inputs do not belong together, or do not say where north is.
pub fn compute(
    recording: &Recording,
    instrument: &Instrument,
    frame: &LocalFrame,
    options: &Options,
) -> Result<Survey, SurveyCause> {
    checks::check(recording, instrument, frame)?;
    let earth = Earth::turning(frame);
    // The paper's estimator learns nothing, and what is taken for granted of a sensor in the hand is wide as it is.
    let learns = options.tuning.zero_velocity_m_s.is_none() && instrument.tip_b_m.is_some();
    let tuning = &match learns {
        true => sensor_class::tuned(&options.tuning, &recording.imu),
        false => options.tuning.clone(),
    };
    let apart_s = match options.smoothed && tuning.start.clock_s > 0.0 {
        true => clock_apart(recording, instrument, &earth, options.lands, tuning),
        false => 0.0,
    };
    let together = (apart_s.abs() > LEAST_APART_S).then(|| recording.together(apart_s));
    let recording = together.as_ref().unwrap_or(recording);
    let imu = &recording.imu;
    let aligned = alignment::align(imu, &recording.fixes, &instrument.antenna_b_m, &earth)
        .map_err(NotAligned::cause)?;
    let contacts = match options.lands {
        true => start::contacts(recording, instrument, &earth, &aligned),
        false => Vec::new(),
    };
    let still =
        start::still(recording, instrument, &earth, &aligned).filter(|_| tuning.zero_velocity_m_s.is_none());
    let start = start::begin(recording, instrument, &earth, tuning, &aligned, &contacts);
    let mut islands = match tuning.zero_velocity_m_s {
        None => islands(&recording.fixes),
        Some(_) => Vec::new(),
    };
    let every_ns = libm::round(1e9 / options.rate_hz) as i64;
    let go = |tuning: &Tuning, restless: &[bool], islands: &[Island], start: &Filter, wanted: Wanted| {
        let setting = Setting {
            tuning,
            earth: &earth,
            imu,
            fixes: &recording.fixes,
            islands,
            contacts: &contacts,
            restless,
            felt: recording.switch.is_none(),
            still: still.as_deref(),
        };
        pass::go(&setting, start, aligned.sample, wanted, every_ns)
    };
    let mut restless = vec![false; contacts.len()];
    let mut factor = 1.0;
    let mut found = tuning.clone();
    let pass = if options.smoothed {
        let again = if tuning.zero_velocity_m_s.is_some() {
            start
        } else {
            let mut first = go(tuning, &restless, &islands, &start, Wanted::Start);
            let most = if learns { MOST_WIDENED } else { 0 };
            for _ in 0..most {
                // What is refused because the sigmas are too small carries the way off still more.
                let now = learnt::variance_factor(&first.closures);
                if now < factor * LEAST_WIDENED {
                    break;
                }
                factor = now;
                let wider = learnt::widened(tuning, factor);
                first = go(&wider, &restless, &islands, &start, Wanted::Start);
            }
            for (restless, landing) in restless.iter_mut().zip(&first.landings) {
                *restless = landing.restless;
            }
            if learns {
                found = learnt::widened(&learnt::tuned(tuning, &first), factor);
            }
            start::restarted(&start, first)
        };
        let mut pass = go(&found, &restless, &islands, &again, Wanted::Smoothed);
        if learns {
            let now = learnt::variance_factor(&pass.closures);
            if now > factor * LEAST_WIDENED {
                found = learnt::widened(&found, now / factor);
                pass = go(&found, &restless, &islands, &again, Wanted::Smoothed);
            }
            factor = learnt::variance_factor(&pass.closures);
        }
        if pass.doubts.is_empty() {
            pass
        } else {
            let smoothed = smoothing::smooth(pass, &[]).ok_or(SurveyCause::NotFinite)?;
            for (island, off_n_m, covariance) in &smoothed.islands {
                islands[*island].trusted = agrees(off_n_m, covariance);
            }
            go(&found, &restless, &islands, &again, Wanted::Smoothed)
        }
    } else {
        go(tuning, &restless, &islands, &start, Wanted::Filtered)
    };
    refusals::look_at(&pass, &restless, recording, instrument)?;
    let mut figures = figures(&pass, &aligned);
    if together.is_some() {
        figures.clock_apart_s += apart_s;
    }
    let aids = aids(&pass, &contacts);
    let mut findings = recording.left_out.clone();
    findings.extend(findings::of(&pass, recording, instrument, tuning, &contacts, &restless, &islands));
    let looks: Vec<i64> = pass.looks.iter().map(|look| look.t_ns).collect();
    let asked: Vec<usize> =
        recording.stops.iter().map(|stop| nearest(&looks, (stop.t_start_ns + stop.t_end_ns) / 2)).collect();
    let Smoothed { poses, mut covariances, mut between, .. } = if options.smoothed {
        smoothing::smooth(pass, &asked).ok_or(SurveyCause::NotFinite)?
    } else {
        filtered(pass, &asked)
    };
    let lasting_m2 = match options.smoothed {
        true => learnt::lasting_m2(&found, &recording.fixes),
        false => Vector3::zeros(),
    };
    for covariance in &mut covariances {
        *covariance *= factor;
        (0..3).for_each(|axis| covariance[(axis, axis)] += lasting_m2[axis]);
    }
    for covariance in between.iter_mut().flatten() {
        *covariance = *covariance * factor + Matrix3::from_diagonal(&lasting_m2);
    }
    let rows: Vec<Row> = poses.iter().map(|pose| outcome::row(pose, &looks, &covariances)).collect();
    let mut visits = outcome::visits(recording, instrument, &poses);
    if !options.smoothed {
        // What a filter learns while the tip stands moves its own track: that is no slip.
        visits.iter_mut().for_each(|visit| visit.moved_m = 0.0);
    }
    let numbers: Vec<usize> = visits.iter().map(|visit| visit.stop).collect();
    let mut points = points::combine(&recording.stops, &visits, |a, b| {
        // Nobody knows which of the places was meant where the tip has moved on the point.
        let moved_m = if a == b { visits[a].moved_m } else { 0.0 };
        between[numbers[a]][numbers[b]] + Matrix3::identity() * (moved_m * moved_m)
    });
    for point in &mut points {
        let from_ns = point.visits[0][0];
        let last = recording.fixes.partition_point(|fix| fix.t_ns <= from_ns);
        let since = last.checked_sub(1).map_or(0, |last| from_ns - recording.fixes[last].t_ns);
        point.since_fix_s = if since > LONG_GAP_NS { since as f64 * 1e-9 } else { 0.0 };
    }
    findings.extend(findings::of_points(&points, &recording.stops, instrument));
    Ok(Survey { rows, points, findings, figures, aids })
}

/// What the receiver's clock shows more than the sensor's, by the leaning under open sky, s. Told once about where the first
/// attitude was found with it, and once more about what that says: the two are not known without each other.
fn clock_apart(
    recording: &Recording,
    instrument: &Instrument,
    earth: &Earth,
    lands: bool,
    tuning: &Tuning,
) -> f64 {
    let mut apart_s = 0.0;
    for _ in 0..2 {
        let shifted = (apart_s != 0.0).then(|| recording.together(apart_s));
        let recording = shifted.as_ref().unwrap_or(recording);
        let aligned = match alignment::align(&recording.imu, &recording.fixes, &instrument.antenna_b_m, earth)
        {
            Ok(aligned) => aligned,
            Err(_) => return apart_s,
        };
        let contacts = match lands {
            true => start::contacts(recording, instrument, earth, &aligned),
            false => Vec::new(),
        };
        let found_s = start::clock_s(recording, instrument, earth, tuning, &aligned, &contacts);
        apart_s += found_s;
        if found_s.abs() < LEAST_APART_S {
            break;
        }
    }
    apart_s
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

/// What became of each fix and of each landing.
fn aids(pass: &Pass, contacts: &[Interval]) -> Vec<AidOutcome> {
    let fixes = pass.weighed.iter().map(Weighed::outcome);
    let landings = contacts
        .iter()
        .zip(&pass.landings)
        .filter_map(|(contact, landing)| Some(AidOutcome { t_ns: contact.from_ns, ..landing.outcome()? }));
    let mut aids: Vec<AidOutcome> = fixes.chain(landings).collect();
    aids.sort_by_key(|aid| aid.t_ns);
    aids
}

fn figures(pass: &Pass, aligned: &Aligned) -> Figures {
    let used: Vec<f64> = pass.weighed.iter().filter(|fix| fix.used).map(|fix| fix.nis / 3.0).collect();
    let seconds = |t_ns: i64| t_ns as f64 * 1e-9;
    Figures {
        fixes_used: used.len(),
        fixes_refused: pass.weighed.len() - used.len(),
        fix_nis: used.iter().sum::<f64>() / used.len().max(1) as f64,
        landings: pass.landings.iter().filter(|landing| landing.looks > 0 && !landing.restless).count(),
        slipped: pass.landings.iter().filter(|landing| landing.has_slipped() && !landing.restless).count(),
        moved: pass.landings.iter().filter(|landing| landing.restless).count(),
        closures: pass.closures.clone(),
        heading_sigma_deg: pass.headings.iter().map(|(t, s)| (seconds(*t), s.to_degrees())).collect(),
        antenna_b_m: pass.end.antenna.arm_b_m.into(),
        tip_b_m: pass.end.tip.map(|tip| tip.arm_b_m.into()),
        roundness_m: pass.end.roundness_m,
        clock_apart_s: pass.end.clock_s,
        aligned_s: aligned.window_ns.map(seconds),
    }
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

#[cfg(test)]
#[path = "survey_tests.rs"]
mod tests;
