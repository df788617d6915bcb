//! The rows of a file of markers, read by a mapping; each that cannot be read is a finding.

use std::collections::HashMap;

use lodestep_engine::geo::LocalFrame;
use lodestep_engine::parse::any_table::{AnyRow, AnyTable};
use lodestep_engine::parse::markers_csv::MarkerPlace;
use lodestep_engine::parse::surveyed::Packed;
use lodestep_engine::parse::{names, surveyed};

use super::defect::Defect;
use super::edit::{FARTHEST_M, NAME_LENGTH, checked_name};
use super::finding::{Findings, Level};
use super::grid;
use super::mapping::{Mapping, metres_in};
use crate::store::markers::Place;

/// The share of a file's rows that makes a finding one of the whole file.
const MOST: f64 = 0.8;
/// A place of the site is nearer to it than this, degrees: some 50 km.
const NEAR_DEG: f64 = 0.5;

/// Columns that say how sure a place is, m: those of a survey.
const SIGMAS: [&str; 3] = ["sigma_e_m", "sigma_n_m", "sigma_u_m"];

/// One marker of a file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Row {
    /// The line, counted from 1.
    pub(super) line: u64,
    /// Its name.
    pub(super) name: String,
    /// Where the file has it, in the site's frame.
    pub(super) place: Place,
    /// How sure the file says that is, east, north and up, m.
    pub(super) sigma_m: Option<[f64; 3]>,
}

/// Reads the rows.
pub(super) fn rows(
    table: &AnyTable,
    mapping: Mapping,
    frame: &LocalFrame,
    findings: &mut Findings,
) -> Vec<Row> {
    if table.rows.is_empty() {
        findings.of_file(Level::Error, &Defect::NoRows, None);
    }
    let grid = grid::of(table, mapping, frame);
    let packed = packed_angles(table, mapping, frame);
    match &grid {
        Some(grid) => {
            // A mapping that has the axes the other way round is put right by the grid itself.
            let (central_meridian_deg, distance_m) = (grid.zone.central_meridian_deg, grid.distance_m);
            let odd = Defect::NationalGrid { grid: grid.name.clone(), central_meridian_deg, distance_m };
            let level = if distance_m > grid::FARTHEST_M { Level::Error } else { Level::Warning };
            findings.of_file(level, &odd, None);
            if level == Level::Error {
                return Vec::new();
            }
        }
        None if packed.is_some() => {
            let (_, [first, _], _) = mapping.columns();
            let shown_of = table.rows.iter().find_map(|row| {
                Some((shown(row.cells.get(first)?), packed?.degrees(value_of(table, row, first)?)?))
            });
            if let Some((found, degrees)) = shown_of {
                findings.of_file(Level::Warning, &Defect::PackedAngles { found, degrees }, None);
            }
        }
        None if wrong_frame(table, mapping, frame, findings) => return Vec::new(),
        None if mapping.is_by_custom(&table.columns) => {
            findings.of_file(Level::Warning, &Defect::AxesByCustom, Some(mapping.swapped()));
        }
        None => {}
    }
    let absolute = grid.is_some() || matches!(mapping, Mapping::Geographic { .. });
    if absolute && mapping.has_heights_above_the_sea(&table.columns) {
        let column = mapping.columns().2.and_then(|at| table.columns.get(at)).cloned().unwrap_or_default();
        let odd = Defect::HeightsAboveTheSea { column };
        findings.of_file(Level::Warning, &odd, Some(mapping.without_heights()));
    } else if !absolute && let Some(odd) = absolute_heights(table, mapping, frame) {
        findings.of_file(Level::Warning, &odd, Some(mapping.without_heights()));
    }
    let mut looks: HashMap<String, String> = HashMap::new();
    let mut rows = Vec::with_capacity(table.rows.len());
    let mut lines: HashMap<String, u64> = HashMap::new();
    for row in &table.rows {
        let mut filled = row.cells.iter().filter(|cell| !cell.is_empty());
        if let (Some(alone), None, true) = (filled.next(), filled.next(), row.cells.len() > 2) {
            findings.of_line(Level::Warning, row.line, "", &Defect::NoMarker { found: shown(alone) });
            continue;
        }
        let Some(read) = one(row, table, mapping, (frame, grid.as_ref(), packed), findings) else { continue };
        if let Some(line) = lines.insert(read.name.clone(), read.line) {
            findings.of_line(Level::Error, read.line, &read.name, &Defect::RepeatedName { first_line: line });
            continue;
        }
        if let Some(like) = looks.insert(names::look(&read.name), read.name.clone()) {
            findings.of_line(Level::Warning, read.line, &read.name, &Defect::SimilarName { like });
        }
        rows.push(read);
    }
    rows
}

fn one(
    row: &AnyRow,
    table: &AnyTable,
    mapping: Mapping,
    (frame, grid, packed): (&LocalFrame, Option<&grid::Grid>, Option<Packed>),
    findings: &mut Findings,
) -> Option<Row> {
    let (name, plan, height) = mapping.columns();
    let cell = |index: usize| row.cells.get(index).map(String::as_str).unwrap_or_default();
    let written = cell(name).trim();
    let name = match checked_name(cell(name)) {
        Ok(name) => name,
        Err(error) => {
            let (found, sentence) = (shown(cell(name)), error.to_string());
            let odd = Defect::WrongName { found, longest_letters: NAME_LENGTH, sentence };
            findings.of_line(Level::Error, row.line, "", &odd);
            return None;
        }
    };
    if name != written {
        let odd =
            Defect::CleanedName { letters: written.chars().count(), kept_letters: name.chars().count() };
        findings.of_line(Level::Warning, row.line, &name, &odd);
    }
    let comma = table.decimal_comma;
    let read = |index: usize, text: &str| match mapping {
        Mapping::Geographic { .. } if plan.contains(&index) => {
            let angle = surveyed::angle_deg(text, comma)?;
            packed.map_or(Some(angle), |packed| packed.degrees(angle))
        }
        _ => Some(surveyed::number(text, comma)? * metres_of(table, index)),
    };
    let mut value = |index: usize, most: f64| {
        let text = cell(index);
        let (column, found) = (table.columns[index].clone(), shown(text));
        let odd = match read(index, text) {
            None => Defect::NotANumber { column, found },
            Some(value) if value.abs() > most => Defect::ValueOutOfRange { column, found, most },
            value => return value,
        };
        findings.of_line(Level::Error, row.line, &name, &odd);
        None
    };
    let most = match mapping {
        Mapping::Local { .. } if grid.is_some() => [grid::LARGEST_M; 2],
        Mapping::Local { .. } => [FARTHEST_M; 2],
        Mapping::Geographic { .. } => [90.0, 180.0],
    };
    let first = value(plan[0], most[0]);
    let second = value(plan[1], most[1]);
    // An empty height leaves the height alone.
    let height = match height.filter(|index| !cell(*index).is_empty()) {
        None => Some(None),
        Some(index) => value(index, FARTHEST_M).map(Some),
    };
    let (first, second, height) = (first?, second?, height?);
    let (e_m, n_m, u_m) = match (mapping, grid) {
        (Mapping::Local { .. }, Some(grid)) => grid.to_local_m(first, second, height, frame),
        (Mapping::Local { .. }, None) => (first, second, height),
        (Mapping::Geographic { .. }, _) => {
            MarkerPlace::Geodetic { latitude_deg: first, longitude_deg: second, height_m: height }
                .to_local_m(frame)
        }
    };
    if e_m.abs() > FARTHEST_M || n_m.abs() > FARTHEST_M {
        let odd = Defect::PlaceOutOfRange { e_m, n_m, farthest_m: FARTHEST_M };
        findings.of_line(Level::Error, row.line, &name, &odd);
        return None;
    }
    let sigma_m = SIGMAS.map(|column| {
        let at = table.columns.iter().position(|name| name == column)?;
        surveyed::number(cell(at), comma).filter(|sigma_m| *sigma_m >= 0.0)
    });
    let sigma_m = match sigma_m {
        [Some(e), Some(n), Some(u)] => Some([e, n, u]),
        _ => None,
    };
    Some(Row { line: row.line, name, place: Place { e_m, n_m, u_m }, sigma_m })
}

/// How many metres a 1 in a column is.
fn metres_of(table: &AnyTable, column: usize) -> f64 {
    let below = table.units.get(column).map_or("", String::as_str);
    metres_in(&table.columns[column], below)
}

/// How the angles of a table are written that are no decimals of degrees, where that puts nearly all of them at the site, and
/// decimals none.
fn packed_angles(table: &AnyTable, mapping: Mapping, frame: &LocalFrame) -> Option<Packed> {
    let Mapping::Geographic { latitude_deg, longitude_deg, .. } = mapping else { return None };
    let origin = frame.origin();
    let pairs: Vec<[f64; 2]> = table
        .rows
        .iter()
        .filter_map(|row| Some([value_of(table, row, latitude_deg)?, value_of(table, row, longitude_deg)?]))
        .collect();
    /// Within a kilometre or two: minutes taken for decimals are off by more at nearly every place.
    const NEAR_DEG: f64 = 0.02;
    let near = |of: &dyn Fn(f64) -> Option<f64>| {
        let at_site = |[latitude, longitude]: &&[f64; 2]| {
            of(*latitude).is_some_and(|deg| (deg - origin.latitude_deg).abs() < NEAR_DEG)
                && of(*longitude).is_some_and(|deg| (deg - origin.longitude_deg).abs() < NEAR_DEG)
        };
        pairs.iter().filter(at_site).count() as f64 >= MOST * pairs.len() as f64
    };
    if pairs.is_empty() || near(&|deg| Some(deg)) {
        return None;
    }
    Packed::ALL.into_iter().find(|packed| near(&|value| packed.degrees(value)))
}

/// Whether the heights of a table in the site's own frame are near the height of its origin, where that is far from 0.
fn absolute_heights(table: &AnyTable, mapping: Mapping, frame: &LocalFrame) -> Option<Defect> {
    let (_, _, Some(column)) = mapping.columns() else { return None };
    /// The site's ground is not farther above or below its origin, m.
    const FARTHEST_M: f64 = 300.0;
    let origin_m = frame.origin().height_m;
    let mut heights: Vec<f64> = table
        .rows
        .iter()
        .filter_map(|row| surveyed::number(row.cells.get(column)?, table.decimal_comma))
        .map(|height| height * metres_of(table, column))
        .collect();
    heights.sort_by(f64::total_cmp);
    let typical_m = *heights.get(heights.len() / 2)?;
    let absolute = (typical_m - origin_m).abs() < FARTHEST_M && typical_m.abs() > FARTHEST_M;
    absolute.then_some(Defect::AbsoluteHeights { typical_m, origin_m })
}

/// Whether nearly all rows say that the columns mean something else, so that each of them need not.
fn wrong_frame(table: &AnyTable, mapping: Mapping, frame: &LocalFrame, findings: &mut Findings) -> bool {
    let (_, [first, second], _) = mapping.columns();
    let origin = frame.origin();
    let share = |says: &dyn Fn(f64, f64) -> bool| {
        let of = table
            .rows
            .iter()
            .filter_map(|row| Some((value_of(table, row, first)?, value_of(table, row, second)?)));
        let pairs: Vec<_> = of.collect();
        !pairs.is_empty()
            && pairs.iter().filter(|(a, b)| says(*a, *b)).count() as f64 >= MOST * table.rows.len() as f64
    };
    let near = |latitude: f64, longitude: f64| {
        (latitude - origin.latitude_deg).abs() < NEAR_DEG
            && (longitude - origin.longitude_deg).abs() < NEAR_DEG
    };
    let [latitude_deg, longitude_deg] = [origin.latitude_deg, origin.longitude_deg];
    let (odd, suggested) = match mapping {
        Mapping::Geographic { .. } if share(&|a, b| near(b, a) && !near(a, b)) => {
            (Defect::SwappedLatLon { latitude_deg, longitude_deg }, Some(mapping.swapped()))
        }
        Mapping::Geographic { .. } if share(&|a, b| a.abs() > 90.0 || b.abs() > 180.0) => {
            (Defect::LooksLocal, Some(mapping.in_the_other_frame()))
        }
        Mapping::Geographic { .. } if share(&|a, b| !near(a, b)) => {
            (Defect::OtherSite { latitude_deg, longitude_deg }, None)
        }
        Mapping::Local { .. } if share(&|a, b| near(b, a) || near(a, b)) => {
            // The mapping's east is its longitude; where the values say otherwise, they are changed over.
            let other = mapping.in_the_other_frame();
            let suggested = if share(&|a, b| near(b, a)) { other } else { other.swapped() };
            (Defect::LooksGeographic, Some(suggested))
        }
        Mapping::Local { .. } if share(&|a, b| a.abs() > FARTHEST_M || b.abs() > FARTHEST_M) => {
            (Defect::OtherGrid { farthest_m: FARTHEST_M }, None)
        }
        _ => return false,
    };
    findings.of_file(Level::Error, &odd, suggested);
    true
}

/// What stands in a cell, as much of it as a sentence bears.
fn shown(text: &str) -> String {
    text.chars().take(40).collect()
}

/// A coordinate, whichever it is: metres or degrees.
pub(super) fn value_of(table: &AnyTable, row: &AnyRow, column: usize) -> Option<f64> {
    surveyed::angle_deg(row.cells.get(column)?, table.decimal_comma)
}

#[cfg(test)]
mod tests {
    use lodestep_engine::geo::Site;
    use lodestep_engine::parse::any_table;

    use super::*;

    fn read(text: &str) -> (Vec<Row>, Findings) {
        let table = any_table::read(text.as_bytes()).unwrap();
        let mapping = Mapping::guess(&table.columns).unwrap();
        let mut findings = Findings::default();
        let rows = rows(&table, mapping, &Site::fast().local_frame(), &mut findings);
        (rows, findings)
    }

    fn codes(text: &str) -> Vec<String> {
        read(text).1.findings.into_iter().map(|finding| finding.code).collect()
    }

    #[test]
    fn rows_are_read_in_both_frames() {
        let (rows, findings) = read("name,e_m,n_m,u_m\n A1 ,1.5,−2,\nB2,3,4,5\n");
        assert_eq!(
            rows[0],
            Row {
                line: 2,
                name: "A1".into(),
                place: Place { e_m: 1.5, n_m: -2.0, u_m: None },
                sigma_m: None
            }
        );
        assert_eq!((rows[1].place.u_m, findings), (Some(5.0), Findings::default()));
        let (rows, _) = read("name,lat_deg,lon_deg,height_m\nA1,25.652944,106.856667,1120\n");
        assert!(rows[0].place.e_m.abs() < 1e-6 && (rows[0].place.u_m.unwrap() - 10.0).abs() < 1e-6);
    }

    #[test]
    fn how_sure_a_survey_is_comes_along_where_all_of_it_is_told() {
        let (rows, _) = read(
            "name,e_m,n_m,u_m,sigma_e_m,sigma_n_m,sigma_u_m\nA1,1,2,3,0.01,0.02,0.03\nA2,1,9,3,0.01,,0.03\n",
        );
        assert_eq!(rows[0].sigma_m, Some([0.01, 0.02, 0.03]));
        assert_eq!(rows[1].sigma_m, None);
    }

    #[test]
    fn every_wrong_row_is_told_with_its_line() {
        let (rows, findings) =
            read("name,e_m,n_m,u_m\n,1,2,3\nA1,1,east,3\nA2,1,2,3\nA2,4,5,6\nA3,200000,1,1\nA4,1,1,x\n");
        assert_eq!(rows.len(), 1);
        let told: Vec<_> =
            findings.findings.iter().map(|finding| (finding.code.as_str(), finding.line.unwrap())).collect();
        assert_eq!(
            told,
            [
                ("wrong_name", 2),
                ("not_a_number", 3),
                ("repeated_name", 5),
                ("out_of_range", 6),
                ("not_a_number", 7)
            ]
        );
    }

    #[test]
    fn heights_of_another_kind_angles_in_one_number_and_lines_that_are_no_marker_are_told() {
        for (text, code) in [
            ("点名,纬度,经度,正常高\nA1,25.6529,106.8567,1120\n", "heights_above_the_sea"),
            ("name,e_m,n_m,高程\nA1,1,2,1120\nA2,3,4,1121\n", "absolute_heights"),
            ("name,lat,lon\nA1,25.391059838,106.512400120\n", "packed_angles"),
            ("name,lat,lon\nA1,253910.59838,1065124.00120\n", "packed_angles"),
            ("name,lat,lon\nA1,2539.1766397,10651.400020\n", "packed_angles"),
            ("name,e_m,n_m,u_m\nRing A,,,\nA1,1,2,3\n", "no_marker"),
        ] {
            assert_eq!(codes(text), [code], "{text}");
            let (rows, findings) = read(text);
            assert!(!findings.has(Level::Error) && !rows.is_empty(), "{text}");
            assert!(rows.iter().all(|row| row.place.e_m.hypot(row.place.n_m) < 30.0), "{text}: {rows:?}");
        }
        assert_eq!(codes("name,lat,lon,大地高\nA1,25.6529,106.8567,1120\n"), [""; 0]);
        assert_eq!(codes("name,e_m,n_m,高程\nA1,1,2,12\n"), [""; 0]);
    }

    #[test]
    fn millimetres_are_no_metres() {
        for text in [
            "name,E (mm),N (mm)\nA1,1500,-2500\n",
            "name,e,n\n,mm,mm\nA1,1500,-2500\n",
            "name,e_cm,n_cm\nA1,150,-250\n",
        ] {
            assert_eq!(read(text).0[0].place, Place { e_m: 1.5, n_m: -2.5, u_m: None }, "{text}");
        }
    }

    #[test]
    fn a_wrong_frame_is_told_once_with_what_would_be_right() {
        let (_, findings) = read("name,e_m,n_m\nA,106.8566,25.6529\nB,106.8567,25.6530\n");
        let found = &findings.findings[0];
        assert_eq!(found.code, "looks_geographic");
        let right = Mapping::Geographic { name: 0, latitude_deg: 2, longitude_deg: 1, height_m: None };
        assert_eq!(found.suggested, Some(right));
        let (_, findings) = read("name,e_m,n_m\nA,25.6529,106.8566\n");
        assert_eq!(findings.findings[0].suggested, Some(right.swapped()));
        let (_, findings) = read("name,lat_deg,lon_deg\nA,106.8566,25.6529\nB,106.8567,25.6530\n");
        assert_eq!(findings.findings[0].code, "swapped_lat_lon");
        assert_eq!(findings.findings.len(), 1);
        assert_eq!(codes("name,lat_deg,lon_deg\nA,-120.5,200.1\n"), ["looks_local"]);
        assert_eq!(codes("name,lat_deg,lon_deg\nA,39.9,116.4\n"), ["wrong_frame"]);
        assert_eq!(codes("name,e_m,n_m\nA,36386000.1,2838000.2\n"), ["national_grid"]);
        assert_eq!(codes("name,e_m,n_m\n"), ["no_rows"]);
    }
}
