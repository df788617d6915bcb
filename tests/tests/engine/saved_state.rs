//! A server that starts again takes up a saved state in place of the whole walk. Given: walks with automatic and with late
//! visits, cut at moments counted over the walk; what is told after the cut is what an uncut walk tells, to the bit.

use std::collections::BTreeMap;

use lodestep_engine::event::Event;
use lodestep_engine::identify::Identification;
use lodestep_engine::sample::ImuSample;
use lodestep_engine::session::{SavedState, Session, SessionConfig, Solution, Visit};
use lodestep_engine::sim::pedestrian::{SensorModel, WalkKind};
use lodestep_engine::systems::pedestrian::{self, Side};

use crate::scenario::{SECOND_NS, Scenario};
use crate::which_marker::identification;

/// A state is saved at the end of what comes together.
const TOGETHER: usize = 40;
/// So much after a cut is compared, samples.
const AFTER: usize = 200 * 180;

/// A live walk, and what is keyed in before its samples of these numbers.
struct Live {
    config: SessionConfig,
    samples: Vec<(Side, ImuSample)>,
    keyed: Vec<(usize, Visit)>,
}

/// What was told in the end: points by their time, and all else in order.
#[derive(Clone, Debug, Default, PartialEq)]
struct Told {
    points: BTreeMap<i64, String>,
    else_told: Vec<String>,
}

impl Told {
    fn take(&mut self, events: &mut Vec<Event>) {
        for event in events.drain(..) {
            match event {
                Event::Point(point) => drop(self.points.insert(point.t_ns, format!("{point:?}"))),
                Event::Revision { points } => {
                    self.points.extend(points.iter().map(|point| (point.t_ns, format!("{point:?}"))));
                }
                other => self.else_told.push(format!("{other:?}")),
            }
        }
    }
}

impl Live {
    fn new(scenario: &Scenario, identification: Option<Identification>) -> Live {
        Live {
            config: SessionConfig {
                solution: Solution::Trail,
                max_lead_ns: Some(SECOND_NS),
                identification,
                ..scenario.config.clone()
            },
            samples: scenario.merge_by_time(),
            keyed: Vec::new(),
        }
    }

    /// Goes on over these samples with the visits among them; `each` sees the session after what comes together.
    fn go_on(
        &self,
        session: &mut Session,
        range: std::ops::Range<usize>,
        mut each: impl FnMut(usize, &mut Session, &mut Vec<Event>),
    ) {
        let mut events = Vec::new();
        for number in range {
            for (_, visit) in self.keyed.iter().filter(|(before, _)| *before == number) {
                session.visit(visit.clone(), &mut events);
            }
            let (foot, sample) = &self.samples[number];
            session.push(*foot, sample, &mut events);
            if (number + 1).is_multiple_of(TOGETHER) {
                each(number + 1, session, &mut events);
            }
        }
        each(usize::MAX, session, &mut events);
    }

    /// The walk as it was at the cut, by a saved state; and how many of them did not reach back far enough.
    fn restored(&self, saved: &[(usize, SavedState)], cut: usize) -> (Option<Session>, usize) {
        let Some(newest) = saved.iter().rfind(|(after, _)| *after <= cut) else { return (None, 0) };
        let enough = newest.1.t_ns - Session::LOOKS_BACK_NS;
        let mut tried = 0;
        for (after, state) in saved.iter().rev().filter(|(_, state)| state.t_ns < enough) {
            let session = Session::restored(self.config.clone(), &state.bytes, None);
            let mut session = session.expect("its own state");
            self.go_on(&mut session, *after..cut, |_, _, events| events.clear());
            if !session.lacks_past() {
                return (Some(session), tried);
            }
            tried += 1;
        }
        (None, tried)
    }
}

/// Which of two states of the same moment is there at the cut.
#[derive(Clone, Copy, PartialEq)]
enum Kept {
    /// The newer one, as it should be.
    Newer,
    /// The one from before a visit that went back to before it: the other could not be saved.
    Older,
}

/// Cuts a walk at so many moments; says how many were taken up, and how many states did not reach back far enough.
fn assert_goes_on_as_if_uncut(live: &Live, cuts: usize, kept: Kept) -> (usize, usize) {
    let mut saved: Vec<(usize, SavedState)> = Vec::new();
    let step = live.samples.len() / (cuts + 1) / TOGETHER * TOGETHER;
    let cuts: Vec<usize> = (1..=cuts).map(|number| number * step).collect();
    // What an uncut walk has told at each cut, and a while after it.
    let (mut told, mut at) = (Told::default(), BTreeMap::new());
    live.go_on(
        &mut Session::new(live.config.clone()).unwrap(),
        0..live.samples.len(),
        |after, session, events| {
            told.take(events);
            if let Some(state) = session.state_to_save() {
                assert!(state.bytes.len() < 400_000, "{} bytes", state.bytes.len());
                let known = saved.iter().position(|(_, older)| older.t_ns >= state.t_ns);
                if known.is_none() || kept == Kept::Newer {
                    saved.truncate(known.unwrap_or(saved.len()));
                    saved.push((after, state));
                }
            }
            if cuts.iter().any(|cut| after == *cut || after == cut + AFTER) {
                at.insert(after, told.clone());
            }
        },
    );
    let (mut taken_up, mut not_enough) = (0, 0);
    for cut in cuts {
        let (session, tried) = live.restored(&saved, cut);
        not_enough += tried;
        let (Some(mut session), Some(expected)) = (session, at.get(&(cut + AFTER))) else { continue };
        let mut told = at[&cut].clone();
        live.go_on(&mut session, cut..cut + AFTER, |_, _, events| told.take(events));
        let differs = told.points.iter().find(|(t_ns, point)| expected.points.get(t_ns) != Some(point));
        assert_eq!(differs.map(|(t_ns, _)| t_ns), None, "cut after sample {cut}");
        assert!(told == *expected, "cut after sample {cut}");
        taken_up += 1;
    }
    (taken_up, not_enough)
}

#[test]
fn a_walk_with_automatic_visits_goes_on_to_the_bit() {
    let scenario = Scenario::beginning(WalkKind::Spiral, 1, &SensorModel::cmp10a(), 1500.0);
    let automatic = Identification { automatic: true, ..identification() };
    let live = Live::new(&scenario, Some(automatic));
    assert_eq!(assert_goes_on_as_if_uncut(&live, 4, Kept::Newer), (3, 0));
}

#[test]
fn late_visits_go_back_over_the_start_of_a_state_and_one_that_does_not_know_of_them_says_so() {
    let scenario = Scenario::beginning(WalkKind::Line { metres: 1700.0 }, 2, &SensorModel::cmp10a(), 1300.0);
    let mut live = Live::new(&scenario, Some(identification()));
    // Told a quarter of a minute late, every 17 s: many a stretch of the trail begins in between.
    for number in (200 * 40..live.samples.len()).step_by(200 * 17) {
        let t_ns = live.samples[number - 200 * 15].1.t_ns;
        let [e_m, n_m, _] = scenario.config.initial_position_n_m;
        let visit = Visit {
            marker: format!("nowhere {number}"),
            t_start_ns: t_ns,
            t_end_ns: t_ns,
            // Where nobody is: weighed and turned down, or believed, the same must come of it.
            position_n_m: (e_m + t_ns as f64 * 1.2e-9, n_m, None),
        };
        live.keyed.push((number, visit));
    }
    assert_eq!(assert_goes_on_as_if_uncut(&live, 5, Kept::Newer), (4, 0));
    let (_, not_enough) = assert_goes_on_as_if_uncut(&live, 5, Kept::Older);
    assert!(not_enough > 0, "no visit has gone back over the start of a state");
}

#[test]
fn one_foot_alone_goes_on_to_the_bit() {
    let scenario = Scenario::beginning(WalkKind::Line { metres: 1900.0 }, 3, &SensorModel::cmp10a(), 1500.0);
    let mut live = Live::new(&scenario, None);
    live.config.streams = vec![pedestrian::stream(Side::Left)];
    live.samples.retain(|(foot, _)| *foot == Side::Left);
    assert_eq!(assert_goes_on_as_if_uncut(&live, 5, Kept::Newer), (3, 0));
}

#[test]
fn what_is_no_state_is_refused() {
    let scenario = Scenario::beginning(WalkKind::Line { metres: 150.0 }, 4, &SensorModel::cmp10a(), 150.0);
    let live = Live::new(&scenario, None);
    let mut states = Vec::new();
    live.go_on(
        &mut Session::new(live.config.clone()).unwrap(),
        0..live.samples.len(),
        |_, session, events| {
            events.clear();
            states.extend(session.state_to_save());
        },
    );
    let bytes = &states.last().expect("two minutes").bytes;
    let take_up = |config: &SessionConfig, bytes: &[u8]| Session::restored(config.clone(), bytes, None);
    assert!(take_up(&live.config, bytes).is_ok());
    for cut in (0..bytes.len()).step_by(97) {
        assert!(take_up(&live.config, &bytes[..cut]).is_err(), "cut after {cut} bytes");
        let mut altered = bytes.clone();
        altered[cut] ^= 1 << (cut % 8);
        let refused = take_up(&live.config, &altered).unwrap_err().to_string();
        assert!(refused.contains("cut or altered"), "{refused}");
    }
    let whole = SessionConfig { solution: Solution::Smoothed, ..live.config.clone() };
    assert!(take_up(&whole, bytes).is_err());
    let markers = SessionConfig { identification: Some(identification()), ..live.config.clone() };
    assert!(take_up(&markers, bytes).unwrap_err().to_string().contains("markers"));
}
