//! RTCM 3 is read as it is meant, by what another hand wrote from the standard's tables.

use std::collections::{BTreeMap, BTreeSet};

use lodestep_engine::gnss::ephemeris::{Ephemeris, Navigation};
use lodestep_engine::gnss::observations::{Epoch, Observations, Signal};
use lodestep_engine::gnss::rtcm::{Decoder, Message};
use lodestep_engine::gnss::satellite::{Constellation, Satellite};
use lodestep_engine::gnss::time::GpsTime;
use lodestep_engine::gnss::{navigation_reader, observation_reader};
use lodestep_engine::sim::rover::{Scene, simulate};
use lodestep_tests::rtcm_writer::RtcmWriter;
use proptest::prelude::*;

fn made(scene: Scene) -> (Observations, Navigation) {
    let files = simulate(scene, 3);
    let text = |name: &str| files.iter().find(|file| file.name == name).unwrap().text.as_bytes();
    let mut rover = observation_reader::read(text("rover.obs")).unwrap();
    rover.epochs.truncate(400);
    (rover, navigation_reader::read(text("base.nav")).unwrap())
}

fn epochs(messages: Vec<Message>) -> Vec<Epoch> {
    let epoch = |message| match message {
        Message::Epoch(epoch) => Some(epoch),
        _ => None,
    };
    messages.into_iter().filter_map(epoch).collect()
}

/// Signals by satellite and name, those with a code.
fn signals(epoch: &Epoch) -> BTreeMap<(Satellite, u8, u8), Signal> {
    let of = |tracked| {
        let satellite = |one: &lodestep_engine::gnss::observations::Tracked| one.satellite;
        let signals = epoch.signals_of(tracked).iter().filter(|signal| signal.code_m != 0.0);
        signals.map(move |signal| ((satellite(tracked), signal.band, signal.attribute), *signal))
    };
    epoch.satellites.iter().flat_map(of).collect()
}

#[test]
fn every_kind_of_epoch_comes_back_but_for_its_steps_with_losses_of_lock_and_half_cycles() {
    let (mut sent, _) = made(Scene::Canopy);
    // Half a cycle is in doubt now and then.
    for (k, epoch) in sent.epochs.iter_mut().enumerate() {
        for signal in epoch.signals.iter_mut().filter(|signal| signal.band == 1) {
            signal.half_cycle = k % 97 < 5;
        }
    }
    for (kind, code_m, phase_m, strength) in
        [(4, 0.01, 3e-4, 0.51), (5, 0.01, 3e-4, 0.51), (6, 3e-4, 8e-5, 0.04), (7, 3e-4, 8e-5, 0.04)]
    {
        let (mut writer, mut decoder) = (RtcmWriter::default(), Decoder::default());
        let mut shifts: BTreeMap<(Satellite, u8, u8), f64> = BTreeMap::new();
        let mut lost = 0;
        for epoch in &sent.epochs {
            let bytes = writer.epoch(epoch, kind);
            // The server's clock may be days off.
            let got = epochs(decoder.push(&bytes, epoch.time + 250_000.0));
            assert_eq!(got.len(), 1);
            assert_eq!(got[0].time, epoch.time);
            let (got, want) = (signals(&got[0]), signals(epoch));
            assert_eq!(got.keys().collect::<Vec<_>>(), want.keys().collect::<Vec<_>>());
            for (key, want) in &want {
                let got = &got[key];
                assert!((got.code_m - want.code_m).abs() < code_m, "{key:?} {got:?} {want:?}");
                assert!((got.strength_db_hz - want.strength_db_hz).abs() < strength);
                assert_eq!(got.half_cycle, want.half_cycle);
                let known = shifts.contains_key(key);
                assert!(got.lost_lock || !want.lost_lock || !known, "{key:?}: a loss of lock was not told");
                lost += usize::from(want.lost_lock);
                if (got.phase_cycles != 0.0) != (want.phase_cycles != 0.0) {
                    panic!("{key:?} {got:?} {want:?}");
                }
                if want.phase_cycles == 0.0 {
                    continue;
                }
                // Whole cycles are the receiver's own, from one loss of lock to the next.
                let off = got.phase_cycles - want.phase_cycles;
                let shift = shifts.entry(*key).or_insert(off.round());
                if got.lost_lock {
                    *shift = off.round();
                }
                let wave_m = lodestep_engine::gnss::signal::wavelength_m(key.0.constellation, key.1).unwrap();
                assert!((off - *shift).abs() * wave_m < phase_m, "{key:?}: {off} {shift} in MSM{kind}");
            }
        }
        assert!(lost > 0, "no loss of lock to be told");
        assert_eq!(decoder.counts().garbage_bytes + decoder.counts().corrupt, 0);
    }
}

#[test]
fn orbits_and_stations_come_back_in_whatever_week() {
    let (_, navigation) = made(Scene::Open);
    let as_galileo = |one: &Ephemeris| {
        let satellite = Satellite { constellation: Constellation::Galileo, ..one.satellite };
        let minute = |time: GpsTime| GpsTime::from_week(time.week(), (time.tow_s() / 600.0).floor() * 600.0);
        Ephemeris { satellite, toe: minute(one.toe), toc: minute(one.toc), healthy: false, ..*one }
    };
    let of = |constellation| {
        navigation.ephemerides.iter().filter(move |one| one.satellite.constellation == constellation)
    };
    let galileo: Vec<Ephemeris> = of(Constellation::Gps).map(as_galileo).collect();
    let mut systems = BTreeSet::new();
    for sent in navigation.ephemerides.iter().chain(&galileo) {
        let mut decoder = Decoder::default();
        // Days later, as a server that was set up on Monday hears of Sunday.
        let messages = decoder.push(&RtcmWriter::ephemeris(sent), sent.toe + 260_000.0);
        let [Message::Ephemeris(got)] = messages.as_slice() else { panic!("{messages:?}") };
        assert_eq!((got.satellite, got.toe, got.healthy), (sent.satellite, sent.toe, sent.healthy));
        assert!(got.toc.since(sent.toc).abs() < 16.0);
        for hours in [-1.0, 0.0, 1.5] {
            let time = sent.toe + 3600.0 * hours;
            let (got, want) = (got.state(time), sent.state(time));
            assert!((got.p_e - want.p_e).norm() < 0.5, "{}: {}", sent.satellite, (got.p_e - want.p_e).norm());
            assert!((got.clock_s - want.clock_s).abs() < 1e-9, "{}", sent.satellite);
        }
        systems.insert(sent.satellite.constellation);
    }
    assert_eq!(systems.len(), 3);
    let place = [-2_148_744.396_9, 4_426_641.203_9, -4_044_655.856_4];
    let messages = Decoder::default().push(&RtcmWriter::station(place, 1.2345), GpsTime::default());
    let [Message::Station(got)] = messages.as_slice() else { panic!("{messages:?}") };
    assert!((0..3).all(|axis| (got.position_m[axis] - place[axis]).abs() < 6e-5), "{got:?}");
    assert!((got.antenna_height_m - 1.2345).abs() < 6e-5);
}

/// A minute of epochs, an orbit and a station as frames.
fn minute() -> &'static (Vec<Vec<u8>>, GpsTime) {
    static MADE: std::sync::LazyLock<(Vec<Vec<u8>>, GpsTime)> = std::sync::LazyLock::new(make_minute);
    &MADE
}

fn make_minute() -> (Vec<Vec<u8>>, GpsTime) {
    let (sent, navigation) = made(Scene::Doorway);
    let mut writer = RtcmWriter::default();
    let mut frames: Vec<Vec<u8>> = sent.epochs[..60].iter().map(|epoch| writer.epoch(epoch, 7)).collect();
    frames.insert(20, RtcmWriter::station([1e6, 2e6, 3e6], 0.0));
    frames.insert(40, RtcmWriter::ephemeris(&navigation.ephemerides[0]));
    (frames, sent.epochs[0].time)
}

#[test]
fn a_frame_that_is_damaged_costs_no_other_and_garbage_in_between_none() {
    let (frames, now) = minute();
    let now = *now;
    let clean = Decoder::default().push(&frames.concat(), now);
    assert_eq!(clean.len(), 62);
    let mut dirty = b"HTTP/1.1 200 OK\r\n\r\n".to_vec();
    for (k, frame) in frames.iter().enumerate() {
        let mut frame = frame.clone();
        if k == 10 {
            frame[30] ^= 0x10;
        }
        dirty.extend([0xD3, 0x00, 0xD3, 0x7F, 0xD3].iter().take(k % 6));
        dirty.extend(frame);
    }
    let mut decoder = Decoder::default();
    // A frame that seems to begin before the last one has to be refuted by what follows it.
    let mut got = decoder.push(&dirty, now);
    got.extend(decoder.push(&[0; 1100], now));
    let missing: Vec<&Message> = clean.iter().filter(|message| !got.contains(message)).collect();
    // The epoch before the damage misses nothing; one system of the damaged one does, and what was lost with it is told by its arcs.
    assert!(missing.len() <= 2, "{} missing", missing.len());
    assert!(decoder.counts().corrupt > 0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn however_bytes_are_cut_they_give_the_same(cuts in prop::collection::vec(1_usize..700, 1..200)) {
        let (frames, now) = minute();
        let (bytes, now) = (frames.concat(), *now);
        let whole = Decoder::default().push(&bytes, now);
        let mut decoder = Decoder::default();
        let (mut at, mut got) = (0_usize, Vec::new());
        for cut in cuts.iter().chain(std::iter::repeat(&usize::MAX)) {
            let end = at.saturating_add(*cut).min(bytes.len());
            got.extend(decoder.push(&bytes[at..end], now));
            at = end;
            if at == bytes.len() {
                break;
            }
        }
        prop_assert_eq!(got, whole);
    }

    #[test]
    fn whatever_comes_in_a_frame_nothing_panics(
        number in prop::sample::select(vec![1005_u16, 1006, 1019, 1042, 1046, 1074, 1077, 1094, 1095, 1117, 1124, 1126, 1127, 1084, 1230]),
        mut body in prop::collection::vec(any::<u8>(), 2..400),
        few in any::<bool>(),
    ) {
        body[0] = (number >> 4) as u8;
        body[1] = (number << 4) as u8 | body[1] & 15;
        if few && body.len() > 22 {
            // Masks of few satellites and signals, so that cells are reached.
            body[9..22].fill(0);
            (body[12], body[17]) = (3, 64);
        }
        let frame = RtcmWriter::framed(&body);
        let mut decoder = Decoder::default();
        decoder.push(&frame, GpsTime::from_week(2340, 0.0));
        prop_assert_eq!(decoder.counts().frames, 1);
    }

    #[test]
    fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(prop_oneof![Just(0xD3_u8), Just(0), any::<u8>()], 0..3000)) {
        Decoder::default().push(&bytes, GpsTime::default());
    }
}
