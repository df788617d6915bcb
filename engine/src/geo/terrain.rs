//! What stands and lies beneath the reflector in the demo: anchors, ground, road and towers.
//!
//! The surveyed coordinates of FAST's actuator anchors are its own. For demo and tests each node is
//! moved outward along its radius by the actuator's length and a tie-down whose length follows the
//! published statistics: 2 m in the middle of the bowl, tens of metres near the rim, where the
//! ground falls away from the net in some directions and not in others.

use nalgebra::Vector3;

use super::dome::{Node, SPHERE_RADIUS_M, nodes, plan_to_local};
use super::site::Site;

/// Length of an actuator's body, m.
const ACTUATOR_M: f64 = 1.98;

/// Tie-down length on the steep side by plan radius of the node: pairs of (m, m).
const TIE_DOWN_M: [(f64, f64); 8] = [
    (0.0, 2.0),
    (150.0, 2.1),
    (175.0, 2.4),
    (187.5, 3.9),
    (206.0, 8.0),
    (226.0, 15.0),
    (240.5, 28.0),
    (248.4, 44.0),
];

/// Plan radius of the node surface above the road's beginning and at its end, m.
const ROAD_RHO_M: (f64, f64) = (20.0, 229.0);
/// Turns that the road takes from the first to the second: with them it is 3.3 km long.
const ROAD_TURNS: f64 = 4.18;
/// Azimuth at which the road begins, clockwise from the plan's +y, rad.
const ROAD_START_RAD: f64 = std::f64::consts::PI;

/// An actuator's ground anchor: what inspectors use as a marker.
#[derive(Clone, Debug, PartialEq)]
pub struct Anchor {
    /// The node's name.
    pub name: String,
    /// East, north, up in the site's local frame, m.
    pub position_n_m: [f64; 3],
}

/// A demo tower of the feed support; the names at the odd hours of the clock are not verified.
#[derive(Clone, Debug, PartialEq)]
pub struct Tower {
    /// `1H (demo)` to `11H (demo)`.
    pub name: String,
    /// East and north in the site's local frame, m.
    pub position_n_m: [f64; 2],
}

/// Length by which the ground lies beyond the node surface, along the radius, m.
fn depth_m(rho_m: f64, azimuth: f64) -> f64 {
    let above = TIE_DOWN_M.partition_point(|&(rho, _)| rho <= rho_m).clamp(1, TIE_DOWN_M.len() - 1);
    let ((rho_0, tie_0), (rho_1, tie_1)) = (TIE_DOWN_M[above - 1], TIE_DOWN_M[above]);
    let steep = tie_0 + (rho_m - rho_0) / (rho_1 - rho_0) * (tie_1 - tie_0);
    // Some sides of the depression are steep, some meet the net: smooth in azimuth, 0.08 to 1.12.
    let side = 0.60 + 0.34 * libm::sin(2.0 * azimuth + 0.6) + 0.18 * libm::sin(3.0 * azimuth - 1.1);
    ACTUATOR_M + 2.0 + (steep - 2.0) * side
}

/// The ground below the point of the node surface with this plan radius and azimuth, in the plan.
fn ground_plan_m(rho_m: f64, azimuth: f64) -> Vector3<f64> {
    let (sin, cos) = libm::sincos(azimuth);
    let z = -libm::sqrt(SPHERE_RADIUS_M * SPHERE_RADIUS_M - rho_m * rho_m);
    Vector3::new(rho_m * sin, rho_m * cos, z) * (1.0 + depth_m(rho_m, azimuth) / SPHERE_RADIUS_M)
}

/// The anchors of all nodes, in the order of their names.
pub fn anchors(site: &Site) -> Vec<Anchor> {
    let level = Site { azimuth_of_plan_deg: 0.0, ..site.clone() };
    nodes(&level)
        .into_iter()
        .map(|Node { name, position_n_m: [x, y, _], .. }| {
            let ground = ground_plan_m(libm::hypot(x, y), libm::atan2(x, y));
            Anchor { name, position_n_m: plan_to_local(site, ground) }
        })
        .collect()
}

/// The inspection road's centre line: a spiral on the ground from the middle outward, a point about
/// every `spacing_m` metres, east-north-up, m.
pub fn road(site: &Site, spacing_m: f64) -> Vec<[f64; 3]> {
    let turn = std::f64::consts::TAU * ROAD_TURNS;
    let (inner, outer) = ROAD_RHO_M;
    let mut points = Vec::new();
    let mut angle = 0.0;
    while angle < turn {
        let rho = inner + (outer - inner) * angle / turn;
        points.push(plan_to_local(site, ground_plan_m(rho, ROAD_START_RAD + angle)));
        angle += spacing_m / libm::hypot(rho, (outer - inner) / turn);
    }
    points.push(plan_to_local(site, ground_plan_m(outer, ROAD_START_RAD + turn)));
    points
}

/// Six demo towers around the reflector.
pub fn towers(site: &Site) -> Vec<Tower> {
    const RADIUS_M: f64 = 300.0;
    [1, 3, 5, 7, 9, 11]
        .into_iter()
        .map(|hour| {
            let (sin, cos) = libm::sincos((f64::from(hour) * 30.0).to_radians());
            let [e, n, _] = plan_to_local(site, Vector3::new(RADIUS_M * sin, RADIUS_M * cos, 0.0));
            Tower { name: format!("{hour}H (demo)"), position_n_m: [e, n] }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn length_m(points: &[[f64; 3]]) -> f64 {
        points.windows(2).map(|w| (Vector3::from(w[1]) - Vector3::from(w[0])).norm()).sum()
    }

    #[test]
    fn anchors_lie_outside_the_net_within_the_known_lengths() {
        let site = Site::fast();
        let (nodes, anchors) = (nodes(&site), anchors(&site));
        assert_eq!(anchors.len(), 2226);
        let centre = Vector3::new(0.0, 0.0, SPHERE_RADIUS_M);
        let mut ties = Vec::new();
        for (node, anchor) in nodes.iter().zip(&anchors) {
            assert_eq!(node.name, anchor.name);
            let (a, b) =
                (Vector3::from(node.position_n_m) - centre, Vector3::from(anchor.position_n_m) - centre);
            assert!(a.cross(&b).norm() < 1e-6 * a.norm() * b.norm(), "{} is off its radius", node.name);
            ties.push(b.norm() - a.norm() - ACTUATOR_M);
        }
        ties.sort_by(f64::total_cmp);
        assert!((1.9..2.1).contains(&ties[0]), "{}", ties[0]);
        assert!((2.2..4.5).contains(&ties[ties.len() / 2]), "median {}", ties[ties.len() / 2]);
        assert!((35.0..50.0).contains(ties.last().unwrap()), "largest {}", ties.last().unwrap());
    }

    #[test]
    fn anchors_are_ten_metres_apart() {
        let anchors = anchors(&Site::fast());
        let mut nearest: Vec<f64> = anchors
            .iter()
            .map(|a| {
                anchors
                    .iter()
                    .filter(|b| b.name != a.name)
                    .map(|b| {
                        libm::hypot(
                            a.position_n_m[0] - b.position_n_m[0],
                            a.position_n_m[1] - b.position_n_m[1],
                        )
                    })
                    .fold(f64::MAX, f64::min)
            })
            .collect();
        nearest.sort_by(f64::total_cmp);
        assert!((9.5..10.5).contains(&nearest[nearest.len() / 2]), "{}", nearest[nearest.len() / 2]);
    }

    #[test]
    fn the_road_is_a_walkable_spiral() {
        let road = road(&Site::fast(), 1.0);
        let length = length_m(&road);
        assert!((3300.0..3400.0).contains(&length), "{length}");
        let radius = |p: &[f64; 3]| libm::hypot(p[0], p[1]);
        assert!((19.0..21.0).contains(&radius(&road[0])));
        assert!((235.0..245.0).contains(&radius(road.last().unwrap())), "{}", radius(road.last().unwrap()));
        let steepest = road
            .windows(20)
            .map(|w| ((w[19][2] - w[0][2]) / libm::hypot(w[19][0] - w[0][0], w[19][1] - w[0][1])).abs())
            .fold(0.0, f64::max);
        assert!(steepest < 0.2, "steepest {steepest}");
    }

    #[test]
    fn six_towers_at_the_odd_hours() {
        let towers = towers(&Site::fast());
        assert_eq!(towers.len(), 6);
        assert_eq!(towers[1].name, "3H (demo)");
        assert!((towers[1].position_n_m[0] - 300.0).abs() < 1e-9 && towers[1].position_n_m[1].abs() < 1e-9);
    }
}
