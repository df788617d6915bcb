//! Logs whose files were damaged, one kind at a time and several at once: what is readable is read, what was done is told, and
//! no track is wrong without a word. `cargo run -p lodestep-tests --example damaged_files -- 1000` draws more of them.

use lodestep_engine::sim::pedestrian::{SensorModel, WalkKind};
use lodestep_engine::systems::pedestrian::Side;
use lodestep_tests::damage::{DAMAGES, Draw, LogText};

use crate::scenario::{Scenario, short_walk};

/// A row beside one that is damaged may go with it.
const SPARED: usize = 3;

#[test]
fn every_kind_of_damage_is_told_and_costs_only_what_it_damaged() {
    let log = LogText::of(&short_walk().logs[0]);
    let (whole, nothing) = log.read().unwrap();
    assert!(whole.len() == log.lines.len() && nothing.is_empty());
    for damage in DAMAGES {
        for seed in 0..4 {
            let mut harmed = log.clone();
            (damage.harm)(&mut harmed, &mut Draw::new(seed));
            let rows = harmed.lines.len();
            let (read, told) = harmed.read().unwrap_or_else(|error| panic!("{}: {error}", damage.name));
            assert!(
                read.len() + harmed.lost + SPARED >= rows,
                "{} {seed}: {} of {rows}",
                damage.name,
                read.len()
            );
            assert!(!damage.told || !told.is_empty(), "{} {seed} was not told", damage.name);
        }
    }
}

#[test]
fn mixtures_of_damage_lose_nothing_and_deny_nothing() {
    const WALKS: u64 = 12;
    let mut denied = Vec::new();
    for seed in 0..WALKS {
        let mut draw = Draw::new(seed);
        let scenario = Scenario::simulated(WalkKind::Line { metres: 25.0 }, seed, &SensorModel::cmp10a());
        let mut harmed = LogText::of(&scenario.logs[0]);
        let kinds: Vec<&str> = (0..1 + draw.below(3))
            .map(|_| {
                let damage = &DAMAGES[draw.below(DAMAGES.len())];
                (damage.harm)(&mut harmed, &mut draw);
                damage.name
            })
            .collect();
        // What asks for the rate, or is garbage for the most part, is refused in a sentence.
        let Ok((read, told)) = harmed.read() else { continue };
        let mut walked = scenario.with_one_foot(Side::Left).with_true_heading();
        walked.logs[0] = read;
        let run = walked.run();
        let end = run.last();
        let truth = walked.truth.last().unwrap()[0].position_n_m;
        let off_m = (end.position_n_m[0] - truth[0]).hypot(end.position_n_m[1] - truth[1]);
        let sigma_m = end.sigma_n_m[0].hypot(end.sigma_n_m[1]);
        if off_m > 5.0 * sigma_m && told.is_empty() && run.track.anomalies.is_empty() {
            denied.push(format!("{seed} {kinds:?}: {off_m:.2} m, sigma {sigma_m:.2} m"));
        }
    }
    assert!(denied.is_empty(), "{denied:?}");
}
