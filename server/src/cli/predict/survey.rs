//! `lodestep predict survey`: what sigma a point in the middle of a gap will have.
//!
//! The forecast is the estimator's own covariance over ways that are drawn as a surveyor walks them, with sensors of the
//! class that it takes for granted: what it would say of itself when it has come there.

use anyhow::Result;
use clap::Args;
use lodestep_engine::anomaly::Cause as _;
use lodestep_engine::geo::Geodetic;
use lodestep_engine::parse::gnss::{GnssQuality, GnssRow};
use lodestep_engine::sim::pole::{Route, SimulatedSurvey, Trouble, simulate};
use lodestep_engine::systems::pole::recorder::Recorder;
use lodestep_engine::systems::pole::recording::{Instrument, Stop};
use lodestep_engine::systems::pole::survey::{Options, Survey, compute};
use lodestep_engine::systems::pole::tuning::Tuning;
use serde::Serialize;

use crate::cli::failure::Failure;
use crate::cli::print::print;

/// Draws of the forecast begin here: no other command counts its seeds so far.
const FIRST_SEED: u64 = 900_000;

/// The arguments of `lodestep predict survey`.
#[derive(Debug, Args)]
pub(super) struct SurveyArgs {
    /// The way without sky and its length, m: I straight, L with a corner, U with two, and the point lies in its middle; B so
    /// far under the roof and the same way back, and the point is where it turns
    #[arg(long, value_name = "I60|L20|U20|B60", default_value = "I60")]
    route: Route,

    /// Without a switch in the tip
    #[arg(long)]
    without_switch: bool,

    /// Ways to draw
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = clap::value_parser!(u64).range(1..=100))]
    ways: u64,

    /// JSON instead of words
    #[arg(long)]
    json: bool,

    /// All routes over several lengths, as JSON: what the page shows of them
    #[arg(long, conflicts_with_all = ["route", "json"])]
    table: bool,
}

/// Routes and lengths of the table.
const TABLE: ([&str; 4], [f64; 5]) = (["I", "L", "U", "B"], [20.0, 40.0, 60.0, 80.0, 100.0]);

/// A row of the table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct TableRow {
    /// The letter of the route.
    route: &'static str,
    /// Its length without sky, m; of a way there and back one of the two.
    metres: f64,
    /// Sigma at the point in plan, m.
    plan_m: f64,
    /// Up, m.
    up_m: f64,
    /// Sigma of the place in plan at the end of the gap, before the sky comes back, m.
    live_m: f64,
}

fn table(seeds: &std::ops::Range<u64>, switch: bool) -> Result<Vec<TableRow>> {
    let (routes, lengths) = TABLE;
    let mut rows = Vec::new();
    for letter in routes {
        for metres in lengths {
            let route = format!("{letter}{metres}").parse().map_err(Failure::BadInput)?;
            let Forecast { along_m, across_m, up_m, live_m, .. } = forecast(route, seeds.clone(), switch)?;
            let millimetres = |m: f64| (m * 1e3).round() * 1e-3;
            rows.push(TableRow {
                route: letter,
                metres,
                plan_m: millimetres(along_m.hypot(across_m)),
                up_m: millimetres(up_m),
                live_m: millimetres(live_m),
            });
        }
    }
    Ok(rows)
}

/// A forecast, root mean square over the ways that were drawn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Forecast {
    /// Sigma at the point along the way, when all of the survey is there, m.
    along_m: f64,
    /// Across it, m.
    across_m: f64,
    /// Up, m.
    up_m: f64,
    /// Sigma of the place in plan at the end of the gap, before the sky comes back, m.
    live_m: f64,
    /// Sigma of the heading when the sky is lost, degrees.
    heading_deg: f64,
    /// From the last fix to the point, s.
    since_fix_s: f64,
}

/// Predicts.
pub(super) fn survey(args: &SurveyArgs) -> Result<()> {
    let seeds = FIRST_SEED..FIRST_SEED + args.ways;
    if args.table {
        let rows = table(&seeds, !args.without_switch)?;
        return print(&(serde_json::to_string_pretty(&rows)? + "\n"));
    }
    let forecast = forecast(args.route, seeds, !args.without_switch)?;
    if args.json {
        return print(&(serde_json::to_string_pretty(&forecast)? + "\n"));
    }
    let Forecast { along_m, across_m, up_m, live_m, heading_deg, since_fix_s } = forecast;
    let back = match args.route {
        Route::B(_) => "",
        Route::I(_) | Route::L(_) | Route::U(_) => {
            " There and back is better still: visits of one name are combined."
        }
    };
    print(&format!(
        "At the point, {since_fix_s:.0} s from the last fix: {along_m:.3} m along the way, {across_m:.3} m across, {up_m:.3} m up (1σ), \
         once the survey has ended under the sky.\n\
         On the way, before the sky comes back: {live_m:.2} m in plan at the end of the gap.\n\
         That takes a heading known to {heading_deg:.2}° when the sky is lost: lean the pole for a minute before, and after.{back}\n"
    ))
}

/// The forecast over these draws.
fn forecast(route: Route, seeds: std::ops::Range<u64>, switch: bool) -> Result<Forecast> {
    let count = (seeds.end - seeds.start).max(1) as f64;
    let mut squares = [0.0; 6];
    for seed in seeds {
        let simulated = simulate(route, seed, Trouble::None);
        let of = one(&simulated, switch)?;
        for (sum, value) in squares.iter_mut().zip(of) {
            *sum += value * value / count;
        }
    }
    let [along_m, across_m, up_m, live_m, heading_deg, since_fix_s] = squares.map(f64::sqrt);
    Ok(Forecast { along_m, across_m, up_m, live_m, heading_deg, since_fix_s })
}

/// What the estimator says of itself: along, across, up, live, heading in degrees, seconds since the last fix.
fn one(simulated: &SimulatedSurvey, switch: bool) -> Result<[f64; 6]> {
    let smoothed = computed(simulated, switch, true)?;
    let filtered = computed(simulated, switch, false)?;
    let [cos, sin] = direction(simulated);
    let Some(point) = smoothed.points.first() else {
        return Err(Failure::BadInput(
            "expected a point of the survey that was drawn, found none".to_owned(),
        )
        .into());
    };
    let covariance = &point.covariance_n_m2;
    let sigma = |e: f64, n: f64| {
        let variance =
            e * e * covariance[(0, 0)] + 2.0 * e * n * covariance[(0, 1)] + n * n * covariance[(1, 1)];
        variance.max(0.0).sqrt()
    };
    let (_, back_ns) = gap(simulated);
    let last = filtered.rows.iter().take_while(|row| row.t_ns < back_ns).last();
    let live_m = last.map_or(f64::NAN, |row| row.sigma_n_m[0].hypot(row.sigma_n_m[1]));
    let heading_deg = filtered.figures.heading_sigma_deg.first().map_or(f64::NAN, |(_, sigma)| *sigma);
    Ok([
        sigma(cos, sin),
        sigma(-sin, cos),
        covariance[(2, 2)].max(0.0).sqrt(),
        live_m,
        heading_deg,
        point.since_fix_s,
    ])
}

/// The longest time without a fix: its ends, ns.
fn gap(simulated: &SimulatedSurvey) -> (i64, i64) {
    let pairs = simulated.gnss.windows(2).map(|pair| (pair[0].t_ns, pair[1].t_ns));
    pairs.max_by_key(|(lost_ns, back_ns)| back_ns - lost_ns).unwrap_or((0, 0))
}

/// The direction of the way where the sky is lost, east and north.
fn direction(simulated: &SimulatedSurvey) -> [f64; 2] {
    let (lost_ns, _) = gap(simulated);
    let at = |t_ns: i64| {
        let row = simulated.truth.iter().find(|row| row.t_ns >= t_ns).or(simulated.truth.last());
        row.map_or([0.0; 3], |row| row.tip_n_m)
    };
    let ([e0, n0, _], [e1, n1, _]) = (at(lost_ns), at(lost_ns + 8_000_000_000));
    let length = (e1 - e0).hypot(n1 - n0).max(f64::MIN_POSITIVE);
    [(e1 - e0) / length, (n1 - n0) / length]
}

fn computed(simulated: &SimulatedSurvey, switch: bool, smoothed: bool) -> Result<Survey> {
    let frame = simulated.site.local_frame();
    let mut recorder = Recorder::default();
    for sample in &simulated.imu {
        recorder.sample(sample);
    }
    for epoch in &simulated.gnss {
        let place: Geodetic = frame.to_geodetic(epoch.p_n_m);
        let quality = if epoch.quality == "fixed" { GnssQuality::Fixed } else { GnssQuality::Float };
        recorder.position(GnssRow { t_ns: epoch.t_ns, place, sigma_n_m: Some(epoch.sigma_n_m), quality });
    }
    if switch {
        simulated.contact.iter().for_each(|(t_ns, closed)| recorder.contact(*t_ns, *closed));
    }
    let [t_start_ns, t_end_ns] = simulated.stop_ns;
    let stop = Stop { name: "T".to_owned(), t_start_ns, t_end_ns };
    let instrument =
        Instrument { antenna_b_m: simulated.antenna_b_m.into(), tip_b_m: Some(simulated.tip_b_m.into()) };
    let options = Options { tuning: Tuning::default(), smoothed, rate_hz: 20.0, lands: true };
    compute(&recorder.recording(&frame, vec![stop]), &instrument, &frame, &options)
        .map_err(|cause| Failure::BadInput(cause.sentence()).into())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors at the point of surveys that the forecast has not seen.
    fn errors(route: Route, seeds: std::ops::Range<u64>) -> [f64; 2] {
        let count = (seeds.end - seeds.start) as f64;
        let mut squares = [0.0; 2];
        for seed in seeds {
            let simulated = simulate(route, seed, Trouble::None);
            let survey = computed(&simulated, true, true).unwrap();
            let [e, n, u]: [f64; 3] = survey.points[0].p_n_m.into();
            let [te, tn, tu] = simulated.point_n_m;
            squares[0] += ((e - te).powi(2) + (n - tn).powi(2)) / count;
            squares[1] += (u - tu).powi(2) / count;
        }
        squares.map(f64::sqrt)
    }

    #[test]
    fn the_forecast_is_what_surveys_come_to_and_a_longer_way_is_less_sure() {
        let short = forecast(Route::I(20.0), 0..2, true).unwrap();
        let long = forecast(Route::I(60.0), 0..2, true).unwrap();
        assert!(long.across_m > short.across_m && long.live_m > short.live_m, "{short:?} {long:?}");
        let [plan_m, height_m] = errors(Route::I(20.0), 10..16);
        let told_m = short.along_m.hypot(short.across_m);
        assert!((0.4..2.5).contains(&(plan_m / told_m)), "{plan_m} {short:?}");
        assert!(height_m < 2.5 * short.up_m, "{height_m} {short:?}");
    }
}
