//! Saved states of live walks: an altered one is refused by its checksum; one whose checksum was made to fit is
//! refused too, or gives a session that takes what a foot sends without a panic.

use std::sync::LazyLock;

use lodestep_engine::geo::Site;
use lodestep_engine::identify::{Identification, Marker, Markers};
use lodestep_engine::sample::ImuSample;
use lodestep_engine::session::{SavedState, Session, SessionConfig, Solution, Visit};
use lodestep_engine::sim::pedestrian::{SensorModel, Simulator, WalkKind};
use lodestep_engine::systems::pedestrian::{self, Side};
use sha2::{Digest, Sha256};

/// A saved state begins with so much of the hash of the rest.
const CHECK_BYTES: usize = 8;
/// Epochs after which a walk of the fuzzer's own has saved a state: it does so every minute.
const EPOCHS: usize = 20_000;
/// Samples that a session is given that was taken up.
const SAMPLES: i64 = 200;
const PERIOD_NS: i64 = 10_000_000;

/// A walk's configuration and the state that it has saved.
pub(crate) struct Saved {
    config: SessionConfig,
    state: SavedState,
}

/// With one foot and with two, with markers to choose from and without.
pub(crate) static SAVED: LazyLock<[Saved; 4]> = LazyLock::new(|| std::array::from_fn(walk));

fn walk(number: usize) -> Saved {
    let site = Site::fast();
    let mut simulator = Simulator::new(&WalkKind::Spiral, 1, &site, &SensorModel::cmp10a());
    let markers = simulator.visits().iter().map(|visit| {
        let [e_m, n_m, u_m] = visit.position_n_m;
        Marker { name: visit.marker.clone(), position_n_m: (e_m, n_m, Some(u_m)) }
    });
    let identification = (number & 2 != 0).then(|| Identification {
        markers: Markers::new(markers.collect()).into(),
        ..Identification::default()
    });
    let config = SessionConfig {
        initial_position_n_m: simulator.start_n_m(),
        solution: Solution::Trail,
        max_lead_ns: Some(1_000_000_000),
        identification,
        ..pedestrian::Config::default().session(if number & 1 != 0 { &Side::BOTH } else { &[Side::Left] })
    };
    let mut session = Session::new(config.clone()).expect("feet are streams of a walk");
    let mut events = Vec::new();
    for _ in 0..EPOCHS {
        let Some(epoch) = simulator.next_epoch() else { break };
        for (foot, sample) in Side::BOTH.into_iter().zip(&epoch.samples).take(config.streams.len()) {
            session.push(foot, sample, &mut events);
        }
        if let Some(state) = session.state_to_save() {
            return Saved { config, state };
        }
    }
    panic!("a walk of {EPOCHS} epochs has saved no state");
}

/// The first byte says which walk, whether its state is altered or the bytes take its place, and whether the checksum is made
/// to fit; then four bytes for each thing that is done to the state.
pub(crate) fn run(bytes: &[u8]) {
    let Some((first, deeds)) = bytes.split_first() else { return };
    let Saved { config, state } = &SAVED[usize::from(first & 3)];
    let before = &state.bytes[CHECK_BYTES..];
    let body = if first & 4 != 0 { deeds.to_vec() } else { altered(before, deeds) };
    let fits = first & 8 == 0;
    let check = if fits { Sha256::digest(&body) } else { Sha256::digest(before) };
    let saved = [&check[..CHECK_BYTES], &body].concat();
    match Session::restored(config.clone(), &saved, None) {
        Err(error) => {
            assert!(fits || body != before, "a state as it was saved is refused: {error}");
            let error = error.to_string();
            assert!(!error.is_empty() && !error.contains(char::is_control), "no sentence: {error:?}");
        }
        Ok(session) => {
            assert!(fits || body == before, "an altered state is believed");
            goes_on(session, state.t_ns);
        }
    }
}

fn altered(body: &[u8], deeds: &[u8]) -> Vec<u8> {
    let mut body = body.to_vec();
    for &[low, high, how, value] in deeds.as_chunks::<4>().0 {
        let place = usize::from(u16::from_le_bytes([low, high])) | usize::from(how >> 4) << 16;
        let Some(place) = place.checked_rem(body.len()) else { return body };
        match how & 7 {
            0..=2 => body[place] = value,
            3..=4 => body[place] ^= 1 << (value & 7),
            5 => body.insert(place, value),
            6 => drop(body.remove(place)),
            _ => body.truncate(place),
        }
    }
    body
}

/// Whatever it believes, it takes what comes.
fn goes_on(mut session: Session, t_ns: i64) {
    let mut events = Vec::new();
    for k in 0..SAMPLES {
        let noise = [0.0, 0.002, -0.001, 0.003, -0.002, 0.001, -0.003][k as usize % 7];
        let sample = ImuSample {
            t_ns: t_ns + k * PERIOD_NS,
            w_ib_b_rad_s: [noise, -noise, 0.5 * noise],
            f_b_m_s2: [0.1 + 5.0 * noise, -3.0 * noise, 9.79 + noise],
            mag_b_ut: Some([5.0 + noise, 34.0, -30.0]),
            pressure_hpa: Some(890.0 + noise),
        };
        for foot in Side::BOTH {
            session.push(foot, &sample, &mut events);
        }
        if k == SAMPLES / 2 {
            let visit = Visit {
                marker: "M".to_owned(),
                t_start_ns: t_ns,
                t_end_ns: t_ns + k * PERIOD_NS / 2,
                position_n_m: (0.0, 0.0, None),
            };
            session.visit(visit, &mut events);
        }
    }
    session.finish(&mut events);
}
