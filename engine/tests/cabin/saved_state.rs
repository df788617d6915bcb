//! A server that starts anew takes up a saved state of a streamed session: what is told after it is what an uncut session tells, to
//! the bit.

use lodestep_engine::event::Event;
use lodestep_engine::session::{SavedState, Session, SessionConfig};
use lodestep_engine::sim::cabin::{self, RunPlan};
use lodestep_engine::stream::StreamId;
use lodestep_engine::systems::cabin::DECLARATION;

use super::session::{Row, rows};

/// What is told, each with the number of the row that it came of, and the states that are to be saved with the number of rows before.
#[derive(Default)]
struct Told {
    told: Vec<(usize, String)>,
    states: Vec<(usize, SavedState)>,
}

/// Goes on over some rows.
fn go_on(session: &mut Session, rows: &[Row<'_>], range: std::ops::Range<usize>) -> Told {
    let (mut told, mut events) = (Told::default(), Vec::new());
    for number in range {
        session.push(rows[number].stream(), rows[number].reading(), &mut events);
        told.told.extend(events.drain(..).map(|event: Event| (number, format!("{event:?}"))));
        let pose = session.pose().filter(|_| number % 40 == 0);
        told.told.extend(pose.map(|pose| (number, format!("{pose:?}"))));
        if number % 64 == 0 {
            told.states.extend(session.state_to_save().map(|state| (number + 1, state)));
        }
    }
    told
}

#[test]
fn a_streamed_session_goes_on_to_the_bit_from_each_of_its_states() {
    // Two of the states are saved where anomalies are open, a leg is off, and the platform goes from one source to another.
    let faults =
        ["wrong_fix.2@80..92", "wrong_leg.3@55..185", "no_encoders@89..91", "fog@179..182", "restart@88..89"];
    let faults = faults.iter().map(|fault| fault.parse().unwrap()).collect();
    let plan = RunPlan { hold_s: 60.0, slew_s: 40.0, track_s: 90.0, stations_on_platform: true, faults };
    let run = cabin::simulate(&plan, 0);
    let mut config = SessionConfig::by_default(&DECLARATION);
    let id = StreamId::read("platform_imu").unwrap();
    config.instrument = Some(run.instrument.clone());
    config.max_lead_ns = Some(1_000_000_000);
    let mut rows = rows(&run);
    rows.extend(run.platform_imu.iter().map(|sample| Row::Imu(id, sample)));
    rows.sort_by_key(Row::t_ns);

    let mut session = Session::new(config.clone()).unwrap();
    let uncut = go_on(&mut session, &rows, 0..rows.len());
    assert_eq!(uncut.states.len(), 3, "a state every minute and a half");
    for (after, state) in &uncut.states {
        let mut restored = Session::restored(config.clone(), &state.bytes, None).unwrap();
        assert!(state.bytes.len() < 300_000, "{} bytes", state.bytes.len());
        // Some seconds of it: the test has to end.
        let until = rows.len().min(after + 4_000);
        let found = go_on(&mut restored, &rows, *after..until);
        let expected: Vec<_> = uncut.told.iter().filter(|(of, _)| (*after..until).contains(of)).collect();
        assert_eq!(found.told.len(), expected.len());
        let differs = found.told.iter().zip(expected).find(|(found, expected)| found != expected);
        assert_eq!(differs, None, "after row {after}");
    }
    // What is restored saves its next state when the uncut one does, and it is the same.
    let [_, (from, second), (to, third)] = &uncut.states[..] else { panic!("three states") };
    let mut restored = Session::restored(config.clone(), &second.bytes, None).unwrap();
    let later = go_on(&mut restored, &rows, *from..*to);
    assert!(later.states == [(*to, third.clone())], "another state after {to} rows");

    let other =
        SessionConfig { instrument: Some(run.instrument.replace("0.001", "0.0011")), ..config.clone() };
    let refused = Session::restored(other, &second.bytes, None).unwrap_err().to_string();
    assert!(refused.contains("another instrument"), "{refused}");
    let complete = SessionConfig { max_lead_ns: None, ..config };
    let refused = Session::restored(complete, &second.bytes, None).unwrap_err().to_string();
    assert!(refused.contains("not live"), "{refused}");
}
