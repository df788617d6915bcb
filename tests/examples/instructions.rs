//! Runs the engine over one simulated walk, for an instruction counter: `make instructions`.
//!
//! Callgrind counts what happens inside [`run_session`] only, so the simulator costs nothing. A count
//! does not depend on what else the machine does, which a time does.

use lodestep_engine::event::Event;
use lodestep_engine::geo::Site;
use lodestep_engine::session::{Session, SessionConfig};
use lodestep_engine::sim::pedestrian::{SensorModel, Walk, WalkKind, simulate};
use lodestep_engine::systems::pedestrian::{self, Side};

#[expect(clippy::print_stdout, reason = "the figure is what it is run for")]
fn main() {
    let site = Site::fast();
    let walk = simulate(&WalkKind::Line { metres: 200.0 }, 1, &site, &SensorModel::cmp10a());
    let config = SessionConfig {
        initial_position_n_m: walk.start_n_m(),
        declination_rad: site.declination_deg.to_radians(),
        site_field: Some(site.field()),
        gravity_m_s2: site.gravity_m_s2,
        ..pedestrian::two_feet()
    };
    let points = run_session(config, &walk);
    println!("{} samples, {points} points", walk.left.len() + walk.right.len());
}

/// Two feet, every aid that a walk without markers allows; the name is what callgrind looks for.
#[inline(never)]
#[expect(clippy::unwrap_used, reason = "a preset that is refused is a fault of the program")]
fn run_session(config: SessionConfig, walk: &Walk) -> usize {
    let mut session = Session::new(config).unwrap();
    let mut events: Vec<Event> = Vec::new();
    let mut points = 0;
    for (left, right) in walk.left.iter().zip(&walk.right) {
        session.push(Side::Left, left, &mut events);
        session.push(Side::Right, right, &mut events);
        points += events.drain(..).filter(|event| matches!(event, Event::Point(_))).count();
    }
    session.finish(&mut events);
    points + events.iter().filter(|event| matches!(event, Event::Point(_))).count()
}
