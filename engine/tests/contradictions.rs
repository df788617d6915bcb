//! Sensors that contradict each other: each is told of, and the sigma covers what it means for the track.

#![allow(clippy::unwrap_used, reason = "tests")]

use lodestep_engine::geo::Site;
use lodestep_engine::sample::ImuSample;
use lodestep_engine::session::{Session, SessionConfig};
use lodestep_engine::sim::pedestrian::{SensorModel, Walk, WalkKind, simulate};
use lodestep_engine::systems::pedestrian::{self, Side};
use lodestep_engine::track::Track;

/// What is done to a sample of a foot: its number, its time in seconds.
type Change = fn(usize, f64, ImuSample) -> Option<ImuSample>;

fn walk() -> Walk {
    simulate(&WalkKind::Line { metres: 30.0 }, 1, &Site::fast(), &SensorModel::cmp10a())
}

/// The walk with its samples changed.
fn told(walk: &Walk, change: Change) -> Track {
    let site = Site::fast();
    let config = SessionConfig {
        initial_position_n_m: walk.start_n_m(),
        gravity_m_s2: site.gravity_m_s2,
        declination_rad: site.declination_deg.to_radians(),
        magnetic_field: Some(site.magnetic_field()),
        ..pedestrian::two_feet()
    };
    let mut session = Session::new(config).unwrap();
    let mut events = Vec::new();
    for (left, right) in walk.left.iter().zip(&walk.right) {
        for (foot, sample) in [(Side::Left, left), (Side::Right, right)] {
            let changed = change(foot as usize, sample.t_ns as f64 * 1e-9, *sample);
            changed.iter().for_each(|sample| session.push(foot, sample, &mut events));
        }
    }
    session.finish(&mut events);
    let mut track = Track::default();
    events.into_iter().for_each(|event| track.take(event));
    track
}

fn kinds(track: &Track) -> Vec<&str> {
    let mut kinds: Vec<&str> = track.anomalies.iter().map(|anomaly| anomaly.kind.as_str()).collect();
    kinds.sort_unstable();
    kinds.dedup();
    kinds
}

/// Errors in plan and height at the end, each over the sigma that was told, and the sigma in plan, m.
fn end(walk: &Walk, track: &Track) -> (f64, f64, f64) {
    let (point, truth) = (track.points.last().unwrap(), walk.truth.last().unwrap());
    let off = |axis: usize| {
        let middle_m = 0.5 * (truth[0].position_n_m[axis] + truth[1].position_n_m[axis]);
        point.position_n_m[axis] - middle_m
    };
    let sigma_m = point.sigma_n_m[0].hypot(point.sigma_n_m[1]);
    (off(0).hypot(off(1)) / sigma_m, off(2).abs() / point.sigma_n_m[2], sigma_m)
}

#[test]
fn a_sound_walk_has_nothing_to_tell_and_a_small_sigma() {
    let walk = walk();
    let track = told(&walk, |_, _, sample| Some(sample));
    assert_eq!(kinds(&track), Vec::<&str>::new());
    let (plan, height, sigma_m) = end(&walk, &track);
    assert!(plan < 3.0 && height < 3.0 && sigma_m < 2.0, "{plan} {height} {sigma_m}");
}

#[test]
fn each_contradiction_is_told_and_the_sigma_covers_it() {
    let cases: [(&str, &str, Change); 7] = [
        ("a force of the opposite sign", "wrong_mounting", |_, _, mut s| {
            s.f_b_m_s2 = s.f_b_m_s2.map(|f| -f);
            Some(s)
        }),
        ("a field of the opposite sign", "wrong_mounting", |_, _, mut s| {
            s.mag_b_ut = s.mag_b_ut.map(|mag| mag.map(|b| -b));
            Some(s)
        }),
        ("a field in other axes", "magnetic_field", |_, _, mut s| {
            s.mag_b_ut = s.mag_b_ut.map(|[x, y, z]| [y, x, -z]);
            Some(s)
        }),
        ("no heading at all", "heading_uncertain", |_, _, mut s| {
            s.mag_b_ut = None;
            Some(s)
        }),
        ("every fifth sample alone", "low_rate", |_, t_s, s| {
            ((t_s * 100.0).round() as i64 % 5 == 0).then_some(s)
        }),
        ("a pressure that says 16 m higher", "height_contradicted", |_, t_s, mut s| {
            // The pressure of 16 m more from the middle of the walk on.
            let risen_m = if t_s > 26.0 { 16.0 } else { 0.0 };
            s.pressure_hpa = s.pressure_hpa.map(|hpa| hpa - 0.108 * risen_m);
            Some(s)
        }),
        ("wild readings", "spikes", |foot, t_s, mut s| {
            if (t_s * 100.0).round() as usize % 200 == 120 + foot {
                s.w_ib_b_rad_s = [30.0, -30.0, 30.0];
                s.f_b_m_s2 = [-150.0, 150.0, 150.0];
            }
            Some(s)
        }),
    ];
    let walk = walk();
    for (what, kind, change) in cases {
        let track = told(&walk, change);
        assert!(kinds(&track).contains(&kind), "{what}: {:?}", kinds(&track));
        let (plan, height, _) = end(&walk, &track);
        // Where the pressure alone has changed the walker has not risen: the sigma says that this may be.
        assert!(plan < 4.0 && height < 5.0, "{what}: {plan} and {height} sigmas off");
    }
}

#[test]
fn wild_readings_are_mended_and_cost_nothing() {
    let walk = walk();
    let sound = told(&walk, |_, _, sample| Some(sample));
    let wild = told(&walk, |foot, t_s, mut s| {
        if (t_s * 100.0).round() as usize % 200 == 120 + foot {
            s.w_ib_b_rad_s = [30.0, -30.0, 30.0];
            s.f_b_m_s2 = [-150.0, 150.0, 150.0];
        }
        Some(s)
    });
    let off = (0..2).map(|axis| {
        let at = |track: &Track| track.points.last().unwrap().position_n_m[axis];
        (at(&sound) - at(&wild)).abs()
    });
    assert!(off.fold(0.0, f64::max) < 0.5);
}
