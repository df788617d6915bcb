//! Sensors and logs with faults.

use lodestep_engine::session::Solution;
use lodestep_engine::sim::faults::{Channel, Fault};
use lodestep_engine::sim::pedestrian::{SensorModel, WalkKind};
use lodestep_engine::systems::pedestrian::Side;

use crate::Case;
use crate::walk::{SECOND_NS, SOLUTIONS, Walk};

const FROM_NS: i64 = 25 * SECOND_NS;
const TO_NS: i64 = 27 * SECOND_NS;

/// A line of 40 m with a visit that is keyed in late.
fn line() -> Walk {
    Walk::simulated(WalkKind::Line { metres: 40.0 }, 15, &SensorModel::cmp10a(), 100).with_visit(
        35,
        [0.4, -0.6],
        true,
        8,
    )
}

const fn value(channel: Channel, axis: usize, value: f64) -> Fault {
    Fault::Value { channel, axis, value, from_ns: FROM_NS, to_ns: TO_NS }
}

const FAULTS: [(&str, Fault); 22] = [
    ("clock_fast", Fault::Clock { ppm: 80.0, offset_ns: 3_000_000 }),
    ("gap_of_150_ms", Fault::Dropout { from_ns: FROM_NS, to_ns: FROM_NS + 150_000_000 }),
    ("gap_of_400_ms", Fault::Dropout { from_ns: FROM_NS, to_ns: FROM_NS + 400_000_000 }),
    ("gap_of_5_s", Fault::Dropout { from_ns: FROM_NS, to_ns: FROM_NS + 5 * SECOND_NS }),
    ("gap_in_the_standing_start", Fault::Dropout { from_ns: 5 * SECOND_NS, to_ns: 6 * SECOND_NS }),
    ("lost_samples", Fault::LostSamples { share: 0.05 }),
    ("gyros_saturate", Fault::Saturation { channel: Channel::Gyro, limit: 4.0 }),
    ("accelerometers_saturate", Fault::Saturation { channel: Channel::Accel, limit: 20.0 }),
    ("gyro_stuck", Fault::StuckAxis { channel: Channel::Gyro, axis: 1, from_ns: FROM_NS, to_ns: TO_NS }),
    ("accel_stuck", Fault::StuckAxis { channel: Channel::Accel, axis: 2, from_ns: FROM_NS, to_ns: TO_NS }),
    ("gyro_nan", value(Channel::Gyro, 0, f64::NAN)),
    ("accel_infinite", value(Channel::Accel, 1, f64::INFINITY)),
    ("mag_nan", value(Channel::Mag, 2, f64::NAN)),
    ("gyro_huge", value(Channel::Gyro, 2, 300.0)),
    ("accel_huge", value(Channel::Accel, 0, 1e30)),
    (
        "iron_nearby",
        Fault::Offset {
            channel: Channel::Mag,
            by: [20.0, -15.0, 8.0],
            from_ns: FROM_NS,
            to_ns: FROM_NS + 8 * SECOND_NS,
        },
    ),
    (
        "gyro_bias_jumps",
        Fault::Offset { channel: Channel::Gyro, by: [0.02, -0.01, 0.03], from_ns: FROM_NS, to_ns: i64::MAX },
    ),
    (
        "wrong_gravity",
        Fault::Offset { channel: Channel::Accel, by: [0.0, 0.0, 5.0], from_ns: 0, to_ns: i64::MAX },
    ),
    ("repeated_times", Fault::RepeatedTime { from_ns: FROM_NS, every: 7 }),
    ("backward_time", Fault::BackwardTime { at_ns: FROM_NS, by_ns: 3 * SECOND_NS }),
    ("turns_on_the_foot", Fault::HalfTurn { at_ns: FROM_NS }),
    ("inertial_only", Fault::InertialOnly),
];

pub(crate) fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for (name, fault) in FAULTS {
        for (solution_name, solution) in SOLUTIONS {
            cases.push(Case::new(format!("broken/{name}/{solution_name}"), move || {
                line().with_fault(Side::Right, &fault).with_solution(solution).run()
            }));
        }
        cases.push(Case::new(format!("broken/{name}/left_alone"), move || {
            line().with_fault(Side::Left, &fault).with_one_foot(Side::Left).run()
        }));
    }
    for (solution_name, solution) in SOLUTIONS {
        cases.push(Case::new(format!("broken/both_inertial_only/{solution_name}"), move || {
            let walk = line().with_fault(Side::Left, &Fault::InertialOnly);
            walk.with_fault(Side::Right, &Fault::InertialOnly).with_solution(solution).run()
        }));
        cases.push(Case::new(format!("broken/gaps_of_both/{solution_name}"), move || {
            let gap = Fault::Dropout { from_ns: FROM_NS, to_ns: FROM_NS + 2 * SECOND_NS };
            line().with_fault(Side::Left, &gap).with_fault(Side::Right, &gap).with_solution(solution).run()
        }));
    }
    cases.push(Case::new("broken/no_standing_start/trail".to_owned(), || {
        let begins_walking = Fault::Dropout { from_ns: 0, to_ns: 15 * SECOND_NS };
        let walk = line().with_fault(Side::Left, &begins_walking).with_fault(Side::Right, &begins_walking);
        walk.with_solution(Solution::Trail).run()
    }));
    cases
}
