//! Hours of a walk: the covariance stays positive definite, what a session holds does not grow, and a marker late in the day
//! makes no more work than one in the morning.

use nalgebra::DMatrix;

use super::{Session, SessionConfig, Solution};
use crate::event::Event;
use crate::geo::Site;
use crate::replay::history::Held;
use crate::sim::pedestrian::{SensorModel, Simulator, WalkKind};
use crate::systems::pedestrian::system::{Filters, Pedestrian};
use crate::systems::pedestrian::{self, Side};
use crate::visit::Visit;

/// What was seen of a session at one time.
struct Seen {
    held: Held,
    /// The smallest eigenvalue of the covariance scaled to correlations.
    smallest: f64,
    symmetric: bool,
}

/// A live session of `hours`, looked at ten times, a marker every five minutes, told 20 s late.
fn live(hours: f64, seed: u64) -> Vec<Seen> {
    let site = Site::fast();
    let kind = WalkKind::Line { metres: hours * 3600.0 * 1.25 };
    let mut simulator = Simulator::new(&kind, seed, &site, &SensorModel::cmp10a());
    let mut session = Session::new(SessionConfig {
        initial_position_n_m: simulator.start_n_m(),
        declination_rad: site.declination_deg.to_radians(),
        site_field: Some(site.field()),
        gravity_m_s2: site.gravity_m_s2,
        solution: Solution::Trail,
        max_lead_ns: Some(1_000_000_000),
        ..pedestrian::two_feet()
    })
    .unwrap();
    let (mut events, mut seen, mut late) = (Vec::new(), Vec::new(), None);
    let look_every = (hours * 36_000.0) as u64;
    for number in 1.. {
        let Some(epoch) = simulator.next_epoch() else { break };
        let [left, right] = epoch.samples;
        session.push(Side::Left, &left, &mut events);
        session.push(Side::Right, &right, &mut events);
        if number % 30_000 == 0 {
            let middle =
                |axis: usize| 0.5 * (epoch.truth[0].position_n_m[axis] + epoch.truth[1].position_n_m[axis]);
            late = Some(Visit {
                marker: format!("after {} s", epoch.t_ns / 1_000_000_000),
                t_start_ns: epoch.t_ns,
                t_end_ns: epoch.t_ns,
                position_n_m: (middle(0), middle(1), Some(middle(2))),
            });
        }
        if number % 30_000 == 2_000
            && let Some(visit) = late.take()
        {
            session.visit(visit, &mut events);
        }
        events.retain(|event| matches!(event, Event::Visit(_)));
        if number % look_every == 0 {
            seen.push(look(&mut session));
        }
    }
    assert!(events.iter().all(|event| matches!(event, Event::Visit(visit) if visit.accepted)), "{events:?}");
    assert_eq!(session.summary().late_samples, 0);
    seen
}

fn look(session: &mut Session) -> Seen {
    let walk: &mut Pedestrian = session.system.as_any().unwrap().downcast_mut().unwrap();
    let Filters::TwoFeet(history) = walk.filters() else { panic!("two feet walk") };
    let covariance = history.filter().eskf.covariance.dense();
    let size = covariance.nrows();
    let scaled = DMatrix::from_fn(size, size, |i, j| {
        covariance[(i, j)] / (covariance[(i, i)] * covariance[(j, j)]).sqrt()
    });
    Seen {
        held: history.held(),
        smallest: scaled.symmetric_eigenvalues().min(),
        symmetric: covariance == covariance.transpose(),
    }
}

#[track_caller]
fn assert_steady(seen: &[Seen]) {
    for seen in seen {
        assert!(seen.symmetric && seen.smallest > 0.0, "smallest eigenvalue {}", seen.smallest);
        // Five minutes of trail and up to two stretches of two feet at 100 Hz: a marker makes that much be run
        // again, and gone back over, whenever it comes.
        assert!(seen.held.inputs <= (300 + 2 * 64) * 200, "{:?}", seen.held);
        assert!(seen.held.checkpoints <= 20, "{:?}", seen.held);
        assert!(seen.held.stretches <= 8, "{:?}", seen.held);
    }
}

#[test]
fn twelve_minutes_hold_no_more_than_the_trail_and_the_covariance_stays_positive_definite() {
    let seen = live(0.2, 1);
    assert!(seen.len() >= 9);
    assert_steady(&seen);
}

/// Some minutes: `cargo test --release -p lodestep-engine --lib -- --ignored eight_hours`.
#[test]
#[ignore = "takes minutes"]
fn eight_hours_of_three_walkers_hold_no_more_than_the_trail_and_the_covariance_stays_positive_definite() {
    for seed in 1..=3 {
        assert_steady(&live(8.0, seed));
    }
}
