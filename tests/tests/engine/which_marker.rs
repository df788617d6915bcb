//! Which marker is it? Given: a spiral, all of FAST's anchors, and inspectors who key in everything or
//! nothing. `lodestep evaluate markers` has the figures over many walks.

use std::sync::Arc;

use lodestep_engine::evaluate::MarkerScore;
use lodestep_engine::event::{Event, Stand};
use lodestep_engine::geo::{Site, terrain};
use lodestep_engine::identify::{Identification, IdentificationTuning, Marker, automatic_visits};
use lodestep_engine::session::Session;
use lodestep_engine::sim::pedestrian::{SensorModel, WalkKind};

use crate::scenario::{SECOND_NS, Scenario};

pub(crate) fn identification() -> Identification {
    let anchors = terrain::anchors(&Site::fast()).into_iter();
    let markers = anchors.map(|anchor| {
        let [e, n, u] = anchor.position_n_m;
        Marker { name: anchor.name, position_n_m: (e, n, Some(u)) }
    });
    Identification { markers: Arc::new(markers.collect::<Vec<_>>().into()), ..Identification::default() }
}

/// What a run told.
#[derive(Default)]
struct Told {
    first: Vec<Stand>,
    last: Vec<Stand>,
    events: Vec<Event>,
}

impl Told {
    fn take(&mut self, events: &mut Vec<Event>) {
        for event in events.drain(..) {
            if let Event::Stand(stand) = &event {
                match self.last.iter_mut().find(|known| known.number == stand.number) {
                    Some(known) => *known = stand.clone(),
                    None => {
                        self.first.push(stand.clone());
                        self.last.push(stand.clone());
                    }
                }
            }
            self.events.push(event);
        }
    }

    fn score(stands: &[Stand], scenario: &Scenario) -> MarkerScore {
        let mut score = MarkerScore::default();
        stands.iter().for_each(|stand| score.take(stand, truth(scenario, stand)));
        score
    }
}

fn truth<'a>(scenario: &'a Scenario, stand: &Stand) -> Option<&'a str> {
    let stood = scenario.visits.iter().find(|visit| {
        visit.t_start_ns < stand.t_start_ns + 4 * SECOND_NS && visit.t_end_ns > stand.t_start_ns
    });
    stood.map(|visit| visit.marker.as_str())
}

/// Runs the walk; visits are keyed in when they are over, or not at all.
fn run(scenario: &Scenario, identification: Identification, keyed: bool) -> Told {
    let mut config = scenario.config.clone();
    config.identification = Some(identification);
    let (mut session, mut events, mut told) = (Session::new(config).unwrap(), Vec::new(), Told::default());
    let mut visits = scenario.visits.iter().filter(|_| keyed).peekable();
    for (foot, sample) in scenario.merge_by_time() {
        if let Some(visit) = visits.next_if(|visit| visit.t_end_ns < sample.t_ns) {
            session.visit(visit.clone(), &mut events);
        }
        session.push(foot, &sample, &mut events);
        told.take(&mut events);
    }
    session.finish(&mut events);
    told.take(&mut events);
    told
}

fn spiral(kind: WalkKind, seed: u64, seconds: f64) -> Scenario {
    Scenario::beginning(kind, seed, &SensorModel::cmp10a(), seconds)
}

#[test]
fn the_right_marker_is_first_where_earlier_ones_were_keyed_in() {
    let mut score = MarkerScore::default();
    for seed in [1, 2] {
        let scenario = spiral(WalkKind::Spiral, seed, 1500.0);
        let told = run(&scenario, identification(), true);
        assert_eq!(told.first.len(), scenario.visits.len(), "every stop is a stand, and nothing else is");
        for stand in &told.last {
            let sum: f64 = stand.candidates.iter().map(|candidate| candidate.probability).sum();
            assert!((sum - 1.0).abs() < 1e-9, "{stand:?}");
            let visit = stand.visit.as_ref().expect("it was keyed in");
            assert!(!visit.automatic && Some(visit.marker.as_str()) == truth(&scenario, stand), "{stand:?}");
        }
        score.add(&Told::score(&told.first, &scenario));
    }
    assert!(score.right_first_percent() >= 90.0, "{score:?}");
}

#[test]
fn without_a_single_key_the_whole_walk_is_named_and_automatic_mode_takes_what_is_nearly_certain() {
    let scenario = spiral(WalkKind::Spiral, 1, 2700.0);
    let automatic = Identification { automatic: true, ..identification() };
    let told = run(&scenario, automatic.clone(), false);
    let (live, later) = (Told::score(&told.first, &scenario), Told::score(&told.last, &scenario));
    assert!(live.right_first_percent() >= 90.0, "{live:?}");
    assert!(later.right_first_percent() >= 97.0, "{later:?}");
    assert!(later.automatic >= 5 && later.automatic_wrong == 0, "{later:?}");
    for stand in told.first.iter().filter(|stand| stand.candidates[0].probability < 0.99) {
        assert_eq!(
            told.last[stand.number as usize - 1].visit,
            None,
            "it was in doubt when it was told: {stand:?}"
        );
    }
    assert!(automatic_visits(&told.last, &automatic).len() as u64 >= later.automatic);
    let used =
        told.events.iter().filter(|event| matches!(event, Event::Visit(visit) if visit.accepted)).count();
    assert_eq!(used as u64, later.automatic, "what was taken has corrected the track");
}

#[test]
fn an_automatic_visit_that_is_undone_leaves_the_very_track_of_a_session_without_it() {
    let scenario = spiral(WalkKind::Spiral, 1, 300.0);
    // Two stops into a walk nothing is as certain as is usually asked for.
    let tuning = IdentificationTuning { automatic_probability: 0.95, ..IdentificationTuning::default() };
    let automatic = Identification { automatic: true, tuning, ..identification() };
    let told = run(&scenario, automatic.clone(), false);
    assert!(told.last.iter().any(|stand| stand.visit.is_some()), "{:?}", told.last);
    let undone_ns = told.last.iter().map(|stand| stand.t_start_ns).collect();
    let undone = run(&scenario, Identification { undone_ns, ..automatic }, false);
    assert!(undone.last.iter().all(|stand| stand.visit.is_none()), "nothing is taken again");
    let never = run(&scenario, identification(), false);
    assert!(points(&undone) == points(&never), "bit by bit");
    assert!(points(&told) != points(&never));
}

/// All that was told but the stands, which do not belong to the track.
fn points(told: &Told) -> Vec<&Event> {
    told.events.iter().filter(|event| !matches!(event, Event::Stand(_))).collect()
}

#[test]
fn a_stop_away_from_every_actuator_gets_a_share_of_none_of_them() {
    let scenario = spiral(WalkKind::SpiralWithPauses, 1, 2000.0);
    let told = run(&scenario, identification(), true);
    let none = |stand: &Stand| stand.candidates.last().expect("candidates").probability;
    let mean = |at_marker: bool| {
        let of: Vec<f64> = told
            .last
            .iter()
            .filter(|stand| truth(&scenario, stand).is_some() == at_marker)
            .map(none)
            .collect();
        assert!(of.len() >= 4, "{}", of.len());
        of.iter().sum::<f64>() / of.len() as f64
    };
    assert!(mean(false) > 0.5 && mean(true) < 0.1, "{} {}", mean(false), mean(true));
}

#[test]
fn without_a_marker_database_nothing_is_told_of_stands_and_the_track_is_the_same() {
    let scenario = spiral(WalkKind::Spiral, 1, 150.0);
    let with = run(&scenario, identification(), false);
    let mut session = Session::new(scenario.config.clone()).unwrap();
    let (mut events, mut without) = (Vec::new(), Told::default());
    for (foot, sample) in scenario.merge_by_time() {
        session.push(foot, &sample, &mut events);
        without.take(&mut events);
    }
    session.finish(&mut events);
    without.take(&mut events);
    assert_eq!(with.last.len(), 1);
    assert!(without.last.is_empty());
    assert!(points(&with) == points(&without), "bit by bit");
}
