//! A track as a file: for the page as JSON, for others in the formats they know.

use std::io::{self, Write};

use lodestep_engine::event::{TrackPoint, VisitOutcome};
use lodestep_engine::geo::{Geodetic, LocalFrame};
use lodestep_engine::system::Declaration;
use lodestep_engine::systems::catalogue;
use lodestep_engine::track::{TrackPlace, csv, geojson, gpx, kml};
use schemars::JsonSchema;

use crate::site::Site;
use crate::store::sessions::Session;
use crate::store::visits::Visit;
use crate::utc;

/// The shapes in which a track is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    Json,
    Csv,
    GeoJson,
    Gpx,
    Kml,
}

impl Format {
    pub(crate) fn extension(self) -> &'static str {
        match self {
            Format::Json => "json",
            Format::Csv => "csv",
            Format::GeoJson => "geojson",
            Format::Gpx => "gpx",
            Format::Kml => "kml",
        }
    }
}

/// Where on the Earth a session's track lies, when it began, and whose it is.
pub(crate) fn place(site: &Site, session: &Session, inspector: &str) -> TrackPlace {
    let origin = Geodetic {
        latitude_deg: site.latitude_deg,
        longitude_deg: site.longitude_deg,
        height_m: site.height_m,
    };
    let name = match session.title.as_str() {
        "" => inspector.to_owned(),
        title => format!("{inspector}: {title}"),
    };
    TrackPlace {
        name,
        frame: LocalFrame::new(origin),
        start_unix_ns: utc::to_us(session.started_at).checked_mul(1_000),
    }
}

/// What became of visits, in the engine's words; those that no run has weighed are left out.
pub(crate) fn outcomes(visits: Vec<Visit>) -> Vec<VisitOutcome> {
    let weighed = visits.into_iter().filter_map(|visit| Some((visit.marker, visit.outcome?)));
    weighed
        .map(|(marker, outcome)| VisitOutcome {
            marker,
            t_ns: outcome.t_applied_ns,
            before_minus_marker_n_m: outcome.before_minus_marker_m,
            after_minus_marker_n_m: outcome.after_minus_marker_m,
            nis: outcome.nis,
            degrees_of_freedom: outcome.degrees_of_freedom,
            accepted: outcome.accepted,
            reason: outcome.reason,
        })
        .collect()
}

/// Writes the file; `run` is a word or an id.
pub(crate) fn write(
    format: Format,
    system: &Declaration,
    run: &str,
    points: &[TrackPoint],
    visits: &[VisitOutcome],
    place: &TrackPlace,
    out: &mut impl Write,
) -> io::Result<()> {
    match format {
        Format::Json => write_json(system, run, points, out),
        Format::Csv => csv::write(system, points, out),
        Format::GeoJson => geojson::write(points, visits, place, out),
        Format::Gpx => gpx::write(points, place, out),
        Format::Kml => kml::write(points, place, out),
    }
}

/// A track as `write_json` writes it, point by point.
#[derive(JsonSchema)]
#[expect(
    dead_code,
    reason = "a track is written as it is read from the store, and never held whole in this shape"
)]
pub(crate) struct TrackPoints {
    /// `main`, `filtered`, `without_markers` or the id of a lab run.
    #[schemars(example = &"main")]
    run: String,
    /// What stands in each row: times in seconds since the session's start, positions in metres east, north and up of the
    /// site's origin, headings in radians from north to east.
    #[schemars(example = csv::columns(catalogue::usual()))]
    columns: Vec<String>,
    /// A point a row, `null` where a column has no value.
    rows: Vec<Vec<Option<f64>>>,
}

/// The rows of the CSV track as arrays, `null` for an empty field.
fn write_json(
    system: &Declaration,
    run: &str,
    points: &[TrackPoint],
    out: &mut impl Write,
) -> io::Result<()> {
    let columns =
        csv::columns(system).iter().map(|column| format!("\"{column}\"")).collect::<Vec<_>>().join(",");
    write!(out, "{{\"run\":\"{run}\",\"columns\":[{columns}],\"rows\":[")?;
    let (mut row, mut json) = (String::new(), String::new());
    for (i, point) in points.iter().enumerate() {
        row.clear();
        json.clear();
        csv::push_row(system, point, &mut row);
        json.push_str(if i == 0 { "[" } else { ",\n[" });
        for (i, field) in row.trim_end().split(',').enumerate() {
            if i > 0 {
                json.push(',');
            }
            // JSON has no word for NaN and infinity, which begin with a letter.
            let is_number = field.ends_with(|last: char| last.is_ascii_digit());
            json.push_str(if is_number { field } else { "null" });
        }
        json.push(']');
        out.write_all(json.as_bytes())?;
    }
    write!(out, "]}}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use lodestep_engine::event::Part;

    #[test]
    fn the_page_gets_numbers_and_nulls() {
        let point = TrackPoint {
            t_ns: 1_500_000_000,
            position_n_m: [1.25, -2.0, f64::NAN],
            heading_rad: 1e-9,
            sigma_heading_rad: 0.1,
            sigma_n_m: [f64::INFINITY, 0.2, 0.3],
            covariance_en_m2: 0.0,
            tilt: None,
            parts: [Some(Part { position_n_m: [1.0, 2.0, 3.0], stance: true }), None],
        };
        let mut out = Vec::new();
        write_json(catalogue::usual(), "without_markers", &[point, point], &mut out).unwrap();
        let json: serde_json::Value = serde_json::from_slice(&out).unwrap();
        assert_eq!(json["run"], "without_markers");
        assert_eq!(json["columns"].as_array().unwrap().len(), json["rows"][0].as_array().unwrap().len());
        let expected = serde_json::json!([
            1.5, 1.25, -2, null, 1e-9, null, 0.2, 0.3, 1, 2, 3, null, null, null, 1, null
        ]);
        assert_eq!(json["rows"][1].to_string(), expected.to_string());
    }

    #[test]
    fn a_track_without_points_is_still_a_track() {
        let mut out = Vec::new();
        write_json(catalogue::usual(), "main", &[], &mut out).unwrap();
        let json: serde_json::Value = serde_json::from_slice(&out).unwrap();
        assert_eq!(json["rows"], serde_json::json!([]));
    }
}
