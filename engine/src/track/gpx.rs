//! A track as GPX 1.1, with the sigmas as extensions. Heights are above the ellipsoid.

use std::io::{self, Write};

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};

use crate::event::TrackPoint;
use crate::track::TrackPlace;
use crate::track::pieces::pieces;

/// Writes points; they carry times when the place knows when the session began.
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
    let namespaces = [
        ("version", "1.1"),
        ("creator", "Lodestep"),
        ("xmlns", "http://www.topografix.com/GPX/1/1"),
        ("xmlns:lodestep", "urn:lodestep:track:1"),
    ];
    xml.create_element("gpx").with_attributes(namespaces).write_inner_content(|xml| {
        xml.create_element("trk").write_inner_content(|xml| {
            let name = TrackPlace::xml_text(&place.name);
            xml.create_element("name").write_text_content(BytesText::new(&name))?;
            for piece in pieces(points) {
                xml.create_element("trkseg").write_inner_content(|xml| {
                    piece.into_iter().try_for_each(|point| write_point(point, place, xml))
                })?;
            }
            Ok(())
        })?;
        Ok(())
    })?;
    xml.into_inner().write_all(b"\n")
}

fn write_point(point: &TrackPoint, place: &TrackPlace, xml: &mut Writer<impl Write>) -> io::Result<()> {
    let [latitude, longitude, height] = place.geodetic(point.position_n_m);
    let attributes = [("lat", latitude.as_str()), ("lon", longitude.as_str())];
    xml.create_element("trkpt").with_attributes(attributes).write_inner_content(|xml| {
        xml.create_element("ele").write_text_content(BytesText::new(&height))?;
        if let Some(utc) = place.utc(point.t_ns) {
            xml.create_element("time").write_text_content(BytesText::new(&utc))?;
        }
        xml.create_element("extensions").write_inner_content(|xml| {
            let names = ["lodestep:sigma_e_m", "lodestep:sigma_n_m", "lodestep:sigma_u_m"];
            for (name, sigma) in names.into_iter().zip(point.sigma_n_m) {
                xml.create_element(name).write_text_content(BytesText::new(&format!("{sigma:.3}")))?;
            }
            Ok(())
        })?;
        Ok(())
    })?;
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
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn it_is_gpx() {
        let text = written(Some(1_700_000_000_000_000_000));
        assert!(text.contains("<name>走 &lt;1&gt; &amp; co</name>"), "{text}");
        assert_eq!(text.matches("<trkpt lat=\"25.65").count(), 2);
        assert!(text.contains("<time>2023-11-14T22:13:21.25Z</time>"), "{text}");
        assert!(text.contains("<lodestep:sigma_e_m>0.100</lodestep:sigma_e_m>"));
        let mut reader = quick_xml::Reader::from_str(&text);
        while reader.read_event().unwrap() != Event::Eof {}
    }

    #[test]
    fn without_a_start_there_are_no_times() {
        assert!(!written(None).contains("<time>"));
    }
}
