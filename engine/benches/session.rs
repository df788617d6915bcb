//! What a sample of a two-footed walk costs with every aid: at most 0.8 µs is asked for, 2.0 µs smoothed, on one core;
//! and what a live marker costs.

use divan::counter::ItemsCount;
use lodestep_engine::event::Event;
use lodestep_engine::geo::Site;
use lodestep_engine::session::{Session, SessionConfig, Solution, Visit};
use lodestep_engine::sim::pedestrian::{SensorModel, Walk, WalkKind, simulate};
use lodestep_engine::systems::pedestrian;
use lodestep_engine::systems::pedestrian::Side;

fn main() {
    divan::main();
}

/// The rectangle of 1.4 km, some 20 minutes, and a visit to a made-up marker every 100 s.
fn rectangle() -> (SessionConfig, Walk, Vec<Visit>) {
    let site = Site::fast();
    let walk = simulate(&WalkKind::Rectangle, 1, &site, &SensorModel::cmp10a());
    let visits = walk
        .left
        .iter()
        .zip(&walk.truth)
        .step_by(10_000)
        .skip(1)
        .map(|(sample, [left, right])| {
            let middle = |axis: usize| 0.5 * (left.position_n_m[axis] + right.position_n_m[axis]);
            Visit {
                marker: format!("at {} ns", sample.t_ns),
                t_start_ns: sample.t_ns,
                t_end_ns: sample.t_ns,
                position_n_m: (middle(0), middle(1), Some(middle(2))),
            }
        })
        .collect();
    let config = SessionConfig {
        initial_position_n_m: walk.start_n_m(),
        declination_rad: site.declination_deg.to_radians(),
        site_field: Some(site.field()),
        gravity_m_s2: site.gravity_m_s2,
        ..pedestrian::two_feet()
    };
    (config, walk, visits)
}

#[divan::bench(sample_count = 10, sample_size = 1, args = ["filtered", "smoothed"])]
fn two_feet_all_aids(bencher: divan::Bencher<'_, '_>, solution: &str) {
    let (mut config, walk, visits) = rectangle();
    config.solution = if solution == "smoothed" { Solution::Smoothed } else { Solution::Filtered };
    let mut events: Vec<Event> = Vec::new();
    bencher.counter(ItemsCount::new(walk.left.len() + walk.right.len())).bench_local(|| {
        let mut session = Session::new(config.clone()).expect("streams of a walk");
        for visit in &visits {
            session.visit(visit.clone(), &mut events);
        }
        for (left, right) in walk.left.iter().zip(&walk.right) {
            session.push(Side::Left, left, &mut events);
            session.push(Side::Right, right, &mut events);
            events.clear();
        }
        session.finish_filter(&mut events);
        while session.smooth_next(&mut events) {
            events.clear();
        }
        assert!(session.summary().epochs > 0);
    });
}

/// What an inspector waits for who has keyed a marker in, 20 s late: the walk since then again, and the trail of
/// the last five minutes smoothed. At most a second is asked for.
#[divan::bench(sample_count = 10, sample_size = 1)]
fn a_marker_live_after_a_quarter_of_an_hour(bencher: divan::Bencher<'_, '_>) {
    let (mut config, walk, visits) = rectangle();
    config.solution = Solution::Trail;
    // The visits of every 100 s but the last: that of 900 s, told at 920 s.
    let walked = || {
        let mut session = Session::new(config.clone()).expect("streams of a walk");
        let mut events = Vec::new();
        for (number, (left, right)) in walk.left.iter().zip(&walk.right).take(92_000).enumerate() {
            session.push(Side::Left, left, &mut events);
            session.push(Side::Right, right, &mut events);
            if number % 10_000 == 2_000 && (12_000..92_000).contains(&number) {
                session.visit(visits[number / 10_000 - 1].clone(), &mut events);
            }
            events.clear();
        }
        session
    };
    let mut events = Vec::new();
    bencher.with_inputs(walked).bench_local_values(|mut session| {
        session.visit(visits[8].clone(), &mut events);
        assert!(matches!(events.last(), Some(Event::Revision { points }) if points.len() > 30_000));
        events.clear();
        session
    });
}
