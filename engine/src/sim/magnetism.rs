//! The magnetic field along a way: the site's, and small disturbances by iron in the ground.

use std::collections::HashMap;

use nalgebra::Vector3;

use super::random::{Purpose, Random};
use crate::geo::MagneticField;

/// Side of the cells in which disturbances are looked up, m.
const CELL_M: f64 = 8.0;

/// Iron in the ground: how strongly and how often a way is disturbed.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldAnomalies {
    /// Strength of each, µT; zero for none.
    pub strength_ut: f64,
    /// How far apart they are along the way, m.
    pub every_m: f64,
    /// Their 1σ half width, m: what is felt is about four times as wide.
    pub width_m: f64,
}

#[derive(Clone, Debug)]
struct Disturbance {
    centre_n_m: Vector3<f64>,
    field_n_ut: Vector3<f64>,
    /// 1/(2σ²), 1/m².
    falloff: f64,
}

/// The field of a way.
#[derive(Clone, Debug)]
pub(crate) struct Magnetism {
    undisturbed_n_ut: Vector3<f64>,
    disturbances: Vec<Disturbance>,
    /// Which disturbances are felt in a cell.
    cells: HashMap<(i32, i32), Vec<usize>>,
}

fn cell(position: &Vector3<f64>) -> (i32, i32) {
    (libm::floor(position.x / CELL_M) as i32, libm::floor(position.y / CELL_M) as i32)
}

impl Magnetism {
    /// Puts disturbances beside a way of this length, m, at about even distances; where the way comes back to a
    /// place, it meets those that are there. `place_n_m` is where the way is after so many metres.
    pub(crate) fn along(
        length_m: f64,
        place_n_m: impl Fn(f64) -> Vector3<f64>,
        field: MagneticField,
        anomalies: &FieldAnomalies,
        seed: u64,
    ) -> Magnetism {
        let mut magnetism = Magnetism {
            undisturbed_n_ut: Vector3::from(field.b_n_ut),
            disturbances: Vec::new(),
            cells: HashMap::new(),
        };
        if anomalies.strength_ut > 0.0 {
            magnetism.disturb(length_m, place_n_m, anomalies, seed);
        }
        magnetism
    }

    fn disturb(
        &mut self,
        length_m: f64,
        place_n_m: impl Fn(f64) -> Vector3<f64>,
        anomalies: &FieldAnomalies,
        seed: u64,
    ) {
        let mut random = Random::new(seed, Random::COMMON, Purpose::MagneticAnomalies);
        let every_m = anomalies.every_m;
        let count = libm::floor(length_m / every_m) as usize;
        for number in 1..=count {
            let along_m = every_m * (number as f64 + random.uniform(-0.3, 0.3));
            let aside =
                Vector3::new(random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.1));
            let sigma_m = anomalies.width_m * random.uniform(0.7, 1.3);
            let direction = Vector3::from(random.normal_3());
            let centre_n_m = place_n_m(along_m) + aside;
            let met_before =
                self.disturbances.iter().any(|other| (other.centre_n_m - centre_n_m).norm() < 0.35 * every_m);
            if met_before {
                continue;
            }
            let reach_m = 5.0 * sigma_m;
            let (west, south) = cell(&(centre_n_m - Vector3::new(reach_m, reach_m, 0.0)));
            let (east, north) = cell(&(centre_n_m + Vector3::new(reach_m, reach_m, 0.0)));
            for x in west..=east {
                for y in south..=north {
                    self.cells.entry((x, y)).or_default().push(self.disturbances.len());
                }
            }
            self.disturbances.push(Disturbance {
                centre_n_m,
                field_n_ut: direction * (anomalies.strength_ut / direction.norm()),
                falloff: 0.5 / (sigma_m * sigma_m),
            });
        }
    }

    /// Flux density at a place, in n, µT.
    pub(crate) fn at_n_ut(&self, position_n_m: &Vector3<f64>) -> Vector3<f64> {
        let mut field = self.undisturbed_n_ut;
        for &index in self.cells.get(&cell(position_n_m)).map_or(&[][..], Vec::as_slice) {
            let disturbance = &self.disturbances[index];
            let distance2 = (position_n_m - disturbance.centre_n_m).norm_squared();
            field += disturbance.field_n_ut * libm::exp(-distance2 * disturbance.falloff);
        }
        field
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_25_m_about_8_ut_and_the_site_s_field_between() {
        let northward = |along_m: f64| Vector3::new(0.0, along_m, 0.0);
        let site = MagneticField::from_angles(-2.45, 40.3, 48.1);
        let anomalies = FieldAnomalies { strength_ut: 8.0, every_m: 25.0, width_m: 1.0 };
        let field = Magnetism::along(1000.0, northward, site, &anomalies, 3);
        let off_ut: Vec<f64> = (0..10_000)
            .map(|i| {
                (field.at_n_ut(&Vector3::new(0.0, 0.1 * f64::from(i), 0.0)) - Vector3::from(site.b_n_ut))
                    .norm()
            })
            .collect();
        let peaks = off_ut.windows(3).filter(|w| w[1] > w[0] && w[1] >= w[2] && w[1] > 4.0).count();
        assert!((36..=40).contains(&peaks), "{peaks} peaks in a kilometre");
        let strongest = off_ut.iter().copied().fold(0.0, f64::max);
        assert!((7.0..8.5).contains(&strongest), "{strongest}");
        let clean = off_ut.iter().filter(|&&off| off < 0.1).count();
        assert!(clean > 6000, "{clean} of 10000 places are clean");
    }
}
