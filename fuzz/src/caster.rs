//! How a caster's answer begins, as it comes in pieces: what was decided stays decided.

use lodestep_server::ntrip::{Answer, read_answer};

/// An answer.
pub(crate) fn run(bytes: &[u8]) {
    let mut decided: Option<Answer> = None;
    for end in 0..=bytes.len() {
        let answer = read_answer(&bytes[..end]);
        match (&decided, &answer) {
            (Some(Answer::Data(from)), Answer::Data(now)) => {
                assert_eq!(from, now, "the data begin elsewhere")
            }
            (Some(Answer::Data(_)), other) => panic!("data came, then {other:?}"),
            (_, Answer::Data(from)) => assert!(*from <= end, "data from {from} of {end} bytes"),
            (_, Answer::Refused(why)) => {
                assert!(why.chars().count() <= 400 && !why.chars().any(char::is_control), "{why:?}");
            }
            (_, Answer::Wait) => {}
        }
        if answer != Answer::Wait {
            decided = Some(answer);
        }
    }
}
