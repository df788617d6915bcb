//! Visits: keyed in before, in time, late and too late; wrong; without a height; and stands that the engine names.

use std::rc::Rc;
use std::sync::Arc;

use lodestep_engine::geo::{Site, terrain};
use lodestep_engine::identify::{Identification, Marker};
use lodestep_engine::session::Solution;
use lodestep_engine::sim::pedestrian::{SensorModel, WalkKind};
use lodestep_engine::systems::pedestrian::Side;

use crate::Case;
use crate::walk::{Make, SECOND_NS, SOLUTIONS, Walk};

fn rectangle() -> Walk {
    Walk::simulated(WalkKind::Rectangle, 12, &SensorModel::cmp10a(), 180)
}

pub(crate) fn cases() -> Vec<Case> {
    let ways: [(&str, Make); 8] = [
        ("known_before", || {
            rectangle().with_visit(60, [1.0, -0.5], true, -100).with_visit(120, [-0.8, 0.3], true, -200)
        }),
        ("in_time", || {
            rectangle().with_visit(60, [1.0, -0.5], true, 1).with_visit(120, [-0.8, 0.3], true, 0)
        }),
        ("seven_seconds_late", || {
            rectangle().with_visit(60, [1.0, -0.5], true, 7).with_visit(120, [-0.8, 0.3], true, 7)
        }),
        ("late_and_out_of_order", || {
            rectangle().with_visit(60, [1.0, -0.5], true, 25).with_visit(70, [0.4, 0.6], true, 10)
        }),
        ("too_late", || rectangle().with_visit(60, [1.0, -0.5], true, 70)),
        ("after_the_end", || rectangle().with_visit(170, [1.0, -0.5], true, 100)),
        ("without_a_height", || {
            rectangle().with_visit(60, [1.0, -0.5], false, 12).with_visit(120, [-0.8, 0.3], false, 1)
        }),
        ("elsewhere", || {
            rectangle().with_visit(60, [40.0, 0.0], true, 9).with_visit(120, [0.0, -60.0], false, 1)
        }),
    ];
    let mut cases = Vec::new();
    for (name, walk) in ways {
        let walk = Rc::new(walk());
        for (solution_name, solution) in SOLUTIONS {
            let walk = Rc::clone(&walk);
            cases.push(Case::new(format!("visits/{name}/{solution_name}"), move || {
                Walk::clone(&walk).with_solution(solution).run()
            }));
        }
    }
    for (solution_name, solution) in SOLUTIONS {
        cases.push(Case::new(format!("visits/of_one_foot/{solution_name}"), move || {
            let walk = rectangle().with_visit(60, [1.0, -0.5], true, 15).with_visit(120, [0.2, 0.2], true, 1);
            walk.with_one_foot(Side::Right).with_solution(solution).run()
        }));
    }
    cases
}

fn identification() -> Identification {
    let markers = terrain::anchors(&Site::fast()).into_iter().map(|anchor| {
        let [e_m, n_m, u_m] = anchor.position_n_m;
        Marker { name: anchor.name, position_n_m: (e_m, n_m, Some(u_m)) }
    });
    let markers = Arc::new(markers.collect::<Vec<_>>().into());
    Identification { markers, ..Identification::default() }
}

/// A spiral with as many visits keyed in as are asked for.
fn spiral(keyed: usize, identification: Identification) -> Walk {
    let mut walk = Walk::simulated(WalkKind::Spiral, 1, &SensorModel::cmp10a(), 420);
    walk.visits.truncate(keyed);
    walk.with(|config| config.identification = Some(identification))
}

pub(crate) fn stands() -> Vec<Case> {
    let automatic = || Identification { automatic: true, ..identification() };
    let mut cases = vec![
        Case::new("stands/named_only/filtered".to_owned(), || spiral(0, identification()).run()),
        Case::new("stands/all_keyed_in/filtered".to_owned(), || spiral(9, identification()).run()),
        Case::new("stands/one_keyed_in_late/trail".to_owned(), || {
            let mut walk = spiral(1, identification());
            walk.visits[0].at_ns += 13 * SECOND_NS;
            walk.with_solution(Solution::Trail).run()
        }),
        Case::new("stands/one_undone/trail".to_owned(), move || {
            let first = Walk::simulated(WalkKind::Spiral, 1, &SensorModel::cmp10a(), 420).visits.remove(0);
            let undone_ns = vec![first.visit.t_start_ns];
            let walk = spiral(0, Identification { undone_ns, ..automatic() });
            walk.with_solution(Solution::Trail).run()
        }),
        Case::new("stands/automatic_of_an_earlier_run/smoothed".to_owned(), || {
            let walk = Walk::simulated(WalkKind::Spiral, 1, &SensorModel::cmp10a(), 420);
            let automatic_visits = walk.visits.iter().take(2).map(|keyed| keyed.visit.clone()).collect();
            let walk = spiral(0, Identification { automatic_visits, ..identification() });
            walk.with_solution(Solution::Smoothed).run()
        }),
    ];
    for (solution_name, solution) in SOLUTIONS {
        cases.push(Case::new(format!("stands/automatic/{solution_name}"), move || {
            spiral(0, automatic()).with_solution(solution).run()
        }));
    }
    cases
}
