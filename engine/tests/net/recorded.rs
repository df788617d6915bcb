//! Recorded walks, all with the defaults.

use std::rc::Rc;

use lodestep_engine::systems::pedestrian::Side;

use crate::Case;
use crate::walk::{PackedLog, SOLUTIONS, Walk};

macro_rules! recording {
    ($file:literal) => {
        include_bytes!(concat!("../../../tests/data/", $file)).as_slice()
    };
}

pub(crate) fn cases() -> Vec<Case> {
    let stairs = [
        (Side::Left, recording!("gaitmap-feet/stair_up.left.csv.gz")),
        (Side::Right, recording!("gaitmap-feet/stair_up.right.csv.gz")),
    ];
    let walks: [(&str, &[PackedLog]); 6] = [
        ("openshoe_02", &[(Side::Right, recording!("openshoe-gx2/loop_02.csv.gz"))]),
        ("openshoe_31", &[(Side::Right, recording!("openshoe-gx2/loop_31.csv.gz"))]),
        ("pyshoe", &[(Side::Right, recording!("pyshoe-vicon/2017-11-22-11-25-20.csv.gz"))]),
        ("gaitmap", &stairs),
        ("gaitmap_left", &stairs[..1]),
        ("gaitmap_right", &stairs[1..]),
    ];
    let mut cases = Vec::new();
    for (name, logs) in walks {
        let walk = Rc::new(Walk::recorded(logs));
        for (solution_name, solution) in SOLUTIONS {
            let walk = Rc::clone(&walk);
            cases.push(Case::new(format!("recorded/{name}/{solution_name}"), move || {
                Walk::clone(&walk).with_solution(solution).run()
            }));
        }
    }
    cases
}
