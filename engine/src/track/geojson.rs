//! A track as GeoJSON (RFC 7946): one line with time and sigma beside its coordinates, and a point
//! for each visit.

use std::io::{self, Write};

use serde_json::json;

use crate::event::{TrackPoint, VisitOutcome};
use crate::track::TrackPlace;
use crate::track::csv::push_seconds;
use crate::track::pieces::pieces;

/// Writes points and visits. The line breaks where nothing was measured; its `t_s` and `sigma_m` (east, north, up) stand beside its
/// coordinates, one for one.
///
/// # Errors
///
/// When `out` does not take it.
pub fn write<'a>(
    points: impl IntoIterator<Item = &'a TrackPoint> + Clone,
    visits: &[VisitOutcome],
    place: &TrackPlace,
    out: &mut impl Write,
) -> io::Result<()> {
    let started_at = place.utc(0);
    writeln!(out, "{{\"type\":\"FeatureCollection\",\"features\":[")?;
    write!(
        out,
        "{{\"type\":\"Feature\",\"properties\":{{\"name\":{},\"started_at\":{},\"t_s\":[",
        json!(place.name),
        json!(started_at)
    )?;
    let mut text = String::new();
    list(points.clone(), out, |point, text| push_seconds(point.t_ns, text), &mut text)?;
    write!(out, "],\n\"sigma_m\":[")?;
    let push_sigma = |point: &TrackPoint, text: &mut String| {
        let [e, n, u] = point.sigma_n_m;
        text.push_str(&format!("[{e:.3},{n:.3},{u:.3}]"));
    };
    list(points.clone(), out, push_sigma, &mut text)?;
    let push_position = |point: &TrackPoint, text: &mut String| {
        let [latitude, longitude, height] = place.geodetic(point.position_n_m);
        text.push_str(&format!("[{longitude},{latitude},{height}]"));
    };
    // A line needs two positions; a piece of one point is a line to itself.
    let doubled = |piece: &[&'a TrackPoint]| if piece.len() == 1 { Some(piece[0]) } else { None };
    let pieces = pieces(points);
    let (kind, open, close) = match pieces.len() {
        0 | 1 => ("LineString", "", ""),
        _ => ("MultiLineString", "[", "]"),
    };
    write!(out, "]}},\n\"geometry\":{{\"type\":\"{kind}\",\"coordinates\":[")?;
    for (k, piece) in pieces.iter().enumerate() {
        write!(out, "{}{open}", if k > 0 { ",\n" } else { "" })?;
        list(piece.iter().copied().chain(doubled(piece)), out, push_position, &mut text)?;
        write!(out, "{close}")?;
    }
    write!(out, "]}}}}")?;
    for visit in visits {
        let [e, n, u] = visit.before_minus_marker_n_m;
        let properties = json!({
            "marker": visit.marker,
            "t_s": visit.t_ns as f64 * 1e-9,
            "before_minus_marker_m": [e, n, u],
            "nis": visit.nis,
            "accepted": visit.accepted,
        });
        // No geometry of its own: the file has the marker's offset, the marker list its place.
        write!(out, ",\n{{\"type\":\"Feature\",\"properties\":{properties},\"geometry\":null}}")?;
    }
    writeln!(out, "\n]}}")
}

fn list<'a>(
    points: impl IntoIterator<Item = &'a TrackPoint>,
    out: &mut impl Write,
    push: impl Fn(&TrackPoint, &mut String),
    text: &mut String,
) -> io::Result<()> {
    for (i, point) in points.into_iter().enumerate() {
        text.clear();
        if i > 0 {
            text.push(',');
        }
        push(point, text);
        out.write_all(text.as_bytes())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::csv::tests::point;
    use crate::track::place::tests::place;

    #[test]
    fn it_is_geojson_with_longitude_first() {
        let visit = VisitOutcome {
            marker: "A\"17".into(),
            t_ns: 5_000_000_000,
            before_minus_marker_n_m: [1.0, 2.0, f64::NAN],
            after_minus_marker_n_m: [0.0; 3],
            nis: 1.0,
            degrees_of_freedom: 2,
            accepted: true,
            reason: String::new(),
        };
        for count in [1, 3] {
            let mut out = Vec::new();
            write(&vec![point(); count], std::slice::from_ref(&visit), &place(Some(0)), &mut out).unwrap();
            let value: serde_json::Value = serde_json::from_slice(&out).unwrap();
            let line = &value["features"][0];
            assert_eq!(line["properties"]["started_at"], "1970-01-01T00:00:00Z");
            assert_eq!(line["properties"]["t_s"].as_array().unwrap().len(), count);
            let coordinates = line["geometry"]["coordinates"].as_array().unwrap();
            assert_eq!(coordinates.len(), count.max(2));
            assert!((coordinates[0][0].as_f64().unwrap() - 106.8567).abs() < 1e-3);
            assert!((coordinates[0][1].as_f64().unwrap() - 25.6529).abs() < 1e-3);
            assert_eq!(value["features"][1]["properties"]["marker"], "A\"17");
        }
    }
}
