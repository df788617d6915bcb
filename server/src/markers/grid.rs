//! Which national grid a file's coordinates are of: the one that puts them at the site.

use lodestep_engine::geo::LocalFrame;
use lodestep_engine::geo::transverse_mercator::TransverseMercator;
use lodestep_engine::parse::any_table::AnyTable;
use lodestep_engine::parse::markers_csv::MarkerPlace;

use super::mapping::Mapping;
use super::rows::value_of;

/// A grid that puts the file's places farther from the site is not believed, m.
pub(super) const FARTHEST_M: f64 = 5_000.0;
/// … and farther than this, it is no grid of the file's at all, m.
const NO_GRID_M: f64 = 60_000.0;
/// No coordinate of a grid is larger: the zone stands before the easting in millions, m.
pub(super) const LARGEST_M: f64 = 1e8;
/// Coordinates of the site's own frame are smaller than those of a grid, m.
const LEAST_M: f64 = 100_000.0;
/// Rows by which the grid is found.
const JUDGED_BY: usize = 200;

/// A grid, and how the file writes it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Grid {
    /// Its name, with the zone.
    pub(super) name: String,
    pub(super) zone: TransverseMercator,
    /// Taken off the eastings: the zone before them, m.
    prefix_m: f64,
    /// The northing stands in the column of the mapping's east.
    swapped: bool,
    /// How far the file's places are from the site, m.
    pub(super) distance_m: f64,
}

/// The grid of a file whose coordinates are too large for the site's frame; `None` where they are not, or are of none.
pub(super) fn of(table: &AnyTable, mapping: Mapping, frame: &LocalFrame) -> Option<Grid> {
    let Mapping::Local { e_m, n_m, .. } = mapping else { return None };
    let pairs: Vec<[f64; 2]> = table
        .rows
        .iter()
        .take(JUDGED_BY)
        .filter_map(|row| Some([value_of(table, row, e_m)?, value_of(table, row, n_m)?]))
        .collect();
    let large = pairs.iter().filter(|pair| pair.iter().any(|value| value.abs() > LEAST_M)).count();
    if pairs.is_empty() || large * 10 < pairs.len() * 8 {
        return None;
    }
    let middle = |axis: usize| {
        let mut values: Vec<f64> = pairs.iter().map(|pair| pair[axis]).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let middles = [middle(0), middle(1)];
    let longitude_deg = frame.origin().longitude_deg;
    let mut candidates = Vec::new();
    for swapped in [false, true] {
        let [easting, northing] = if swapped { [middles[1], middles[0]] } else { middles };
        for (name, zone, number) in zones(longitude_deg) {
            let prefix_m = number * 1e6;
            for prefix_m in [0.0, prefix_m] {
                let [latitude_deg, longitude_deg] = zone.to_geodetic_deg(easting - prefix_m, northing);
                let at = MarkerPlace::Geodetic { latitude_deg, longitude_deg, height_m: None };
                let (e, n, _) = at.to_local_m(frame);
                let distance_m = e.hypot(n);
                if distance_m.is_finite() && distance_m < NO_GRID_M {
                    candidates.push(Grid { name: name.clone(), zone, prefix_m, swapped, distance_m });
                }
            }
        }
    }
    candidates.into_iter().min_by(|a, b| a.distance_m.total_cmp(&b.distance_m))
}

/// The zones around a longitude: CGCS2000 Gauss–Krüger in zones of 3° and 6°, and UTM, each with its number.
fn zones(longitude_deg: f64) -> Vec<(String, TransverseMercator, f64)> {
    let zone = |central_meridian_deg: f64, scale: f64| TransverseMercator {
        central_meridian_deg,
        scale,
        false_easting_m: 500_000.0,
    };
    let mut zones = Vec::new();
    for off in [-1.0, 0.0, 1.0] {
        let of_three = (longitude_deg / 3.0).round() + off;
        zones.push((
            format!("CGCS2000 / 3-degree Gauss-Kruger zone {of_three}"),
            zone(3.0 * of_three, 1.0),
            of_three,
        ));
        let of_six = ((longitude_deg + 3.0) / 6.0).round() + off;
        let meridian_deg = 6.0 * of_six - 3.0;
        zones.push((format!("CGCS2000 / Gauss-Kruger zone {of_six}"), zone(meridian_deg, 1.0), of_six));
        zones.push((
            format!("WGS 84 / UTM zone {}N", of_six + 30.0),
            zone(meridian_deg, 0.9996),
            of_six + 30.0,
        ));
    }
    zones
}

impl Grid {
    /// East, north and up in the site's frame, m, of what stands in the columns of the mapping's east and north.
    pub(super) fn to_local_m(
        &self,
        east: f64,
        north: f64,
        height_m: Option<f64>,
        frame: &LocalFrame,
    ) -> (f64, f64, Option<f64>) {
        let [easting, northing] = if self.swapped { [north, east] } else { [east, north] };
        let [latitude_deg, longitude_deg] = self.zone.to_geodetic_deg(easting - self.prefix_m, northing);
        // A small height can only be one above the site's origin.
        let origin_m = frame.origin().height_m;
        let of_origin = height_m.is_some_and(|height_m| height_m.abs() < 0.5 * origin_m.abs());
        let above_m = height_m.map(|height_m| if of_origin { height_m + origin_m } else { height_m });
        MarkerPlace::Geodetic { latitude_deg, longitude_deg, height_m: above_m }.to_local_m(frame)
    }
}

#[cfg(test)]
mod tests {
    use lodestep_engine::geo::Site;
    use lodestep_engine::parse::any_table;

    use super::*;

    #[test]
    fn a_grid_is_found_by_where_it_puts_the_places() {
        let site = Site::fast();
        let frame = site.local_frame();
        for (meridian_deg, scale, prefix, name) in [
            (108.0, 1.0, 36e6, "3-degree Gauss-Kruger zone 36"),
            (108.0, 1.0, 0.0, "3-degree Gauss-Kruger zone 36"),
            (105.0, 0.9996, 0.0, "UTM zone 48N"),
        ] {
            let zone =
                TransverseMercator { central_meridian_deg: meridian_deg, scale, false_easting_m: 500_000.0 };
            let place = frame.to_geodetic([120.0, -80.0, 0.0]);
            let [e, n] = zone.to_plane_m(place.latitude_deg, place.longitude_deg);
            for (header, first, second) in [
                ("name,e_m,n_m", e + prefix, n),
                ("name,n_m,e_m", n, e + prefix),
                ("name,n_m,e_m", e + prefix, n),
            ] {
                let table = any_table::read(format!("{header}\nA,{first},{second}\n").as_bytes()).unwrap();
                let mapping = Mapping::guess(&table.columns).unwrap();
                let grid = of(&table, mapping, &frame).unwrap();
                assert!(grid.name.ends_with(name), "{grid:?}");
                let (_, [e_at, n_at], _) = mapping.columns();
                let at = |column: usize| table.rows[0].cells[column].parse::<f64>().unwrap();
                let (e, n, _) = grid.to_local_m(at(e_at), at(n_at), None, &frame);
                assert!((e - 120.0).abs() < 0.01 && (n + 80.0).abs() < 0.01, "{e} {n}");
            }
        }
        let local = any_table::read(b"name,e_m,n_m\nA,10,20\n").unwrap();
        assert_eq!(of(&local, Mapping::guess(&local.columns).unwrap(), &frame), None);
    }
}
