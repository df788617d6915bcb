//! How a survey begins: when the tip is on the ground, and the filter at its start.

use nalgebra::Vector3;

use super::alignment::Aligned;
use super::contact::{self, Interval};
use super::filter::{Certainty, Filter};
use super::pass::{self, Pass, Setting, Wanted};
use super::recording::{Instrument, Recording};
use super::smoothing;
use super::states::STATES;
use super::tuning::Tuning;
use crate::ins::earth::Earth;
use crate::ins::layout::ErrorState::{Attitude, GyroBias, Position, Velocity};
use crate::ins::nav_state::NavState;
use crate::rotation::cayley;

/// When the tip is on the ground.
pub(super) fn contacts(
    recording: &Recording,
    instrument: &Instrument,
    earth: &Earth,
    aligned: &Aligned,
) -> Vec<Interval> {
    let end_ns = recording.imu.last().map_or(0, |sample| sample.t_ns);
    match (&recording.switch, instrument.tip_b_m) {
        (_, None) => Vec::new(),
        (Some(rows), Some(_)) => contact::by_switch(rows, end_ns),
        (None, Some(_)) => {
            let at_rest_m_s2 = at_rest(recording, instrument, earth, aligned);
            contact::by_feel(&recording.imu, instrument, at_rest_m_s2, &aligned.gyro_bias_b)
        }
    }
}

/// When the tip is felt to stand still, beside what a switch says; `None` without a switch, where contacts are that already.
pub(super) fn still(
    recording: &Recording,
    instrument: &Instrument,
    earth: &Earth,
    aligned: &Aligned,
) -> Option<Vec<Interval>> {
    recording.switch.as_ref()?;
    let at_rest_m_s2 = at_rest(recording, instrument, earth, aligned);
    Some(contact::by_feel(&recording.imu, instrument, at_rest_m_s2, &aligned.gyro_bias_b))
}

/// What the sensor reads up the pole when the tip stands, m/s², by what was recorded up to the first attitude.
pub(super) fn at_rest(
    recording: &Recording,
    instrument: &Instrument,
    earth: &Earth,
    aligned: &Aligned,
) -> f64 {
    let imu = &recording.imu;
    let until = imu.partition_point(|sample| sample.t_ns <= aligned.window_ns[1]);
    let gravity_m_s2 = earth.gravity_n(&aligned.antenna_n_m).norm();
    contact::force_at_rest(&imu[..until], instrument, gravity_m_s2, &aligned.gyro_bias_b)
}

/// The filter at the aligned sample. The first attitude may be some degrees off: what was recorded up to it says it better,
/// about itself.
pub(super) fn begin(
    recording: &Recording,
    instrument: &Instrument,
    earth: &Earth,
    tuning: &Tuning,
    aligned: &Aligned,
    contacts: &[Interval],
) -> Filter {
    let start = starting(aligned, instrument, tuning);
    if tuning.zero_velocity_m_s.is_some() {
        return start;
    }
    let pass = opening(recording, earth, tuning, aligned, contacts, &start, aligned.window_ns[1]);
    restarted(&start, pass)
}

/// The first minutes under open sky are enough to tell the clocks by, ns.
const TOLD_BY_NS: i64 = 60_000_000_000;

/// What the receiver's clock shows more than the sensor's, by the opening, s.
pub(super) fn clock_s(
    recording: &Recording,
    instrument: &Instrument,
    earth: &Earth,
    tuning: &Tuning,
    aligned: &Aligned,
    contacts: &[Interval],
) -> f64 {
    let start = begin(recording, instrument, earth, tuning, aligned, contacts);
    let until_ns = aligned.window_ns[1] + TOLD_BY_NS;
    opening(recording, earth, tuning, aligned, contacts, &start, until_ns).end.clock_s
}

/// A pass over what was recorded until then.
fn opening(
    recording: &Recording,
    earth: &Earth,
    tuning: &Tuning,
    aligned: &Aligned,
    contacts: &[Interval],
    start: &Filter,
    until_ns: i64,
) -> Pass {
    let (imu, fixes) = (&recording.imu, &recording.fixes);
    let opening = Setting {
        tuning,
        earth,
        imu: &imu[..imu.partition_point(|sample| sample.t_ns <= until_ns)],
        fixes: &fixes[..fixes.partition_point(|fix| fix.t_ns <= until_ns)],
        islands: &[],
        contacts,
        restless: &vec![false; contacts.len()],
        felt: recording.switch.is_none(),
        still: None,
    };
    pass::go(&opening, start, aligned.sample, Wanted::Start, i64::MAX / 4)
}

/// The filter at its start.
fn starting(aligned: &Aligned, instrument: &Instrument, tuning: &Tuning) -> Filter {
    let c_nb = aligned.c_nb;
    let nav = NavState {
        c_nb,
        v_n: aligned.antenna_n_m_s,
        p_n: aligned.antenna_n_m - c_nb * instrument.antenna_b_m,
        gyro_bias_b: aligned.gyro_bias_b,
        accelerometer_bias_b: Vector3::zeros(),
    };
    // What the accelerometer reads too much tilts the attitude.
    let mut attitude = aligned.covariance.fixed_view::<3, 3>(0, 0).into_owned();
    for (axis, sigma) in [0.02, 0.02, 0.03].into_iter().enumerate() {
        attitude[(axis, axis)] += sigma * sigma;
    }
    let certainty = Certainty { attitude, position_m: 0.1 };
    Filter::new(tuning, nav, &certainty, instrument.antenna_b_m, instrument.tip_b_m)
}

/// The same start, as everything that came later corrects it: about that the errors are small enough to be linear.
pub(super) fn restarted(start: &Filter, pass: Pass) -> Filter {
    let mut again = start.clone();
    let Some(errors) = smoothing::errors_at_start(pass) else { return again };
    let states = STATES.imu;
    let nav = &mut again.strapdown.nav;
    nav.c_nb = cayley(&errors[states.block(Attitude)]) * nav.c_nb;
    nav.p_n -= errors[states.block(Position)];
    nav.v_n -= errors[states.block(Velocity)];
    nav.gyro_bias_b += errors[states.block(GyroBias)];
    again.walking_b += errors[STATES.walking.block()];
    again
}
