//! Does the filter know how wrong it is? Errors over their own sigmas, over many simulated walks.
//!
//! The normalised error squared (NEES) over its degrees of freedom is 1 on the mean where a filter is
//! honest, more where it is surer than it may be. Each walk counts once, at its end, so that the mean
//! over N independent walks lies within bounds that are known.

use std::fmt::Write as _;

use anyhow::Result;
use clap::Args;
use lodestep_engine::evaluate::chi_square_bounds_95;
use lodestep_engine::geo::Site;
use lodestep_engine::sample::Foot;
use lodestep_engine::session::{Aids, SessionConfig};
use lodestep_engine::sim::{self, SensorModel, Walk, WalkKind};

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
    feet: &'static [Foot],
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
    let both: &[Foot] = &Foot::BOTH;
    let left: &[Foot] = &[Foot::Left];
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

/// Sums over the walks of one configuration.
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
        "Simulated CMP10A sensors at {}, seeds 1 to {}, at the end of each walk: the mean over the walks of the error \
         squared over its own variance, by degree of freedom. 1 is honest; over so many walks 95 of 100 honest filters lie \
         between {low_2:.2} and {high_2:.2} in plan and between {low_1:.2} and {high_1:.2} in height. Behind it the error, \
         rms, and the sigma that the filter told. Made by `lodestep evaluate honesty --seeds {}`.\n\n\
         | configuration | plan | error, m | told, m | height | error, m | told, m |\n|---|---|---|---|---|---|---|\n",
        site.name, args.seeds, args.seeds
    );
    for configuration in &configurations {
        let mut sums = Sums::default();
        for seed in 1..=args.seeds {
            let walk = sim::simulate(&configuration.walk, seed, &site, &model);
            add(&mut sums, configuration, &walk, &site)?;
            bar.inc(1);
        }
        let mean = |sum: f64| sum / sums.walks;
        writeln!(
            out,
            "| {} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} |",
            configuration.name,
            mean(sums.plan) / 2.0,
            mean(sums.plan_squared_m2).sqrt(),
            mean(sums.plan_variance_m2).sqrt(),
            mean(sums.height),
            mean(sums.height_squared_m2).sqrt(),
            mean(sums.height_variance_m2).sqrt(),
        )
        .expect("writing to a string cannot fail");
    }
    bar.finish_and_clear();
    print(&out)
}

fn add(sums: &mut Sums, configuration: &Configuration, walk: &Walk, site: &Site) -> Result<()> {
    let first = configuration.feet[0];
    let middle = |at: usize| -> [f64; 3] {
        std::array::from_fn(|axis| {
            let of = |foot: &Foot| walk.truth[at][foot.index()].position_n_m[axis];
            configuration.feet.iter().map(of).sum::<f64>() / configuration.feet.len() as f64
        })
    };
    let config = SessionConfig {
        feet: configuration.feet.to_vec(),
        initial_position_n_m: middle(0),
        initial_heading_rad: configuration.heading_given.then(|| walk.truth[0][first.index()].heading_rad),
        declination_rad: site.declination_deg.to_radians(),
        gravity_m_s2: site.gravity_m_s2,
        aids: configuration.aids,
        ..SessionConfig::default()
    };
    let logs = configuration.feet.iter().map(|foot| {
        let log = if *foot == Foot::Left { &walk.left } else { &walk.right };
        (*foot, InMemory(log))
    });
    let visits = if configuration.aids.markers { visits_of(walk) } else { Vec::new() };
    let told = run(config, &visits, logs)?;
    let Some(point) = told.track.points.last() else { return Ok(()) };
    let truth = middle(walk.truth.len() - 1);
    let off: [f64; 3] = std::array::from_fn(|axis| point.position_n_m[axis] - truth[axis]);
    let [variance_e, variance_n, variance_u] = point.sigma_n_m.map(|sigma| sigma * sigma);
    let shared = point.covariance_en_m2;
    let determinant = variance_e * variance_n - shared * shared;
    let [e, n, u] = off;
    sums.walks += 1.0;
    sums.plan += (e * e * variance_n - 2.0 * e * n * shared + n * n * variance_e) / determinant;
    sums.height += u * u / variance_u;
    sums.plan_squared_m2 += e * e + n * n;
    sums.plan_variance_m2 += variance_e + variance_n;
    sums.height_squared_m2 += u * u;
    sums.height_variance_m2 += variance_u;
    Ok(())
}
