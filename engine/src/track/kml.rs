//! A track as KML 2.2: a `gx:Track` with times when the session's start is known, else a line.
//! Heights are above the ellipsoid.

use std::io::{self, Write};

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};

use crate::event::TrackPoint;
use crate::track::TrackPlace;
use crate::track::pieces::pieces;

/// Writes points.
///
/// # Errors
///
/// When `out` does not take it.
pub fn write<'a>(
    points: impl IntoIterator<Item = &'a TrackPoint> + Clone,
    place: &TrackPlace,
    out: &mut impl Write,
) -> io::Result<()> {
    let mut xml = Writer::new_with_indent(out, b' ', 1);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let namespaces =
        [("xmlns", "http://www.opengis.net/kml/2.2"), ("xmlns:gx", "http://www.google.com/kml/ext/2.2")];
    xml.create_element("kml").with_attributes(namespaces).write_inner_content(|xml| {
        xml.create_element("Document").write_inner_content(|xml| {
            let name = TrackPlace::xml_text(&place.name);
            text(xml, "name", &name)?;
            xml.create_element("Placemark").write_inner_content(|xml| {
                text(xml, "name", &name)?;
                let pieces = pieces(points);
                let several = if place.start_unix_ns.is_some() { "gx:MultiTrack" } else { "MultiGeometry" };
                let write = |xml: &mut Writer<_>| {
                    pieces.iter().try_for_each(|piece| {
                        let points = piece.iter().copied();
                        if place.start_unix_ns.is_some() {
                            write_timed(points, place, xml)
                        } else {
                            write_line(points, place, xml)
                        }
                    })
                };
                if pieces.len() > 1 {
                    xml.create_element(several).write_inner_content(write)?;
                    return Ok(());
                }
                write(xml)
            })?;
            Ok(())
        })?;
        Ok(())
    })?;
    xml.into_inner().write_all(b"\n")
}

fn write_timed<'a>(
    points: impl IntoIterator<Item = &'a TrackPoint> + Clone,
    place: &TrackPlace,
    xml: &mut Writer<impl Write>,
) -> io::Result<()> {
    xml.create_element("gx:Track").write_inner_content(|xml| {
        text(xml, "altitudeMode", "absolute")?;
        for point in points.clone() {
            text(xml, "when", &place.utc(point.t_ns).unwrap_or_default())?;
        }
        for point in points {
            let [latitude, longitude, height] = place.geodetic(point.position_n_m);
            text(xml, "gx:coord", &format!("{longitude} {latitude} {height}"))?;
        }
        Ok(())
    })?;
    Ok(())
}

fn write_line<'a>(
    points: impl IntoIterator<Item = &'a TrackPoint>,
    place: &TrackPlace,
    xml: &mut Writer<impl Write>,
) -> io::Result<()> {
    let mut coordinates = String::new();
    for point in points {
        let [latitude, longitude, height] = place.geodetic(point.position_n_m);
        coordinates.push_str(&format!("{longitude},{latitude},{height}\n"));
    }
    xml.create_element("LineString").write_inner_content(|xml| {
        text(xml, "altitudeMode", "absolute")?;
        text(xml, "coordinates", &coordinates)
    })?;
    Ok(())
}

fn text(xml: &mut Writer<impl Write>, name: &str, content: &str) -> io::Result<()> {
    xml.create_element(name).write_text_content(BytesText::new(content))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::csv::tests::point;
    use crate::track::place::tests::place;

    fn written(start: Option<i64>) -> String {
        let mut out = Vec::new();
        write(&[point(), point()], &place(start), &mut out).unwrap();
        let text = String::from_utf8(out).unwrap();
        let mut reader = quick_xml::Reader::from_str(&text);
        while reader.read_event().unwrap() != Event::Eof {}
        text
    }

    #[test]
    fn with_a_start_every_coordinate_has_its_time() {
        let text = written(Some(1_700_000_000_000_000_000));
        assert_eq!(text.matches("<when>2023-11-14T22:13:21.25Z</when>").count(), 2);
        assert_eq!(text.matches("<gx:coord>106.85").count(), 2);
    }

    #[test]
    fn without_a_start_it_is_a_line() {
        let text = written(None);
        assert!(!text.contains("<when>"));
        assert_eq!(text.matches("106.85").count(), 2);
    }
}
