//! The marker database with an index by place.

use std::collections::BTreeMap;

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

/// A surveyed anchor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Marker {
    /// Its name.
    pub name: String,
    /// East, north and, where it was surveyed, up, m.
    pub position_n_m: (f64, f64, Option<f64>),
}

/// Side of a cell of the index, m.
const CELL_M: f64 = 20.0;

/// Markers that can be asked for by place; written as a list.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "Vec<Marker>", into = "Vec<Marker>")]
pub struct Markers {
    all: Vec<Marker>,
    cells: BTreeMap<(i64, i64), Vec<usize>>,
}

impl From<Vec<Marker>> for Markers {
    fn from(all: Vec<Marker>) -> Markers {
        Markers::new(all)
    }
}

impl From<Markers> for Vec<Marker> {
    fn from(markers: Markers) -> Vec<Marker> {
        markers.all
    }
}

impl Markers {
    /// An index of these.
    pub fn new(all: Vec<Marker>) -> Markers {
        let mut cells: BTreeMap<(i64, i64), Vec<usize>> = BTreeMap::new();
        for (number, marker) in all.iter().enumerate() {
            cells.entry(cell(marker.position_n_m.0, marker.position_n_m.1)).or_default().push(number);
        }
        Markers { all, cells }
    }

    /// All of them.
    pub fn all(&self) -> &[Marker] {
        &self.all
    }

    /// The marker of this number.
    pub(crate) fn get(&self, number: usize) -> &Marker {
        &self.all[number]
    }

    /// The number of the marker of this name.
    pub(crate) fn find(&self, name: &str) -> Option<usize> {
        self.all.iter().position(|marker| marker.name == name)
    }

    /// The numbers of those within a distance in plan of a place.
    pub(crate) fn near(&self, place_m: &Vector2<f64>, within_m: f64) -> Vec<usize> {
        // No reach is wider than a site: a position that has gone astray must not walk all cells.
        let within_m = within_m.min(1_000.0);
        let (from_e, from_n) = cell(place_m.x - within_m, place_m.y - within_m);
        let (to_e, to_n) = cell(place_m.x + within_m, place_m.y + within_m);
        let mut found: Vec<usize> = (from_e..=to_e)
            .flat_map(|e| (from_n..=to_n).map(move |n| (e, n)))
            .filter_map(|key| self.cells.get(&key))
            .flatten()
            .copied()
            .filter(|&number| {
                let (e_m, n_m, _) = self.all[number].position_n_m;
                libm::hypot(e_m - place_m.x, n_m - place_m.y) <= within_m
            })
            .collect();
        found.sort_unstable();
        found
    }
}

fn cell(e_m: f64, n_m: f64) -> (i64, i64) {
    (libm::floor(e_m / CELL_M) as i64, libm::floor(n_m / CELL_M) as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_index_finds_what_a_search_of_all_finds() {
        // Turns of a spiral, a few metres from one to the next.
        let all: Vec<Marker> = (0..2000)
            .map(|k| {
                let (turn, radius_m) = (0.3 * f64::from(k), 5.0 * f64::from(k).sqrt());
                let position_n_m = (radius_m * turn.cos(), radius_m * turn.sin(), None);
                Marker { name: format!("A{k}"), position_n_m }
            })
            .collect();
        let markers = Markers::new(all.clone());
        for (place, within_m) in [((3.0, -4.0), 12.0), ((-200.0, 80.0), 33.0), ((999.0, 0.0), 5.0)] {
            let place = Vector2::new(place.0, place.1);
            let slow: Vec<usize> = (0..all.len())
                .filter(|&k| {
                    let (e, n, _) = all[k].position_n_m;
                    (Vector2::new(e, n) - place).norm() <= within_m
                })
                .collect();
            assert_eq!(markers.near(&place, within_m), slow);
        }
        assert_eq!(markers.find("A112").map(|k| markers.get(k).name.as_str()), Some("A112"));
    }
}
