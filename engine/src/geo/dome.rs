//! FAST's reflector as a geodesic dome: the 2,226 nodes of its cable net.
//!
//! The nodes follow from the construction that the published node table (problem A of the 2021
//! Chinese mathematical modelling contest) obeys to its last printed millimetre: an icosahedron in a
//! sphere of 300.4 m with one vertex at the nadir, its five lowest faces bisected five times, each
//! midpoint pushed back to the sphere, and the rim cut off.
//!
//! Two frames: the *plan* has its origin in the sphere's centre, z up, and +y at
//! [`Site::azimuth_of_plan_deg`](super::Site) from true north; the site's local frame n is
//! east-north-up with `u` = 0 at the lowest node, `u = z + 300.4 m`.

use nalgebra::Vector3;

use super::site::Site;

/// Radius of the sphere on which the nodes lie, m.
pub const SPHERE_RADIUS_M: f64 = 300.4;
/// Radius of the ring beam from which the net hangs, m.
pub const RING_RADIUS_M: f64 = 250.0;
/// Azimuths of the five sector axes, clockwise from the plan's +y, degrees. A sector reaches from
/// its own axis to the next: A from −36° to 36°.
pub const SECTOR_AXES_DEG: [(char, f64); 5] =
    [('A', -36.0), ('B', 36.0), ('C', 108.0), ('D', 180.0), ('E', 252.0)];

/// Rows into which five bisections divide a face of the icosahedron.
const LATTICE: usize = 32;

/// One node of the cable net.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// `A0` at the bottom, then `A1` to `E446`; 431 is missing in each sector.
    pub name: String,
    /// The sector's letter (`A` for the lowest node).
    pub sector: char,
    /// East, north, up in the site's local frame, m.
    pub position_n_m: [f64; 3],
}

/// All nodes in the order of their names: `A0`, `A1` … `A446`, `B1` … `E446`.
pub fn nodes(site: &Site) -> Vec<Node> {
    let mut nodes =
        vec![Node { name: "A0".to_owned(), sector: 'A', position_n_m: plan_to_local(site, lowest()) }];
    for (sector, axis_deg) in SECTOR_AXES_DEG {
        let face = bisected_face(axis_deg);
        for (row, points) in face.iter().enumerate().take(31).skip(1) {
            // The last point of a row is the first of the next sector's.
            for (j, &point) in points.iter().enumerate().take(row) {
                if let Some(number) = node_number(row, j) {
                    nodes.push(Node {
                        name: format!("{sector}{number}"),
                        sector,
                        position_n_m: plan_to_local(site, point),
                    });
                }
            }
        }
    }
    nodes
}

/// The number of the node at place `j` of a row of its sector; `None` beyond the rim.
fn node_number(row: usize, j: usize) -> Option<usize> {
    match row {
        1..=28 => Some(row * (row - 1) / 2 + 1 + j),
        29 if (3..=26).contains(&j) => Some(407 + j - 3),
        30 if (8..=22).contains(&j) => Some(432 + j - 8),
        _ => None,
    }
}

/// Turns a point of the plan (m, origin in the sphere's centre) into the site's local frame, m.
pub fn plan_to_local(site: &Site, plan_m: Vector3<f64>) -> [f64; 3] {
    let (sin, cos) = libm::sincos(site.azimuth_of_plan_deg.to_radians());
    [plan_m.x * cos + plan_m.y * sin, plan_m.y * cos - plan_m.x * sin, plan_m.z + SPHERE_RADIUS_M]
}

/// The point of the sphere at an azimuth clockwise from +y and an angle from the nadir, rad.
fn on_sphere(azimuth: f64, from_nadir: f64) -> Vector3<f64> {
    let (sin_az, cos_az) = libm::sincos(azimuth);
    let (sin, cos) = libm::sincos(from_nadir);
    SPHERE_RADIUS_M * Vector3::new(sin * sin_az, sin * cos_az, -cos)
}

fn lowest() -> Vector3<f64> {
    Vector3::new(0.0, 0.0, -SPHERE_RADIUS_M)
}

/// The face between a sector's axis and the next, as rows r = 0 … 32 of r + 1 points.
fn bisected_face(axis_deg: f64) -> Vec<Vec<Vector3<f64>>> {
    let mut face: Vec<Vec<Vector3<f64>>> = (0..=LATTICE).map(|r| vec![Vector3::zeros(); r + 1]).collect();
    // Neighbouring vertices of an icosahedron are acos(1/√5) apart as seen from the centre.
    let side = libm::acos(1.0 / libm::sqrt(5.0));
    face[0][0] = lowest();
    face[LATTICE][0] = on_sphere(axis_deg.to_radians(), side);
    face[LATTICE][LATTICE] = on_sphere((axis_deg + 72.0).to_radians(), side);
    let mut h = LATTICE / 2;
    while h > 0 {
        for r in (0..=LATTICE).step_by(h) {
            for j in (0..=r).step_by(h) {
                let between = match (r / h % 2, j / h % 2) {
                    (1, 0) => face[r - h][j] + face[r + h][j],
                    (0, 1) => face[r][j - h] + face[r][j + h],
                    (1, 1) => face[r - h][j - h] + face[r + h][j + h],
                    _ => continue,
                };
                face[r][j] = between * (SPHERE_RADIUS_M / between.norm());
            }
        }
        h /= 2;
    }
    face
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    fn plan_radius(node: &Node) -> f64 {
        libm::hypot(node.position_n_m[0], node.position_n_m[1])
    }

    fn neighbours(nodes: &[Node]) -> Vec<(usize, usize, f64)> {
        // Net edges are 10.4 to 12.4 m long; the next distance in a triangular lattice is √3 times that.
        let mut edges = Vec::new();
        for a in 0..nodes.len() {
            for b in a + 1..nodes.len() {
                let length =
                    (Vector3::from(nodes[a].position_n_m) - Vector3::from(nodes[b].position_n_m)).norm();
                if length < 14.0 {
                    edges.push((a, b, length));
                }
            }
        }
        edges
    }

    #[test]
    fn names_and_counts() {
        let nodes = nodes(&Site::fast());
        assert_eq!(nodes.len(), 2226);
        let names: HashSet<&str> = nodes.iter().map(|node| node.name.as_str()).collect();
        assert_eq!(names.len(), 2226);
        for sector in ["A", "B", "C", "D", "E"] {
            assert!(!names.contains(format!("{sector}431").as_str()));
            assert!((1..=446).filter(|n| names.contains(format!("{sector}{n}").as_str())).count() == 445);
        }
        assert_eq!(nodes[0].name, "A0");
        assert_eq!(nodes.last().unwrap().name, "E446");
    }

    #[test]
    fn the_nets_edges_and_panels() {
        let nodes = nodes(&Site::fast());
        let edges = neighbours(&nodes);
        assert_eq!(edges.len(), 6525);
        let (least, most, sum) = edges.iter().fold((f64::MAX, 0.0_f64, 0.0), |(a, b, s), &(_, _, length)| {
            (a.min(length), b.max(length), s + length)
        });
        assert!((least - 10.39).abs() < 0.006 && (most - 12.42).abs() < 0.006, "{least} {most}");
        assert!((sum / edges.len() as f64 - 11.39).abs() < 0.006);
        let joined: HashSet<(usize, usize)> = edges.iter().map(|&(a, b, _)| (a, b)).collect();
        let panels = edges
            .iter()
            .map(|&(a, b, _)| {
                (b + 1..nodes.len()).filter(|&c| joined.contains(&(a, c)) && joined.contains(&(b, c))).count()
            })
            .sum::<usize>();
        assert_eq!(panels, 4300);
    }

    #[test]
    fn bottom_rim_and_sectors() {
        let nodes = nodes(&Site::fast());
        assert_eq!(nodes[0].position_n_m, [0.0, 0.0, 0.0]);
        let rim = nodes.iter().map(plan_radius).fold(0.0, f64::max);
        assert!(rim <= 248.35 && rim > 248.2, "{rim}");
        let highest = nodes.iter().map(|node| node.position_n_m[2]).fold(0.0, f64::max);
        assert!((highest - (300.4 - 169.0)).abs() < 0.1, "{highest}");
        for node in nodes.iter().skip(1) {
            let (_, axis) = SECTOR_AXES_DEG.into_iter().find(|&(sector, _)| sector == node.sector).unwrap();
            let azimuth = libm::atan2(node.position_n_m[0], node.position_n_m[1]).to_degrees();
            let past_axis = (azimuth - axis + 360.0 + 1e-9) % 360.0;
            assert!(past_axis < 72.0, "{} is {past_axis}° past its axis", node.name);
        }
        // Names run clockwise: B is A turned by 72° clockwise.
        let position = |name: &str| nodes.iter().find(|node| node.name == name).unwrap().position_n_m;
        let (a, b) = (position("A200"), position("B200"));
        let (sin, cos) = libm::sincos(72f64.to_radians());
        assert!((a[0] * cos + a[1] * sin - b[0]).abs() < 1e-9 && (a[2] - b[2]).abs() < 1e-9);
    }

    #[test]
    fn the_plan_can_be_turned() {
        let site = Site { azimuth_of_plan_deg: 90.0, ..Site::fast() };
        // +y of the plan points east when its azimuth is 90°.
        let [e, n, _] = plan_to_local(&site, Vector3::new(0.0, 1.0, 0.0));
        assert!((e - 1.0).abs() < 1e-12 && n.abs() < 1e-12);
    }
}
