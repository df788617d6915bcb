//! Does the filter know how wrong it is in worlds that it was not made for? Every seed draws a whole world: who walks and where,
//! how good the sensors are, how they sit, their iron, the field on the way, the weather.
//!
//! Each world is walked twice, with markers and without, and each track judged twice, as it was known at its time and smoothed.
//! At ten instants of a walk the error is taken over its own covariance: its square by degree of freedom is 1 on the mean
//! where the filter is honest, and 95 of 100 lie inside the ellipse of 95 %.

use std::fmt::Write as _;

use anyhow::Result;
use clap::Args;
use lodestep_engine::event::TrackPoint;
use lodestep_engine::geo::Site;
use lodestep_engine::session::{SessionConfig, Solution, Visit};
use lodestep_engine::sim::pedestrian::{SensorModel, Simulator, Walk, WalkKind, Walker};
use lodestep_engine::sim::white_noise;
use lodestep_engine::systems::pedestrian::{self, Side};

use super::ladder::InMemory;
use crate::cli::print::print;
use crate::cli::progress;
use crate::cli::run::run;

/// A marker is visited this often, ns,
const VISIT_NS: i64 = 60_000_000_000;
/// and stands this far beside the inspector, 1σ on each axis, m.
const BESIDE_MARKER_M: f64 = 1.0;
/// A walk is judged at so many instants.
const INSTANTS: usize = 10;
/// 95 % quantiles of χ² with two degrees of freedom and with one.
const CHI2_95: [f64; 2] = [5.991, 3.841];

/// The arguments of `lodestep evaluate worlds`.
#[derive(Debug, Args)]
pub(super) struct WorldsArgs {
    /// How many worlds, by seeds from 1 on
    #[arg(long, value_name = "N", default_value_t = 50, value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: u64,

    /// One line a world, too
    #[arg(long)]
    each: bool,
}

/// A world: what a walk is made of.
struct World {
    kind: WalkKind,
    model: SensorModel,
    walker: Walker,
}

/// Draws a world. A factor lies between a half and two, evenly in its logarithm but for the ends.
fn drawn(seed: u64) -> World {
    let mut normal = white_noise(seed ^ 0x9E37_79B9);
    let mut factor = move || (0.4 * normal()).exp().clamp(0.5, 2.0);
    let mut model = SensorModel::cmp10a();
    // A class of sensors is better or worse in all; a single one has its own share of it.
    let class = factor();
    let imu = &mut model.imu;
    for figure in [
        &mut imu.gyro_noise_deg_s_rthz,
        &mut imu.gyro_bias_deg_s,
        &mut imu.gyro_bias_walk_deg_s_rts,
        &mut imu.accel_noise_m_s2_rthz,
        &mut imu.accel_bias_m_s2,
        &mut imu.accel_bias_walk_m_s2_rts,
        &mut imu.scale,
        &mut imu.misalignment_rad,
    ] {
        *figure *= (class * factor()).clamp(0.5, 2.0);
    }
    if let Some(magnetometer) = &mut model.magnetometer {
        magnetometer.noise_ut *= factor();
        magnetometer.hard_iron_ut *= factor();
        magnetometer.soft_iron *= factor();
    }
    if let Some(barometer) = &mut model.barometer {
        barometer.noise_m *= factor();
        barometer.drift_m_rts *= factor();
    }
    model.field_anomalies.strength_ut *= factor();
    // What stands around is a manhole's cover or a hall of steel, and stands alone or close together.
    model.field_anomalies.width_m *= 2.0 * factor() * factor() * factor();
    model.field_anomalies.every_m *= 0.5 * factor() * factor();
    model.mounting_spread_deg *= 2.0 * factor();
    let usual = Walker::default();
    let pace = 1.0 + 0.25 * (factor() - 1.0);
    let walker = Walker {
        step_m: usual.step_m * pace,
        cycle_s: usual.cycle_s / pace.sqrt(),
        timing_jitter: usual.timing_jitter * factor(),
        half_separation_m: usual.half_separation_m * factor().sqrt(),
        toe_out_rad: usual.toe_out_rad * factor(),
        micro_motion: factor(),
        sole_m: 0.004 * factor(),
    };
    let kind = match seed % 5 {
        0 => WalkKind::Rectangle,
        1 => WalkKind::Block { metres: 240.0 },
        2 => WalkKind::Line { metres: 200.0 },
        3 => WalkKind::Stairs,
        _ => WalkKind::Running,
    };
    World { kind, model, walker }
}

/// What one way of being told a walk says of itself, over all worlds.
#[derive(Default)]
struct Sums {
    instants: f64,
    plan: f64,
    height: f64,
    plan_inside: f64,
    height_inside: f64,
}

impl Sums {
    fn take(&mut self, point: &TrackPoint, truth_n_m: &[f64; 3]) {
        let [e, n, u]: [f64; 3] = std::array::from_fn(|axis| point.position_n_m[axis] - truth_n_m[axis]);
        let [variance_e, variance_n, variance_u] = point.sigma_n_m.map(|sigma| sigma * sigma);
        let shared = point.covariance_en_m2;
        let determinant = variance_e * variance_n - shared * shared;
        let plan = (e * e * variance_n - 2.0 * e * n * shared + n * n * variance_e) / determinant;
        let height = u * u / variance_u;
        self.instants += 1.0;
        self.plan += plan / 2.0;
        self.height += height;
        self.plan_inside += f64::from(u8::from(plan <= CHI2_95[0]));
        self.height_inside += f64::from(u8::from(height <= CHI2_95[1]));
    }

    fn add(&mut self, other: &Sums) {
        self.instants += other.instants;
        self.plan += other.plan;
        self.height += other.height;
        self.plan_inside += other.plan_inside;
        self.height_inside += other.height_inside;
    }

    fn print(&self, name: &str, out: &mut String) {
        let mean = |sum: f64| sum / self.instants;
        writeln!(
            out,
            "| {name} | {:.2} | {:.0} % | {:.2} | {:.0} % |",
            mean(self.plan),
            100.0 * mean(self.plan_inside),
            mean(self.height),
            100.0 * mean(self.height_inside),
        )
        .expect("writing to a string cannot fail");
    }
}

/// The ways in which every world is judged.
const WAYS: [(&str, Solution, bool); 4] = [
    ("filtered", Solution::Filtered, false),
    ("smoothed", Solution::Smoothed, false),
    ("filtered, with markers", Solution::Filtered, true),
    ("smoothed, with markers", Solution::Smoothed, true),
];

/// Prints the table.
pub(super) fn worlds(args: &WorldsArgs) -> Result<()> {
    let site = Site::fast();
    let bar = progress::of_count(args.seeds * WAYS.len() as u64, "walks");
    let mut sums: [Sums; WAYS.len()] = Default::default();
    let mut each = String::new();
    for seed in 1..=args.seeds {
        let World { kind, model, walker } = drawn(seed);
        let walk = Simulator::with_walker(&kind, seed, &site, &model, walker).into_walk();
        for ((name, solution, with_markers), sums) in WAYS.iter().zip(&mut sums) {
            let own = judged(&walk, &site, seed, *solution, *with_markers)?;
            own.print(&format!("{seed}, {kind:?}, {name}"), &mut each);
            sums.add(&own);
            bar.inc(1);
        }
    }
    bar.finish_and_clear();
    let mut out = format!(
        "Drawn worlds at {}, seeds 1 to {}: the error squared over its own covariance, by degree of freedom, and the share \
         inside the ellipse of 95 %, over {INSTANTS} instants of each walk. Sensors are between half and twice as bad as \
         a CMP10A's data sheet; so are iron, anomalies and weather. Markers stand {BESIDE_MARKER_M} m (1σ on each axis) beside the \
         inspector, one a minute. Made by `lodestep evaluate worlds --seeds {}`.\n\n\
         | track | plan | inside | height | inside |\n|---|---|---|---|---|\n",
        site.name, args.seeds, args.seeds
    );
    for ((name, ..), sums) in WAYS.iter().zip(&sums) {
        sums.print(name, &mut out);
    }
    if args.each {
        out.push_str("\n| world | plan | inside | height | inside |\n|---|---|---|---|---|\n");
        out.push_str(&each);
    }
    print(&out)
}

fn middle(walk: &Walk, at: usize) -> [f64; 3] {
    let [left, right] = &walk.truth[at];
    std::array::from_fn(|axis| 0.5 * (left.position_n_m[axis] + right.position_n_m[axis]))
}

fn judged(walk: &Walk, site: &Site, seed: u64, solution: Solution, with_markers: bool) -> Result<Sums> {
    let own = pedestrian::Config::default();
    let mut normal = white_noise(seed);
    let sigma_m = own.tuning.first_position_sigma_m;
    let start_n_m = middle(walk, 0).map(|at_m| at_m + sigma_m * normal());
    let visits: Vec<Visit> = (1..)
        .map(|number| number * VISIT_NS)
        .map_while(|t_ns| {
            let at = walk.left.partition_point(|sample| sample.t_ns < t_ns);
            (with_markers && at + 1 < walk.truth.len()).then(|| {
                let [e_m, n_m, u_m] = middle(walk, at).map(|at_m| at_m + BESIDE_MARKER_M * normal());
                let marker = format!("M{}", t_ns / VISIT_NS);
                Visit { marker, t_start_ns: t_ns, t_end_ns: t_ns, position_n_m: (e_m, n_m, Some(u_m)) }
            })
        })
        .collect();
    let config = SessionConfig {
        initial_position_n_m: start_n_m,
        declination_rad: site.declination_deg.to_radians(),
        site_field: Some(site.field()),
        gravity_m_s2: site.gravity_m_s2,
        solution,
        ..own.session(&Side::BOTH)
    };
    let logs = [(Side::Left, InMemory(&walk.left)), (Side::Right, InMemory(&walk.right))];
    let told = run(config, &visits, logs)?;
    let points = &told.track.points;
    let mut sums = Sums::default();
    for instant in 1..=INSTANTS {
        let at = (walk.truth.len() - 1) * instant / INSTANTS;
        let t_ns = walk.left[at].t_ns;
        let after = points.partition_point(|point| point.t_ns < t_ns);
        if let Some(point) = points.get(after).filter(|point| point.t_ns == t_ns) {
            sums.take(point, &middle(walk, at));
        }
    }
    Ok(sums)
}
