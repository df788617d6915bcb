//! Silence is judged by each device's own rate.

use super::*;
use crate::systems::cabin::instrument::tests::example;
use crate::systems::cabin::rig::Rig;
use crate::systems::cabin::session::{CabinConfig, Estimator};
use crate::systems::cabin::tuning::Tuning;

const MS: i64 = 1_000_000;

fn body() -> (Body, Aids) {
    let config = CabinConfig {
        estimator: Estimator::Own,
        smoothed: false,
        rate_hz: 20.0,
        has_stations: true,
        has_encoders: true,
        has_platform_imu: false,
        platform: true,
    };
    let instrument = example();
    (Body::new(Rig::of_cabin(&instrument, true), Tuning::OWN, &config, true), Aids::new(&instrument, false))
}

/// What is told to be silent while antennas write every so many milliseconds, each with so much of a shift against the one before, and
/// none from the last time on; and after how long, ms.
fn told(every_ms: [i64; 6], shift_ms: i64, ends_ms: i64) -> Vec<(String, i64)> {
    let (mut body, aids) = body();
    let (mut watch, mut told) = (Watch::default(), Vec::new());
    for epoch in 1..=(ends_ms + 12_000) / 50 {
        let t_ms = epoch * 50;
        for (antenna, every_ms) in every_ms.into_iter().enumerate() {
            let written =
                (t_ms - 49..=t_ms).find(|t_ms| (t_ms - antenna as i64 * shift_ms).rem_euclid(every_ms) == 0);
            if let Some(written_ms) = written.filter(|written_ms| *written_ms < ends_ms) {
                let aid = aids.antenna(antenna);
                body.note_row(written_ms * MS, aid);
                body.last_seen.insert(aid, written_ms * MS);
            }
        }
        body.silences(t_ms * MS, &aids, &mut watch);
        told.extend(watch.fresh().into_iter().map(|found| (found.source, t_ms - ends_ms)));
        watch.pass(t_ms * MS);
    }
    told
}

#[test]
fn slow_antennas_that_write_at_one_moment_are_not_silent_between_and_are_soon_when_they_are() {
    // All at once, a second apart; in turn; and one quick one among slow ones.
    for (every_ms, shift_ms, most_ms) in
        [([1000; 6], 0, 4100), ([1000; 6], 160, 4100), ([50, 1000, 1000, 1000, 1000, 1000], 0, 400)]
    {
        let told = told(every_ms, shift_ms, 20_000);
        let early: Vec<_> = told.iter().filter(|(_, after_ms)| *after_ms < 0).collect();
        assert!(early.is_empty(), "{every_ms:?} {shift_ms}: {early:?}");
        let (_, after_ms) = told.iter().find(|(source, _)| source == "antennas").expect("an outage is told");
        assert!(*after_ms <= most_ms, "{every_ms:?} {shift_ms}: after {after_ms} ms");
    }
}

#[test]
fn an_outage_does_not_become_the_usual_time_of_a_device() {
    let (mut body, aids) = body();
    let aid = aids.antenna(2);
    let mut t_ms = 0;
    for between_ms in [50, 50, 50, 30_000, 50, 50, 50] {
        body.last_seen.insert(aid, t_ms * MS);
        t_ms += between_ms;
        body.note_row(t_ms * MS, aid);
    }
    assert_eq!(body.between[&aid].usual_ns, 50 * MS);
}
