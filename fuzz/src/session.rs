//! The filter: whatever a sensor sends, every number that a session tells is finite, every sigma positive.

use lodestep_engine::event::{Event, TrackPoint};
use lodestep_engine::sample::ImuSample;
use lodestep_engine::session::{Session, SessionConfig, Visit};
use lodestep_engine::systems::pedestrian::{self, Side};

const PERIOD_NS: i64 = 10_000_000;
/// Samples in one run: forty seconds of a foot.
const MOST_SAMPLES: usize = 4_000;
/// Numbers of broken devices, by the code that stands for them.
const BROKEN: [f64; 8] =
    [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, 1e-300, 1e30, -1e6, f64::MIN_POSITIVE];

/// Eight bytes a deed: what happens, how often, and to which value.
pub(crate) fn run(bytes: &[u8]) {
    let Some((first, deeds)) = bytes.split_first() else { return };
    let feet = [vec![Side::Left], vec![Side::Right], Side::BOTH.to_vec()][usize::from(first % 3)].clone();
    let max_lead_ns = (first & 4 != 0).then_some(1_000_000_000);
    let config = SessionConfig { max_lead_ns, ..pedestrian::Config::default().session(&feet) };
    let mut session = Session::new(config).expect("feet are streams of a walk");
    let (mut events, mut t_ns, mut samples) = (Vec::new(), [0_i64; 2], 0);
    for deed in deeds.as_chunks::<8>().0 {
        let [what, count, axis, a, b, c, step, size] = *deed;
        let foot = Side::BOTH[usize::from(what & 1)];
        let clock_ns = &mut t_ns[foot.index()];
        match what >> 1 & 7 {
            0..=4 => {
                *clock_ns = clock_ns.saturating_add(jump_ns(step));
                for k in 0..4 * (1 + usize::from(count)) {
                    samples += 1;
                    if samples > MOST_SAMPLES {
                        break;
                    }
                    *clock_ns = clock_ns.saturating_add(PERIOD_NS);
                    let mut sample = at_rest(*clock_ns, k);
                    let value = if size & 0x80 != 0 {
                        BROKEN[usize::from(size & 7)]
                    } else {
                        f64::from(i16::from_le_bytes([a, b])) * 2_f64.powi(i32::from(size & 15) - 12)
                    };
                    spoil(&mut sample, axis, value, c);
                    session.push(foot, &sample, &mut events);
                }
            }
            5 => {
                let t_start_ns = clock_ns.saturating_add(jump_ns(step));
                let [e_m, n_m] = [a, b].map(|byte| f64::from(byte as i8));
                let u_m = (c & 1 != 0).then(|| f64::from(c as i8));
                let visit = Visit {
                    marker: "M".to_owned(),
                    t_start_ns,
                    t_end_ns: t_start_ns.saturating_add(i64::from(count) * PERIOD_NS),
                    position_n_m: (e_m, n_m, u_m),
                };
                session.visit(visit, &mut events);
            }
            6 => session.end(foot, &mut events),
            _ => *clock_ns = clock_ns.saturating_add(jump_ns(step)),
        }
    }
    session.finish(&mut events);
    for event in &events {
        match event {
            Event::Point(point) => check(point),
            Event::Revision { points } => points.iter().for_each(check),
            Event::Anomaly(anomaly) => {
                assert!(anomaly.t_start_ns <= anomaly.t_end_ns && !anomaly.detail.is_empty(), "{anomaly:?}");
            }
            _ => {}
        }
    }
    let summary = session.summary();
    assert!(summary.distance_m.is_finite() && summary.duration_s.is_finite(), "{summary:?}");
}

/// From a period back to a century on.
fn jump_ns(step: u8) -> i64 {
    match step {
        0..=127 => 0,
        128..=191 => i64::from(step - 128) * PERIOD_NS,
        192..=223 => -i64::from(step - 192) * 100 * PERIOD_NS,
        224..=250 => i64::from(step - 224) * 1_000_000_000,
        251 => 86_400_000_000_000,
        252 => -86_400_000_000_000,
        253 => i64::MAX,
        254 => i64::MIN,
        255 => 3_000_000_000_000_000_000,
    }
}

/// A foot at rest, with the noise that tells it from a sensor that is stuck.
fn at_rest(t_ns: i64, k: usize) -> ImuSample {
    let noise = [0.0, 0.002, -0.001, 0.003, -0.002, 0.001, -0.003][k % 7];
    ImuSample {
        t_ns,
        w_ib_b_rad_s: [noise, -noise, 0.5 * noise],
        f_b_m_s2: [0.1 + 5.0 * noise, -3.0 * noise, 9.79 + noise],
        mag_b_ut: Some([5.0 + noise, 34.0, -30.0]),
        pressure_hpa: Some(890.0 + noise),
    }
}

/// Puts a value into the channels that the bits of `axis` name; `how` says whether it takes the place of
/// what is there or is added to it.
fn spoil(sample: &mut ImuSample, axis: u8, value: f64, how: u8) {
    let mag = sample.mag_b_ut.get_or_insert_default();
    let pressure = sample.pressure_hpa.get_or_insert_default();
    let channels = sample.w_ib_b_rad_s.iter_mut().chain(&mut sample.f_b_m_s2).chain([&mut mag[0], pressure]);
    for (k, channel) in channels.enumerate() {
        if axis >> k & 1 != 0 {
            *channel = if how & 2 != 0 { value } else { *channel + value };
        }
    }
    if how & 0x40 != 0 {
        sample.mag_b_ut = None;
    }
    if how & 0x80 != 0 {
        sample.pressure_hpa = None;
    }
}

fn check(point: &TrackPoint) {
    let feet = point.parts.into_iter().flatten().flat_map(|foot| foot.position_n_m);
    let numbers =
        point.position_n_m.into_iter().chain(feet).chain([point.heading_rad, point.covariance_en_m2]);
    assert!(numbers.into_iter().all(f64::is_finite), "{point:?}");
    let sigmas = point.sigma_n_m.into_iter().chain([point.sigma_heading_rad]);
    assert!(sigmas.into_iter().all(|sigma| sigma.is_finite() && sigma > 0.0), "{point:?}");
    let [sigma_e, sigma_n, _] = point.sigma_n_m;
    assert!(point.covariance_en_m2.abs() <= sigma_e * sigma_n * (1.0 + 1e-9), "no covariance: {point:?}");
}
