//! Simulated walks of every kind of the catalogue, and the logs and truths they are made of.

use std::rc::Rc;

use lodestep_engine::sim::pedestrian::{SensorModel, WalkKind};
use lodestep_engine::systems::pedestrian::Side;

use crate::Case;
use crate::fold::{Bits, side};
use crate::walk::{SOLUTIONS, Walk, with_imu};

/// The kinds, and how many seconds of each are walked.
const KINDS: [(&str, WalkKind, i64); 10] = [
    ("line", WalkKind::Line { metres: 60.0 }, 100),
    ("rectangle", WalkKind::Rectangle, 240),
    ("spiral", WalkKind::Spiral, 280),
    ("spiral_with_pauses", WalkKind::SpiralWithPauses, 200),
    ("stairs", WalkKind::Stairs, 150),
    ("running", WalkKind::Running, 240),
    ("slow", WalkKind::Slow { metres: 20.0 }, 100),
    ("run", WalkKind::Run { metres: 60.0 }, 100),
    ("crawl", WalkKind::Crawl { metres: 10.0 }, 100),
    ("standing", WalkKind::Standing { seconds: 40.0 }, 100),
];

/// Seeds are counted along the list.
fn walks() -> impl Iterator<Item = (&'static str, Walk)> {
    (1..).zip(KINDS).map(|(seed, (name, kind, seconds))| {
        (name, Walk::simulated(kind, seed, &SensorModel::cmp10a(), seconds))
    })
}

pub(crate) fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for (name, walk) in walks() {
        let walk = Rc::new(walk);
        for (solution_name, solution) in SOLUTIONS {
            let walk = Rc::clone(&walk);
            cases.push(Case::new(format!("simulated/{name}/{solution_name}"), move || {
                Walk::clone(&walk).with_solution(solution).run()
            }));
        }
    }
    for foot in Side::BOTH {
        for (solution_name, solution) in SOLUTIONS {
            let name = format!("simulated/{}_alone/{solution_name}", side(foot));
            cases.push(Case::new(name, move || {
                let walk = Walk::simulated(WalkKind::Rectangle, 11, &SensorModel::cmp10a(), 100);
                walk.with_one_foot(foot).with_solution(solution).run()
            }));
        }
    }
    cases
}

/// The same walks as the simulator makes them, and some by other sensors.
pub(crate) fn logs() -> Vec<Case> {
    let mut walks: Vec<(&str, Walk)> = walks().collect();
    let line = WalkKind::Line { metres: 10.0 };
    let averaging = with_imu(|imu| (imu.averaging, imu.rate_hz) = (false, 250.0));
    let inertial = SensorModel { magnetometer: None, barometer: None, ..SensorModel::cmp10a() };
    for (name, model) in
        [("perfect", SensorModel::perfect()), ("sampling", averaging), ("inertial", inertial)]
    {
        walks.push((name, Walk::simulated(line, 1, &model, 100)));
    }
    walks
        .into_iter()
        .map(|(name, walk)| {
            Case::hashed(format!("simulator/{name}"), move || {
                let (mut samples, mut truth) = (Bits::default(), Bits::default());
                for (foot, sample) in &walk.samples {
                    samples.text(side(*foot));
                    samples.time(sample.t_ns);
                    samples.numbers(&sample.w_ib_b_rad_s);
                    samples.numbers(&sample.f_b_m_s2);
                    samples.flag(sample.mag_b_ut.is_some());
                    samples.numbers(&sample.mag_b_ut.unwrap_or_default());
                    samples.option(sample.pressure_hpa);
                }
                for foot in walk.truth.iter().flatten() {
                    truth.numbers(&foot.position_n_m);
                    truth.numbers(&foot.velocity_n_m_s);
                    truth.numbers(foot.q_nb.coords.as_slice());
                    truth.numbers(&[foot.heading_rad]);
                    truth.flag(foot.stance);
                }
                for keyed in &walk.visits {
                    let (e_m, n_m, u_m) = keyed.visit.position_n_m;
                    truth.text(&keyed.visit.marker);
                    truth.time(keyed.visit.t_start_ns);
                    truth.time(keyed.visit.t_end_ns);
                    truth.numbers(&[e_m, n_m]);
                    truth.option(u_m);
                }
                vec![("samples", samples.sha256()), ("truth", truth.sha256())]
            })
        })
        .collect()
}
