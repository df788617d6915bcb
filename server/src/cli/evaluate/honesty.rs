//! Does the filter know how wrong it is? Errors over their own sigmas, over many simulated walks.
//!
//! The normalised error squared (NEES) over its degrees of freedom is 1 on the mean where a filter is
//! honest, more where it is surer than it may be. Each walk counts once, at its end, and once more in its middle for
//! the smoother, so that the mean over N independent walks lies within bounds that are known. What is given at the
//! start, position and heading, errs as much as the filter is told that it may.

use std::fmt::Write as _;

use anyhow::Result;
use clap::Args;
use lodestep_engine::evaluate::chi_square_bounds_95;
use lodestep_engine::event::TrackPoint;
use lodestep_engine::geo::Site;
use lodestep_engine::session::{SessionConfig, Solution};
use lodestep_engine::sim::pedestrian::{SensorModel, Walk, WalkKind, simulate};
use lodestep_engine::sim::white_noise;
use lodestep_engine::systems::pedestrian::Side;
use lodestep_engine::systems::pedestrian::{self, Aids};

use super::ladder::{InMemory, visits_of};
use crate::cli::print::print;
use crate::cli::progress;
use crate::cli::run::run;

/// The arguments of `lodestep evaluate honesty`.
#[derive(Debug, Args)]
pub(super) struct HonestyArgs {
    /// How many seeds, from 1 on
    #[arg(long, value_name = "N", default_value_t = 50, value_parser = clap::value_parser!(u64).range(2..=1000))]
    seeds: u64,
}

/// One way of walking and of being equipped.
struct Configuration {
    name: &'static str,
    walk: WalkKind,
    feet: &'static [Side],
    /// Without a magnetometer the true heading is given.
    heading_given: bool,
    aids: Aids,
}

const ALL: Aids =
    Aids { zupt: true, heading: true, maru: true, separation: true, markers: true, altimeter: true };
const ZUPT_ALONE: Aids =
    Aids { zupt: true, heading: false, maru: false, separation: false, markers: false, altimeter: false };

fn configurations() -> Vec<Configuration> {
    let line = |metres: f64| WalkKind::Line { metres };
    let both: &[Side] = &Side::BOTH;
    let left: &[Side] = &[Side::Left];
    let of = |name, walk, feet, heading_given, aids| Configuration { name, walk, feet, heading_given, aids };
    vec![
        of("one foot, zero velocity alone, 100 m straight", line(100.0), left, true, ZUPT_ALONE),
        of("one foot, all aids, 200 m straight", line(200.0), left, false, ALL),
        of("two feet, zero velocity alone, 100 m straight", line(100.0), both, true, ZUPT_ALONE),
        of("two feet, all aids, 40 m straight", line(40.0), both, false, ALL),
        of("two feet, all aids, 200 m straight", line(200.0), both, false, ALL),
        of("two feet, all aids, stairs", WalkKind::Stairs, both, false, ALL),
        of("two feet, all aids, walking and running", WalkKind::Running, both, false, ALL),
        of("two feet, all aids, rectangle of 1.4 km", WalkKind::Rectangle, both, false, ALL),
        of("two feet, all aids, spiral of 3.3 km with markers", WalkKind::Spiral, both, false, ALL),
    ]
}

/// Sums over the walks of one configuration at one instant.
#[derive(Default)]
struct Sums {
    walks: f64,
    plan: f64,
    height: f64,
    plan_squared_m2: f64,
    plan_variance_m2: f64,
    height_squared_m2: f64,
    height_variance_m2: f64,
}

/// Prints the table.
pub(super) fn honesty(args: &HonestyArgs) -> Result<()> {
    let site = Site::fast();
    let model = SensorModel::cmp10a();
    let configurations = configurations();
    let bar = progress::of_count(args.seeds * configurations.len() as u64, "walks");
    let [low_2, high_2] = chi_square_bounds_95(2 * args.seeds).map(|b| b / (2 * args.seeds) as f64);
    let [low_1, high_1] = chi_square_bounds_95(args.seeds).map(|b| b / args.seeds as f64);
    let mut out = format!(
        "Simulated CMP10A sensors at {}, seeds 1 to {}: the mean over the walks of the error \
         squared over its own variance, by degree of freedom. 1 is honest; over so many walks 95 of 100 honest filters lie \
         between {low_2:.2} and {high_2:.2} in plan and between {low_1:.2} and {high_1:.2} in height. Behind it the error, \
         rms, and the sigma that was told. At the end of a walk filter and smoother are one; in its middle the smoother is \
         judged. The start is given as wrongly as the filter is told that it may be. Made by `lodestep evaluate honesty \
         --seeds {}`.\n\n\
         | configuration | at | plan | error, m | told, m | height | error, m | told, m |\n|---|---|---|---|---|---|---|---|\n",
        site.name, args.seeds, args.seeds
    );
    for configuration in &configurations {
        let (mut middle, mut end) = (Sums::default(), Sums::default());
        for seed in 1..=args.seeds {
            let walk = simulate(&configuration.walk, seed, &site, &model);
            add([&mut middle, &mut end], configuration, &walk, &site, seed)?;
            bar.inc(1);
        }
        end.print(configuration.name, "end", &mut out);
        middle.print("", "middle, smoothed", &mut out);
    }
    bar.finish_and_clear();
    print(&out)
}

fn add(
    [in_the_middle, at_the_end]: [&mut Sums; 2],
    configuration: &Configuration,
    walk: &Walk,
    site: &Site,
    seed: u64,
) -> Result<()> {
    let first = configuration.feet[0];
    let middle = |at: usize| -> [f64; 3] {
        std::array::from_fn(|axis| {
            let of = |foot: &Side| walk.truth[at][foot.index()].position_n_m[axis];
            configuration.feet.iter().map(of).sum::<f64>() / configuration.feet.len() as f64
        })
    };
    let own = pedestrian::Config { aids: configuration.aids, ..Default::default() };
    let tuning = own.tuning.clone();
    let mut normal = white_noise(seed);
    let mut off = |sigma: f64| sigma * normal();
    let start_n_m = middle(0).map(|at_m| at_m + off(tuning.first_position_sigma_m));
    let heading_rad = walk.truth[0][first.index()].heading_rad + off(tuning.given_heading_sigma_rad);
    let config = SessionConfig {
        initial_position_n_m: start_n_m,
        initial_heading_rad: configuration.heading_given.then_some(heading_rad),
        declination_rad: site.declination_deg.to_radians(),
        site_field: Some(site.field()),
        gravity_m_s2: site.gravity_m_s2,
        solution: Solution::Smoothed,
        ..own.session(configuration.feet)
    };
    let logs = configuration.feet.iter().map(|foot| {
        let log = if *foot == Side::Left { &walk.left } else { &walk.right };
        (*foot, InMemory(log))
    });
    let visits = if configuration.aids.markers { visits_of(walk) } else { Vec::new() };
    let told = run(config, &visits, logs)?;
    let points = &told.track.points;
    let Some(last) = points.last() else { return Ok(()) };
    at_the_end.take(last, &middle(walk.truth.len() - 1));
    let halfway = walk.truth.len() / 2;
    let t_ns = walk.left[halfway].t_ns;
    let after = points.partition_point(|point| point.t_ns < t_ns);
    if let Some(point) = points.get(after).filter(|point| point.t_ns == t_ns) {
        in_the_middle.take(point, &middle(halfway));
    }
    Ok(())
}

impl Sums {
    fn take(&mut self, point: &TrackPoint, truth_n_m: &[f64; 3]) {
        let [e, n, u]: [f64; 3] = std::array::from_fn(|axis| point.position_n_m[axis] - truth_n_m[axis]);
        let [variance_e, variance_n, variance_u] = point.sigma_n_m.map(|sigma| sigma * sigma);
        let shared = point.covariance_en_m2;
        let determinant = variance_e * variance_n - shared * shared;
        self.walks += 1.0;
        self.plan += (e * e * variance_n - 2.0 * e * n * shared + n * n * variance_e) / determinant;
        self.height += u * u / variance_u;
        self.plan_squared_m2 += e * e + n * n;
        self.plan_variance_m2 += variance_e + variance_n;
        self.height_squared_m2 += u * u;
        self.height_variance_m2 += variance_u;
    }

    fn print(&self, name: &str, at: &str, out: &mut String) {
        let mean = |sum: f64| sum / self.walks;
        writeln!(
            out,
            "| {name} | {at} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} |",
            mean(self.plan) / 2.0,
            mean(self.plan_squared_m2).sqrt(),
            mean(self.plan_variance_m2).sqrt(),
            mean(self.height),
            mean(self.height_squared_m2).sqrt(),
            mean(self.height_variance_m2).sqrt(),
        )
        .expect("writing to a string cannot fail");
    }
}
