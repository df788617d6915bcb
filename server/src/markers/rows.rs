//! The rows of a file of markers, read by a mapping; each that cannot be read is a finding.

use std::collections::HashMap;

use lodestep_engine::geo::LocalFrame;
use lodestep_engine::parse::any_table::{AnyRow, AnyTable};
use lodestep_engine::parse::markers_csv::MarkerPlace;
use lodestep_engine::parse::{names, surveyed};

use super::edit::{FARTHEST_M, NAME_LENGTH, checked_name};
use super::finding::{Findings, Level};
use super::grid;
use super::mapping::Mapping;
use super::odd::Odd;
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
        findings.of_file(Level::Error, &Odd::NoRows, None);
    }
    let grid = grid::of(table, mapping, frame);
    match &grid {
        Some(grid) => {
            // A mapping that has the axes the other way round is put right by the grid itself.
            let (central_meridian_deg, distance_m) = (grid.zone.central_meridian_deg, grid.distance_m);
            let odd = Odd::NationalGrid { grid: grid.name.clone(), central_meridian_deg, distance_m };
            let level = if distance_m > grid::FARTHEST_M { Level::Error } else { Level::Warning };
            findings.of_file(level, &odd, None);
            if level == Level::Error {
                return Vec::new();
            }
        }
        None if wrong_frame(table, mapping, frame, findings) => return Vec::new(),
        None if mapping.is_by_custom(&table.columns) => {
            findings.of_file(Level::Warning, &Odd::AxesByCustom, Some(mapping.swapped()));
        }
        None => {}
    }
    let mut looks: HashMap<String, String> = HashMap::new();
    let mut rows = Vec::with_capacity(table.rows.len());
    let mut lines: HashMap<String, u64> = HashMap::new();
    for row in &table.rows {
        let Some(read) = one(row, table, mapping, (frame, grid.as_ref()), findings) else { continue };
        if let Some(line) = lines.insert(read.name.clone(), read.line) {
            findings.of_line(Level::Error, read.line, &read.name, &Odd::RepeatedName { first_line: line });
            continue;
        }
        if let Some(like) = looks.insert(names::look(&read.name), read.name.clone()) {
            findings.of_line(Level::Warning, read.line, &read.name, &Odd::SimilarName { like });
        }
        rows.push(read);
    }
    rows
}

fn one(
    row: &AnyRow,
    table: &AnyTable,
    mapping: Mapping,
    (frame, grid): (&LocalFrame, Option<&grid::Grid>),
    findings: &mut Findings,
) -> Option<Row> {
    let (name, plan, height) = mapping.columns();
    let cell = |index: usize| row.cells.get(index).map(String::as_str).unwrap_or_default();
    let written = cell(name).trim();
    let name = match checked_name(cell(name)) {
        Ok(name) => name,
        Err(error) => {
            let (found, sentence) = (shown(cell(name)), error.to_string());
            let odd = Odd::WrongName { found, longest_letters: NAME_LENGTH, sentence };
            findings.of_line(Level::Error, row.line, "", &odd);
            return None;
        }
    };
    if name != written {
        let odd = Odd::CleanedName { letters: written.chars().count(), kept_letters: name.chars().count() };
        findings.of_line(Level::Warning, row.line, &name, &odd);
    }
    let comma = table.decimal_comma;
    let read = |index: usize, text: &str| match mapping {
        Mapping::Geographic { .. } if plan.contains(&index) => surveyed::angle_deg(text, comma),
        _ => surveyed::number(text, comma),
    };
    let mut value = |index: usize, most: f64| {
        let text = cell(index);
        let (column, found) = (table.columns[index].clone(), shown(text));
        let odd = match read(index, text) {
            None => Odd::NotANumber { column, found },
            Some(value) if value.abs() > most => Odd::ValueOutOfRange { column, found, most },
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
        let odd = Odd::PlaceOutOfRange { e_m, n_m, farthest_m: FARTHEST_M };
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
            (Odd::SwappedLatLon { latitude_deg, longitude_deg }, Some(mapping.swapped()))
        }
        Mapping::Geographic { .. } if share(&|a, b| a.abs() > 90.0 || b.abs() > 180.0) => {
            (Odd::LooksLocal, Some(mapping.in_the_other_frame()))
        }
        Mapping::Geographic { .. } if share(&|a, b| !near(a, b)) => {
            (Odd::OtherSite { latitude_deg, longitude_deg }, None)
        }
        Mapping::Local { .. } if share(&|a, b| near(b, a) || near(a, b)) => {
            // The mapping's east is its longitude; where the values say otherwise, they are changed over.
            let other = mapping.in_the_other_frame();
            let suggested = if share(&|a, b| near(b, a)) { other } else { other.swapped() };
            (Odd::LooksGeographic, Some(suggested))
        }
        Mapping::Local { .. } if share(&|a, b| a.abs() > FARTHEST_M || b.abs() > FARTHEST_M) => {
            (Odd::OtherGrid { farthest_m: FARTHEST_M }, None)
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
