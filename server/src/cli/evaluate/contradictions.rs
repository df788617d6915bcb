//! Sensors that contradict each other, on walks of drawn worlds: what each kind costs, and whether it is told.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use anyhow::Result;
use clap::{Args, ValueEnum};
use lodestep_engine::event::TrackPoint;
use lodestep_engine::geo::Site;
use lodestep_engine::session::SessionConfig;
use lodestep_engine::sim::pedestrian::contradictions::{CONTRADICTIONS, Worn};
use lodestep_engine::sim::pedestrian::{SensorModel, Walk, WalkKind, simulate};
use lodestep_engine::sim::white_noise;
use lodestep_engine::systems::pedestrian::{self, Side};

use super::ladder::InMemory;
use crate::cli::print::print;
use crate::cli::progress;
use crate::cli::run::{Walked, run};
use crate::cli::solution::Solution;

/// A plan error beyond so many sigmas is one that the sigma denies.
const DENIED: f64 = 5.0;
/// Of the points of a track every so-manieth is held against the truth.
const EVERY: usize = 25;

/// The arguments of `lodestep evaluate contradictions`.
#[derive(Debug, Args)]
pub(super) struct ContradictionsArgs {
    /// How many walks each, from seed 1 on
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: u64,

    /// Only kinds whose name holds this
    #[arg(long, value_name = "TEXT", default_value = "")]
    kind: String,

    /// Which feet wear a sensor
    #[arg(long, value_enum, default_value_t = Feet::Both)]
    feet: Feet,

    /// Instead of kind by kind: so many walks with one to three kinds at a time, drawn
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000))]
    mixtures: Option<u64>,

    /// Which solution to judge
    #[arg(long, value_enum, default_value_t)]
    solution: Solution,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Feet {
    Both,
    Left,
}

/// What one kind came to over its walks.
#[derive(Default)]
struct Sums {
    plan_m: Vec<f64>,
    sigma_m: Vec<f64>,
    plan_ratio: f64,
    height_m: f64,
    height_ratio: f64,
    silent: usize,
    silent_in_plan: usize,
    kinds: BTreeSet<String>,
}

/// Prints the table.
pub(super) fn contradictions(args: &ContradictionsArgs) -> Result<()> {
    let site = Site::fast();
    let feet: &[Side] = match args.feet {
        Feet::Both => &Side::BOTH,
        Feet::Left => &[Side::Left],
    };
    if let Some(count) = args.mixtures {
        return mixtures(count, feet, &site, args.solution);
    }
    let walks: Vec<Walk> = (1..=args.seeds).map(|seed| walk(seed, &site)).collect();
    let mut out = "| contradiction | end off, m, median | told | largest over sigma | height off, m | over sigma | silent | told as |\n\
         |---|---|---|---|---|---|---|---|\n"
        .to_owned();
    let chosen: Vec<_> =
        CONTRADICTIONS.iter().flat_map(|kind| kind.severities.iter().map(move |by| (kind, *by))).collect();
    let bar = progress::of_count(chosen.len() as u64, "kinds");
    let (mut runs, mut silent) = (0, 0);
    let mut row = |name: &str, spoil: &dyn Fn(&mut Worn)| -> Result<()> {
        if !name.contains(&args.kind) {
            return Ok(());
        }
        let mut sums = Sums::default();
        for walk in &walks {
            let mut worn = worn(walk, feet);
            spoil(&mut worn);
            sums.take(&walked(&worn, feet, &site, args.solution)?, &worn);
        }
        runs += walks.len();
        silent += sums.silent;
        sums.print(name, &mut out);
        Ok(())
    };
    row("nothing wrong", &|_| {})?;
    for (kind, by) in chosen {
        row(&kind.named(by), &|worn| kind.spoil(worn, by))?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    writeln!(out, "\n{silent} of {runs} walks are wrong by more than {DENIED} sigma without a word.")?;
    print(&out)
}

/// Walks with one to three kinds at a time: of how many the sigma denies the error without a word.
fn mixtures(count: u64, feet: &[Side], site: &Site, solution: Solution) -> Result<()> {
    let bar = progress::of_count(count, "walks");
    let (mut denied, mut out) = (0, String::new());
    for seed in 1..=count {
        let walk = walk(seed, site);
        let (names, worn) = mixture(&walk, seed, feet);
        let mut sums = Sums::default();
        sums.take(&walked(&worn, feet, site, solution)?, &worn);
        if sums.silent_in_plan > 0 {
            denied += 1;
            writeln!(out, "{seed}: {} ({:.1} sigma)", names.join("; "), sums.plan_ratio)?;
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    let share = 100.0 * (1.0 - f64::from(denied) / count as f64);
    writeln!(
        out,
        "\nOf {count} walks {denied} are wrong in plan by more than {DENIED} sigma without a word: {share:.1} % are not. \
         Made by `lodestep evaluate contradictions --mixtures {count}`."
    )?;
    print(&out)
}

/// A walk with one to three kinds at a time, and which.
fn mixture(walk: &Walk, seed: u64, feet: &[Side]) -> (Vec<String>, Worn) {
    let mut normal = white_noise(seed + 1_000_000);
    // Digits of a normal number far behind its point are as likely as any.
    let mut draw = |most: usize| ((normal().abs() * 1e6).fract() * most as f64) as usize % most;
    let (mut worn, mut names) = (worn(walk, feet), Vec::new());
    for _ in 0..1 + draw(3) {
        let kind = &CONTRADICTIONS[draw(CONTRADICTIONS.len())];
        let by = kind.severities[draw(kind.severities.len())];
        kind.spoil(&mut worn, by);
        names.push(kind.named(by));
    }
    (names, worn)
}

/// A walk of a world that is drawn: once around a block, or straight on; sensors 0.5 to 2 times their data sheet.
pub(super) fn walk(seed: u64, site: &Site) -> Walk {
    let mut normal = white_noise(seed);
    let mut times = || (0.35 * normal()).clamp(-0.69, 0.69).exp();
    let mut model = SensorModel::cmp10a();
    model.imu.gyro_noise_deg_s_rthz *= times();
    model.imu.gyro_bias_deg_s *= times();
    model.imu.gyro_bias_walk_deg_s_rts *= times();
    model.imu.accel_bias_m_s2 *= times();
    model.imu.scale *= times();
    model.imu.misalignment_rad *= times();
    model.field_anomalies.strength_ut *= times();
    if let Some(magnetometer) = &mut model.magnetometer {
        magnetometer.hard_iron_ut *= times();
        magnetometer.soft_iron *= times();
    }
    if let Some(barometer) = &mut model.barometer {
        barometer.noise_m *= times();
        barometer.drift_m_rts *= times();
    }
    let metres = 60.0 + 20.0 * times();
    let kind = if seed.is_multiple_of(3) { WalkKind::Line { metres } } else { WalkKind::Block { metres } };
    simulate(&kind, seed, site, &model)
}

/// The logs of a walk as they should be, with the truth of the middle of the feet.
pub(super) fn worn(walk: &Walk, feet: &[Side]) -> Worn {
    let log = |side: Side, log: &[_]| if feet.contains(&side) { log.to_vec() } else { Vec::new() };
    let place = |truth: &[lodestep_engine::sim::pedestrian::FootTruth; 2]| -> [f64; 3] {
        std::array::from_fn(|axis| {
            let of = |side: &Side| truth[side.index()].position_n_m[axis];
            feet.iter().map(of).sum::<f64>() / feet.len() as f64
        })
    };
    Worn {
        logs: [log(Side::Left, &walk.left), log(Side::Right, &walk.right)],
        truth: walk.left.iter().zip(&walk.truth).map(|(sample, truth)| (sample.t_ns, place(truth))).collect(),
    }
}

/// The track of what is worn; the heading is the magnetometer's.
pub(super) fn walked(worn: &Worn, feet: &[Side], site: &Site, solution: Solution) -> Result<Walked> {
    let config = SessionConfig {
        initial_position_n_m: worn.truth.first().map_or([0.0; 3], |truth| truth.1),
        declination_rad: site.declination_deg.to_radians(),
        site_field: Some(site.field()),
        gravity_m_s2: site.gravity_m_s2,
        solution: solution.into(),
        ..pedestrian::Config::default().session(feet)
    };
    run(config, &[], feet.iter().map(|side| (*side, InMemory(&worn.logs[side.index()]))))
}

/// How far a point is from the truth in plan, m, and over the sigma in that direction; the same of its height.
pub(super) fn off(point: &TrackPoint, worn: &Worn) -> Option<[f64; 4]> {
    let after = worn.truth.partition_point(|truth| truth.0 < point.t_ns);
    let (_, place_m) = worn.truth.get(after).or(worn.truth.last())?;
    let [e, n, u]: [f64; 3] = std::array::from_fn(|axis| point.position_n_m[axis] - place_m[axis]);
    let plan_m = e.hypot(n);
    let [variance_e, variance_n, variance_u] = point.sigma_n_m.map(|sigma| sigma * sigma);
    let along = e * e * variance_e + 2.0 * e * n * point.covariance_en_m2 + n * n * variance_n;
    let sigma_m = (along.max(0.0) / (plan_m * plan_m)).sqrt();
    Some([plan_m, plan_m / sigma_m, u.abs(), u.abs() / variance_u.sqrt()])
}

impl Sums {
    fn take(&mut self, walked: &Walked, worn: &Worn) {
        let points = &walked.track.points;
        let all = points.iter().rev().step_by(EVERY).filter_map(|point| off(point, worn));
        let worst = all.fold([0.0_f64; 4], |worst, off| std::array::from_fn(|k| worst[k].max(off[k])));
        if let Some(last) = points.last() {
            let [plan_m, ratio, ..] = off(last, worn).unwrap_or_default();
            self.plan_m.push(plan_m);
            self.sigma_m.push(plan_m / ratio);
        }
        self.plan_ratio = self.plan_ratio.max(worst[1]);
        self.height_m = self.height_m.max(worst[2]);
        self.height_ratio = self.height_ratio.max(worst[3]);
        let told = walked.track.anomalies.iter().map(|anomaly| anomaly.kind.as_str().to_owned());
        let told: BTreeSet<String> = told.collect();
        self.silent += usize::from(told.is_empty() && (worst[1] > DENIED || worst[3] > DENIED));
        self.silent_in_plan += usize::from(told.is_empty() && worst[1] > DENIED);
        self.kinds.extend(told);
    }

    fn print(&mut self, name: &str, out: &mut String) {
        let median = |values: &mut Vec<f64>| {
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
        };
        let kinds: Vec<&str> = self.kinds.iter().map(String::as_str).collect();
        writeln!(
            out,
            "| {name} | {:.2} | {:.2} | {:.1} | {:.2} | {:.1} | {} | {} |",
            median(&mut self.plan_m),
            median(&mut self.sigma_m),
            self.plan_ratio,
            self.height_m,
            self.height_ratio,
            self.silent,
            kinds.join(", ")
        )
        .expect("writing to a string cannot fail");
    }
}
