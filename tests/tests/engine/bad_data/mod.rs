//! Sensors that break: the trouble is named with its time and foot, and no number goes astray.
//!
//! Every run goes through [`Told::check`](crate::told::Told::check): whatever comes in, what goes
//! out is finite and orderly. Each file has a list of troubles, more than a hundred and ten kinds together (and [`DAMAGES`] of files), and tests of
//! what some of them cost.

mod anything;
mod contradictions;
mod feet;
mod readings;
mod surroundings;
mod times;
mod units;

use std::collections::BTreeSet;

use lodestep_engine::anomaly::AnomalyKind;
use lodestep_engine::sample::ImuSample;
use lodestep_engine::sim::faults::{Channel, Fault};
use lodestep_engine::systems::pedestrian::Side;
use lodestep_tests::damage::DAMAGES;

use crate::scenario::{PERIOD_NS, SECOND_NS, Scenario, short_walk};
use crate::told::Told;

const NEVER: i64 = i64::MAX;

/// In the middle of the walk, ns.
const AT_NS: i64 = 25 * SECOND_NS;

/// Something that goes wrong with the sensors of a walk.
struct Trouble {
    /// What it is.
    name: &'static str,
    /// Lets it happen to the logs of the feet, left first.
    spoil: fn(&mut [Vec<ImuSample>; 2]),
    /// What it is told as.
    told: AnomalyKind,
    /// Of which foot.
    foot: Option<Side>,
}

impl Trouble {
    /// Of the right foot.
    const fn of_right(name: &'static str, told: AnomalyKind, spoil: fn(&mut [Vec<ImuSample>; 2])) -> Trouble {
        Trouble { name, spoil, told, foot: Some(Side::Right) }
    }
}

/// Changes the samples of the right foot from one time to before another, s.
fn right(logs: &mut [Vec<ImuSample>; 2], from_s: i64, to_s: i64, change: impl Fn(usize, &mut ImuSample)) {
    let within = from_s * SECOND_NS..to_s.saturating_mul(SECOND_NS);
    for (k, sample) in logs[1].iter_mut().enumerate().filter(|(_, sample)| within.contains(&sample.t_ns)) {
        change(k, sample);
    }
}

/// Lets each trouble happen to a walk of its own and checks that it is told as what it is.
#[track_caller]
fn assert_each_is_named(troubles: &[Trouble]) {
    let mut unnamed = Vec::new();
    for trouble in troubles {
        let mut scenario = short_walk().with_true_heading();
        (trouble.spoil)(&mut scenario.logs);
        let told = scenario.run();
        let named = |anomaly: &&lodestep_engine::anomaly::Anomaly| {
            anomaly.kind == trouble.told && anomaly.stream == trouble.foot.map(Side::stream)
        };
        if !told.track.anomalies.iter().any(|anomaly| named(&anomaly)) {
            let kinds: BTreeSet<_> = told.track.anomalies.iter().map(|a| (a.kind, a.stream)).collect();
            unnamed.push(format!("{}: expected {:?}, found {kinds:?}", trouble.name, trouble.told));
        }
    }
    assert!(unnamed.is_empty(), "{} troubles were not named:\n{}", unnamed.len(), unnamed.join("\n"));
}

#[test]
fn the_lists_hold_a_hundred_and_sixty_kinds_of_trouble_and_none_twice() {
    let all = [readings::TROUBLES, times::TROUBLES, feet::TROUBLES, units::TROUBLES, surroundings::TROUBLES];
    let names: BTreeSet<_> = all.iter().flat_map(|list| list.iter()).map(|trouble| trouble.name).collect();
    assert_eq!(names.len(), all.iter().map(|list| list.len()).sum::<usize>(), "one is there twice");
    let contradictions: BTreeSet<String> =
        contradictions::NAMED.iter().map(|(name, by, _)| name.replace("{}", &by.to_string())).collect();
    assert_eq!(contradictions.len(), contradictions::NAMED.len(), "one is there twice");
    // What happens to files has its tests beside these lists, in `damaged_files`.
    let damages: BTreeSet<_> = DAMAGES.iter().map(|damage| damage.name).collect();
    assert_eq!(damages.len(), DAMAGES.len(), "one is there twice");
    let kinds = names.len() + contradictions.len() + damages.len();
    assert!(kinds >= 160, "{kinds} kinds of trouble");
}

#[test]
fn a_walk_without_trouble_has_nothing_to_tell() {
    let told = short_walk().with_true_heading().run();
    assert!(told.track.anomalies.is_empty(), "{:?}", told.track.anomalies);
}

/// Lets a fault happen to the right foot; checks that it is told as `kind`, on that foot, at its time
/// give or take a second, and no other trouble of the sensor; gives the run for more.
#[track_caller]
fn assert_named(fault: Fault, kind: AnomalyKind, from_ns: i64) -> (Scenario, Told) {
    let scenario = short_walk().with_true_heading().with_fault(Side::Right, &fault);
    let told = scenario.run();
    let found = told.anomalies(kind, Side::Right);
    assert!(!found.is_empty(), "{fault:?} was not told: {:?}", told.track.anomalies);
    let near = (from_ns - SECOND_NS)..=(from_ns + SECOND_NS);
    assert!(near.contains(&found[0].t_start_ns), "{:?}", found[0]);
    let left: Vec<_> =
        told.track.anomalies.iter().filter(|anomaly| anomaly.stream == Some(Side::Left.stream())).collect();
    assert!(left.is_empty(), "the left foot is well: {left:?}");
    (scenario, told)
}

#[track_caller]
fn assert_end_within(scenario: &Scenario, told: &Told, metres: f64) {
    let errors = told.errors(scenario);
    assert!(errors.end_error_m <= metres, "{errors:?}");
}
