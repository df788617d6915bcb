//! From the standing starts of the feet to the filter's first state.

use nalgebra::{Matrix3, Vector3};

use super::beyond::UNKNOWN_NORTH_RAD;
use super::causes::WalkCause;
use super::config::Config;
use super::contradictions::Contradiction;
use super::doubts::Doubts;
use super::filter::{Filter, Setting};
use super::foot::FootState;
use super::preprocess::FootLine;
use super::slow_errors::blocks;
use super::start_field::{FirstField, first_field};
use crate::anomaly::Cause;
use crate::cause::SensorCause;
use crate::event::{Alignment, Event, HeadingSource};
use crate::ins::alignment::StandingStart;
use crate::ins::nav_state::NavState;
use crate::rotation::{level, wrap};
use crate::system::SessionConfig;

/// How sure the place of a foot beside the middle of both is, m.
const FOOT_PLACE_SIGMA_M: f64 = 0.05;
/// Sigma of what two magnetometers that stand beside each other differ by: the iron of both, rad.
const MAGNETIC_DIFFERENCE_SIGMA_RAD: f64 = 0.05;
/// Sigma of a heading before anything is known of it, rad.
const UNKNOWN_HEADING_RAD: f64 = 2.0;
/// A walking foot has to be sampled so often, Hz; half of 100 Hz still does (`lodestep evaluate contradictions`).
const LEAST_RATE_HZ: f64 = 45.0;
/// Gravity at rest that differs by more than this is not a matter of bias, m/s².
const IMPOSSIBLE_REST_M_S2: f64 = 0.6;
/// Without a rest to measure it by, the length of the force tells no more than a wrong unit, m/s².
const IMPOSSIBLE_FORCE_M_S2: f64 = 3.0;
/// Sigma of the tilt of a foot that rests between two swings only, rad: it is still on its way by 0.5 m/s².
const RESTING_TILT_RAD: f64 = 0.06;
/// Sigma of the velocity at the first sample by the forces from there to a rest, m/s, beside what the tilt makes of gravity.
const FIRST_SPEED_M_S: f64 = 0.3;
/// Forces over a longer time say nothing of that velocity, s.
const LONGEST_BACK_S: f64 = 3.0;
/// What a wrong tilt takes for acceleration, m/s², about.
const GRAVITY_M_S2: f64 = 9.8;
/// It is then below this, 1σ, m/s.
const UNKNOWN_SPEED_M_S: f64 = 1.5;
/// Who stands so long before walking gives levelling and gyro bias what they need, s.
const WANTED_STILL_S: f64 = 10.0;

/// The filter at its start, for as many feet as sent samples.
#[expect(clippy::large_enum_variant, reason = "made once in a session, and taken apart at once")]
pub(crate) enum Starts {
    One(Filter<{ blocks(1) }, 1>, Setting),
    Two(Filter<{ blocks(2) }, 2>, Setting),
}

/// A heading of a sensor's x axis, and how it came about.
#[derive(Clone, Copy, Debug)]
struct FirstHeading {
    rad: f64,
    sigma_rad: f64,
    source: HeadingSource,
}

/// Starts the filter of the feet in `lines` (one or two, each with a standing start), opens the
/// lines and reports how they were aligned.
pub(crate) fn resolve(
    session: &SessionConfig,
    config: &Config,
    lines: &mut [FootLine],
    events: &mut Vec<Event>,
) -> Starts {
    let fields: Vec<FirstField> = lines
        .iter()
        .map(|line| {
            line.start().map_or(FirstField::Usual, |start| first_field(start, session.site_field.as_ref()))
        })
        .collect();
    let headings = first_headings(session, config, lines, &fields);
    // A force with the other sign mirrors the walk, whatever says where north is.
    let mirrored =
        |field: &FirstField| matches!(field, FirstField::Useless(Contradiction::FieldUpsideDown { .. }));
    let north_unknown =
        headings.iter().all(|first| first.source == HeadingSource::Assumed) || fields.iter().any(mirrored);
    let begin_ns = lines.iter().map(FootLine::first_ns).min().unwrap_or(0);
    let mut feet = Vec::new();
    let mut variances = Vec::new();
    let mut seen = Vec::new();
    for (sensor, (line, first)) in lines.iter().zip(&headings).enumerate() {
        let told_sigma_rad = if north_unknown { UNKNOWN_NORTH_RAD } else { first.sigma_rad };
        let (Some(start), Some(sample)) = (line.start(), line.first_sample()) else { continue };
        report(session, line, start, &FirstHeading { sigma_rad: told_sigma_rad, ..*first }, events);
        if let FirstField::Useless(cause) = &fields[sensor] {
            let (t_start_ns, t_end_ns) = used(line, start);
            let samples = start.used.len() as u64;
            let stream = Some(line.side().stream());
            events.push(Event::Anomaly(cause.anomaly(stream, [t_start_ns, t_end_ns], samples)));
        }
        let nav = NavState {
            c_nb: start.attitude_at_first(first.rad),
            v_n: first_velocity(start, first.rad, session.gravity_m_s2),
            p_n: Vector3::from(session.initial_position_n_m)
                + beside_middle(config, lines.len(), sensor, headings[0].rad),
            gyro_bias_b: start.gyro_bias_b,
            accelerometer_bias_b: Vector3::zeros(),
        };
        let mut foot = FootState::new(nav, begin_ns, sample.w_ib_b_rad_s.into());
        if start.still {
            foot.doubts = Doubts::at_rest(start.f_b.norm(), session.gravity_m_s2);
        }
        foot.doubts.field_left_out = matches!(fields[sensor], FirstField::Useless(_));
        foot.ride.rest_m_s2 = if start.still { start.f_b.norm() } else { 0.0 };
        feet.push(foot);
        variances.push(first_variances(config, start, first));
        seen.push(
            start
                .mag_b_ut
                .filter(|_| first.source == HeadingSource::Magnetic)
                .map(|mag_b_ut| (level(&start.f_b, first.rad), mag_b_ut)),
        );
    }
    let setting = Setting::new(session, config, lines);
    for line in lines.iter_mut() {
        line.open(&config.tuning, session.gravity_m_s2);
    }
    if let Ok([left, right]) = <[FootState; 2]>::try_from(feet.clone()) {
        let first = First { variances: &variances, seen: &seen, fields: &fields, north_unknown };
        Starts::Two(started(Filter::new([left, right]), session, &setting, &first), setting)
    } else {
        let one = feet.swap_remove(0);
        let first = First { variances: &variances, seen: &seen, fields: &fields, north_unknown };
        Starts::One(started(Filter::new([one]), session, &setting, &first), setting)
    }
}

/// What is known of the feet at the start, one after the other.
struct First<'a> {
    variances: &'a [[Matrix3<f64>; 5]],
    /// Level attitude and field, where the heading is the magnetometer's.
    seen: &'a [Option<(Matrix3<f64>, Vector3<f64>)>],
    fields: &'a [FirstField],
    /// Whether nothing says where north is.
    north_unknown: bool,
}

fn started<const B: usize, const F: usize>(
    mut filter: Filter<B, F>,
    session: &SessionConfig,
    setting: &Setting,
    first: &First<'_>,
) -> Filter<B, F> {
    for (sensor, blocks) in first.variances.iter().enumerate() {
        filter.set_first_covariance(sensor, *blocks);
    }
    filter.set_first_positions(setting.tuning.first_position_sigma_m, FOOT_PLACE_SIGMA_M);
    filter.set_first_slow_errors(&setting.tuning);
    // A heading by the magnetometer is off by what deviates the field there: weighed as a measurement
    // of a heading of which nothing was known, it is correlated with that as it should be.
    for (sensor, seen) in first.seen.iter().enumerate() {
        let disturbed_rad =
            if let FirstField::Disturbed(rad) = first.fields[sensor] { Some(rad) } else { None };
        if let Some(rad) = disturbed_rad {
            filter.doubt_compass(sensor, rad);
        }
        if let Some((c_nb, mag_b_ut)) = seen {
            filter.take_first_heading(setting, sensor, c_nb, mag_b_ut);
        }
        // By the site's own field the very first stance shows how far this place is disturbed.
        if let (Some(_), Some(site)) = (seen, &session.site_field) {
            filter.feet[sensor].usual_field_ut = Some((site.horizontal_ut(), -site.down_ut()));
        }
    }
    if first.north_unknown {
        let place_n = filter.middle_p_n();
        let sigma_m = libm::hypot(setting.tuning.first_position_sigma_m, FOOT_PLACE_SIGMA_M);
        filter.lose_north(place_n, sigma_m * sigma_m);
    }
    filter
}

/// Half the separation to the left or right of the middle, when there are two feet.
fn beside_middle(config: &Config, feet: usize, sensor: usize, heading_rad: f64) -> Vector3<f64> {
    if feet < 2 {
        return Vector3::zeros();
    }
    let half_m = config.tuning.separation_m / 2.0 * if sensor == 0 { 1.0 } else { -1.0 };
    Vector3::new(-libm::cos(heading_rad) * half_m, libm::sin(heading_rad) * half_m, 0.0)
}

/// The first foot's heading as given, else magnetic, else east; the second one's from the
/// magnetometers where both have one, else its own x axis is taken to point the same way.
fn first_headings(
    session: &SessionConfig,
    config: &Config,
    lines: &[FootLine],
    fields: &[FirstField],
) -> Vec<FirstHeading> {
    let tuning = &config.tuning;
    let magnetic: Vec<Option<f64>> = lines
        .iter()
        .zip(fields)
        .map(|(line, field)| {
            let start = line.start().filter(|_| !matches!(field, FirstField::Useless(_)));
            start.and_then(|start| start.magnetic_heading(session.declination_rad))
        })
        .collect();
    let first = match (session.initial_heading_rad, magnetic.first().copied().flatten()) {
        (Some(rad), _) => {
            FirstHeading { rad, sigma_rad: tuning.given_heading_sigma_rad, source: HeadingSource::Given }
        }
        (None, Some(rad)) => FirstHeading {
            rad,
            sigma_rad: tuning.first_magnetic_heading_sigma_rad,
            source: HeadingSource::Magnetic,
        },
        // The other foot's, whose x axis is taken to point the same way.
        (None, None) if magnetic.len() > 1 && magnetic[1].is_some() => FirstHeading {
            rad: magnetic[1].unwrap_or_default(),
            sigma_rad: libm::hypot(
                tuning.first_magnetic_heading_sigma_rad,
                tuning.second_foot_heading_sigma_rad,
            ),
            source: HeadingSource::Assumed,
        },
        (None, None) => FirstHeading {
            rad: std::f64::consts::FRAC_PI_2,
            sigma_rad: tuning.given_heading_sigma_rad,
            source: HeadingSource::Assumed,
        },
    };
    lines
        .iter()
        .enumerate()
        .map(|(sensor, _)| {
            if sensor == 0 {
                return first;
            }
            match (magnetic[0], magnetic[sensor]) {
                (Some(first_magnetic), Some(own)) => FirstHeading {
                    rad: wrap(first.rad + own - first_magnetic),
                    sigma_rad: match first.source {
                        HeadingSource::Given => libm::hypot(first.sigma_rad, MAGNETIC_DIFFERENCE_SIGMA_RAD),
                        HeadingSource::Magnetic | HeadingSource::Assumed => {
                            tuning.first_magnetic_heading_sigma_rad
                        }
                    },
                    source: first.source,
                },
                (None, Some(own)) if first.source == HeadingSource::Assumed => FirstHeading {
                    rad: own,
                    sigma_rad: tuning.first_magnetic_heading_sigma_rad,
                    source: HeadingSource::Magnetic,
                },
                _ => FirstHeading {
                    sigma_rad: tuning.second_foot_heading_sigma_rad,
                    source: HeadingSource::Assumed,
                    ..first
                },
            }
        })
        .collect()
}

fn first_variances(config: &Config, start: &StandingStart, first: &FirstHeading) -> [Matrix3<f64>; 5] {
    let tuning = &config.tuning;
    let sigma_rad =
        if first.source == HeadingSource::Magnetic { UNKNOWN_HEADING_RAD } else { first.sigma_rad };
    let squared = |sigma: f64| Matrix3::identity() * (sigma * sigma);
    let rest_rad = if start.still { tuning.first_tilt_sigma_rad } else { RESTING_TILT_RAD };
    let tilt = libm::hypot(rest_rad, start.sigma_gyro_bias_rad_s * start.begins_s);
    let speed = match start.begins_s {
        _ if start.still_at_first => 0.01,
        back_s if back_s > LONGEST_BACK_S => UNKNOWN_SPEED_M_S,
        back_s => libm::hypot(FIRST_SPEED_M_S, GRAVITY_M_S2 * tilt * back_s),
    };
    [
        Matrix3::from_diagonal(&Vector3::new(tilt * tilt, tilt * tilt, sigma_rad * sigma_rad)),
        squared(start.sigma_gyro_bias_rad_s),
        Matrix3::zeros(),
        squared(speed),
        squared(tuning.accelerometer_bias_sigma_m_s2),
    ]
}

/// The velocity at the first sample, m/s, by the forces from there to the foot's rest.
fn first_velocity(start: &StandingStart, heading_rad: f64, gravity_m_s2: f64) -> Vector3<f64> {
    if start.begins_s > LONGEST_BACK_S {
        return Vector3::zeros();
    }
    start.velocity_at_first(heading_rad, gravity_m_s2)
}

fn report(
    session: &SessionConfig,
    line: &FootLine,
    start: &StandingStart,
    first: &FirstHeading,
    events: &mut Vec<Event>,
) {
    let (t_start_ns, t_end_ns) = used(line, start);
    let rest_m_s2 = start.f_b.norm();
    events.push(Event::Aligned(Alignment {
        stream: line.side().stream(),
        t_start_ns,
        t_end_ns,
        heading_rad: first.rad,
        sigma_heading_rad: first.sigma_rad,
        heading_source: first.source,
        gyro_bias_b_rad_s: start.gyro_bias_b.into(),
        rest_specific_force_m_s2: rest_m_s2,
    }));
    let mut anomaly = |cause: &dyn Cause| {
        let samples = start.used.len() as u64;
        let stream = Some(line.side().stream());
        events.push(Event::Anomaly(cause.anomaly(stream, [t_start_ns, t_end_ns], samples)));
    };
    if !start.still {
        anomaly(&WalkCause::NoStillStart { wanted_still_s: WANTED_STILL_S });
    }
    let rate_hz = 1.0 / start.interval_s;
    if rate_hz < LEAST_RATE_HZ && start.used.len() > 2 {
        anomaly(&Contradiction::LowRate { rate_hz, least_hz: LEAST_RATE_HZ });
    }
    let gravity_m_s2 = session.gravity_m_s2;
    let impossible_m_s2 = if start.still { IMPOSSIBLE_REST_M_S2 } else { IMPOSSIBLE_FORCE_M_S2 };
    if (rest_m_s2 - gravity_m_s2).abs() > impossible_m_s2 {
        anomaly(&SensorCause::ImpossibleRestGravity { rest_m_s2, gravity_m_s2 });
    }
}

/// From when to when the standing start was, ns.
fn used(line: &FootLine, start: &StandingStart) -> (i64, i64) {
    (line.sample_ns(start.used.start), line.sample_ns(start.used.end.saturating_sub(1)))
}
