//! Live walks: one foot late, silent or absent; the past put elsewhere; a server that starts again.

use std::collections::BTreeMap;

use lodestep_engine::replay::InputStore;
use lodestep_engine::session::{SavedState, Session, Solution};
use lodestep_engine::sim::pedestrian::{SensorModel, WalkKind};
use lodestep_engine::systems::pedestrian::Side;

use crate::Case;
use crate::fold::Fold;
use crate::walk::{Make, SECOND_NS, Walk};

/// A live walk that waits a second for a foot.
fn walk(kind: WalkKind, seed: u64, seconds: i64) -> Walk {
    Walk::simulated(kind, seed, &SensorModel::cmp10a(), seconds).with(|config| {
        config.solution = Solution::Trail;
        config.max_lead_ns = Some(SECOND_NS);
    })
}

fn rectangle() -> Walk {
    walk(WalkKind::Rectangle, 13, 120).with_visit(50, [0.7, -0.4], true, 12)
}

/// The samples of a foot from one time to before another are not there.
fn without(mut walk: Walk, foot: Side, from_s: i64, to_s: i64) -> Walk {
    let silent = from_s.saturating_mul(SECOND_NS)..to_s.saturating_mul(SECOND_NS);
    walk.samples.retain(|(of, sample)| *of != foot || !silent.contains(&sample.t_ns));
    walk
}

pub(crate) fn cases() -> Vec<Case> {
    const NEVER: i64 = i64::MAX / SECOND_NS;
    let ways: [(&str, Make); 12] = [
        ("in_step", rectangle),
        ("right_late_within_the_lead", || rectangle().with_delay(Side::Right, 900_000_000, 0)),
        ("right_late_beyond_the_lead", || rectangle().with_delay(Side::Right, 3 * SECOND_NS, 30 * SECOND_NS)),
        ("left_late_beyond_the_lead", || rectangle().with_delay(Side::Left, 3 * SECOND_NS, 30 * SECOND_NS)),
        ("late_without_a_lead", || {
            let walk = rectangle().with_delay(Side::Left, 3 * SECOND_NS, 0);
            walk.with(|config| config.max_lead_ns = None)
        }),
        ("left_silent_for_a_while", || without(rectangle(), Side::Left, 40, 60)),
        ("right_silent_for_good", || without(rectangle(), Side::Right, 45, NEVER)),
        ("left_begins_late", || without(rectangle(), Side::Left, 0, 4)),
        ("right_begins_after_the_walk", || without(rectangle(), Side::Right, 0, 30)),
        ("right_absent", || without(rectangle(), Side::Right, 0, NEVER)),
        ("left_absent_from_a_log", || {
            without(rectangle(), Side::Left, 0, NEVER).with(|config| config.max_lead_ns = None)
        }),
        ("both_silent_for_a_while", || {
            without(without(rectangle(), Side::Left, 60, 66), Side::Right, 60, 66)
        }),
    ];
    let mut cases: Vec<Case> = ways
        .into_iter()
        .map(|(name, walk)| Case::new(format!("live/{name}"), move || walk().run()))
        .collect();
    cases.push(Case::new("live/past_put_elsewhere".to_owned(), || {
        let walk = rectangle();
        let store = Some(Box::new(Elsewhere::default()) as Box<dyn InputStore>);
        let mut session = Session::with_store(walk.config.clone(), store).expect("streams of a walk");
        let mut fold = Fold::default();
        walk.go_on(&mut session, 0..walk.samples.len(), |_, _, events| fold.take(events));
        walk.finish(session, fold)
    }));
    cases.push(Case::new("live/left_ended_while_the_other_goes_on".to_owned(), || {
        let walk = without(rectangle(), Side::Left, 70, NEVER).with(|config| config.max_lead_ns = None);
        let ended = walk.number_at(72 * SECOND_NS);
        let (mut session, mut fold) =
            (Session::new(walk.config.clone()).expect("streams of a walk"), Fold::default());
        walk.go_on(&mut session, 0..walk.samples.len(), |next, session, events| {
            if next == ended {
                session.end(Side::Left, events);
            }
            fold.take(events);
        });
        walk.finish(session, fold)
    }));
    for (name, feet) in [("two_feet", 2), ("one_foot", 1)] {
        cases.push(Case::new(format!("live/restored/{name}"), move || restored(feet)));
    }
    cases
}

/// Room for the past of a walk outside of its session.
#[derive(Default)]
struct Elsewhere(BTreeMap<u64, Vec<u8>>);

impl InputStore for Elsewhere {
    fn put(&mut self, number: u64, bytes: &[u8]) -> bool {
        self.0.insert(number, bytes.to_vec()).is_none()
    }

    fn get(&mut self, number: u64) -> Option<Vec<u8>> {
        self.0.get(&number).cloned()
    }

    fn forget_before(&mut self, number: u64) {
        self.0.retain(|kept, _| *kept >= number);
    }
}

/// A walk that is cut after 430 s, taken up from a saved state that is old enough, and gone on with. What was said from the
/// state to the cut is not counted again.
fn restored(feet: usize) -> Fold {
    let mut walk = walk(WalkKind::Line { metres: 650.0 }, 14, 480);
    if feet == 1 {
        walk = walk.with_one_foot(Side::Right);
    }
    for t_s in [100, 250, 400, 440, 470] {
        walk = walk.with_visit(t_s, [0.5, -0.9], t_s != 250, 8);
    }
    let (cut, end) = (walk.number_at(430 * SECOND_NS), walk.samples.len());
    let (mut fold, mut states) = (Fold::default(), Vec::<(usize, SavedState)>::new());
    walk.go_on(
        &mut Session::new(walk.config.clone()).expect("streams of a walk"),
        0..cut,
        |next, session, events| {
            fold.take(events);
            states.extend(session.state_to_save().map(|state| (next, state)));
        },
    );
    let newest_ns = states.last().expect("a state a minute").1.t_ns;
    let enough = states.iter().rfind(|(_, state)| state.t_ns < newest_ns - Session::LOOKS_BACK_NS);
    let (next, state) = enough.expect("a state that is old enough");
    let session = Session::restored(walk.config.clone(), &state.bytes, None);
    let mut session = session.expect("its own state");
    walk.go_on(&mut session, *next..cut, |_, _, events| events.clear());
    assert!(!session.lacks_past());
    walk.go_on(&mut session, cut..end, |_, session, events| {
        fold.take(events);
        fold.look_at_times(session);
    });
    walk.finish(session, fold)
}
