//! The same walk with other settings: aids, headings, places, tuning, sensors.

use lodestep_engine::event::AidKind;
use lodestep_engine::session::Solution;
use lodestep_engine::sim::pedestrian::{SensorModel, WalkKind};
use lodestep_engine::systems::pedestrian::Side;
use lodestep_engine::systems::pedestrian::{Aids, Config, aids};

use crate::Case;
use crate::fold::side;
use crate::walk::{Make, Walk, with_imu};

fn line(model: &SensorModel) -> Walk {
    Walk::simulated(WalkKind::Line { metres: 40.0 }, 16, model, 100).with_visit(35, [0.4, -0.6], true, 8)
}

fn usual() -> Walk {
    line(&SensorModel::cmp10a())
}

pub(crate) fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    let all = Aids::default().kinds();
    for (number, kind) in all.iter().enumerate() {
        let others: Vec<AidKind> = all.iter().copied().filter(|other| other != kind).collect();
        cases.push(Case::new(format!("ways/without_aid_{number}"), move || {
            usual().with(|config| Config::of_mut(config).aids = Aids::only(&others)).run()
        }));
        let only = [aids::ZUPT, *kind];
        cases.push(Case::new(format!("ways/zupt_and_aid_{number}"), move || {
            usual()
                .with(|config| Config::of_mut(config).aids = Aids::only(&only))
                .with_solution(Solution::Smoothed)
                .run()
        }));
    }
    for foot in Side::BOTH {
        cases.push(Case::new(format!("ways/{}_without_aids", side(foot)), move || {
            usual().with_one_foot(foot).with(|config| Config::of_mut(config).aids = Aids::only(&[])).run()
        }));
    }
    let settings: [(&str, Make); 7] = [
        ("given_heading", || {
            let walk = usual();
            let heading_rad = walk.truth[0][0].heading_rad;
            walk.with(|config| config.initial_heading_rad = Some(heading_rad))
        }),
        ("elsewhere", || usual().with(|config| config.initial_position_n_m = [1234.5, -678.9, 45.6])),
        ("other_site", || {
            usual().with(|config| {
                config.declination_rad = 0.1;
                config.gravity_m_s2 = 9.82;
            })
        }),
        ("other_tuning", || {
            usual().with(|config| {
                Config::of_mut(config).tuning.zupt_sigma_m_s = 0.03;
                Config::of_mut(config).tuning.roll_radius_m = 0.05;
                Config::of_mut(config).tuning.history_s = 6.0;
                Config::of_mut(config).tuning.longest_alignment_s = 3.0;
            })
        }),
        ("perfect_sensors", || line(&SensorModel::perfect())),
        ("faster_sensors", || line(&with_imu(|imu| imu.rate_hz = 200.0))),
        ("sampling_sensors", || line(&with_imu(|imu| imu.averaging = false))),
    ];
    for (name, walk) in settings {
        cases.push(Case::new(format!("ways/{name}/trail"), move || {
            walk().with_solution(Solution::Trail).run()
        }));
    }
    cases
}
