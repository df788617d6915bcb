//! Surveyed points as a file: our own columns, and what surveying programs read.

use std::fmt::Write as _;

use crate::csv_cell::harmless;

/// The shapes in which points are given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    /// A table with all that is known, which an import of markers takes.
    Csv,
    /// Point, northing, easting, elevation, description: the table without a header that most programs of surveyors read.
    Pnezd,
    /// `LandXML` 1.2, points of coordinate geometry.
    LandXml,
}

impl Form {
    /// The ending of a file's name.
    pub(crate) fn extension(self) -> &'static str {
        match self {
            Form::Csv => "csv",
            Form::Pnezd => "txt",
            Form::LandXml => "xml",
        }
    }

    /// By the ending of a file's name; our own columns for any other.
    pub(crate) fn of_extension(extension: &str) -> Form {
        let named = [Form::Pnezd, Form::LandXml].into_iter().find(|form| form.extension() == extension);
        named.unwrap_or(Form::Csv)
    }
}

/// A surveyed point as it stands in a file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FilePoint {
    pub(crate) name: String,
    pub(crate) code: String,
    /// Latitude and longitude, degrees, and the height above the ellipsoid, m.
    pub(crate) wgs84: [f64; 3],
    /// East, north and up of the site's origin, m.
    pub(crate) place_m: [f64; 3],
    /// Sigmas of these, m.
    pub(crate) sigma_m: [f64; 3],
}

/// The file.
pub(crate) fn write_points(form: Form, points: &[FilePoint]) -> String {
    match form {
        Form::Csv => csv(points),
        Form::Pnezd => pnezd(points),
        Form::LandXml => land_xml(points),
    }
}

// A string takes whatever is written to it: what `write!` gives back below says nothing.

fn csv(points: &[FilePoint]) -> String {
    // By its mark a spreadsheet knows UTF-8.
    let mut text =
        "\u{feff}name,lat_deg,lon_deg,height_m,e_m,n_m,u_m,sigma_e_m,sigma_n_m,sigma_u_m,Code\n".to_owned();
    for point in points {
        let ([lat, lon, height], [e, n, u], [se, sn, su]) = (point.wgs84, point.place_m, point.sigma_m);
        let _ = writeln!(
            text,
            "{},{lat:.10},{lon:.10},{height:.4},{e:.4},{n:.4},{u:.4},{se:.4},{sn:.4},{su:.4},{}",
            cell(&point.name),
            cell(&point.code)
        );
    }
    text
}

fn pnezd(points: &[FilePoint]) -> String {
    let mut text = String::new();
    for point in points {
        let ([e, n, _], [_, _, height]) = (point.place_m, point.wgs84);
        let _ = writeln!(text, "{},{n:.4},{e:.4},{height:.4},{}", cell(&point.name), cell(&told(point)));
    }
    text
}

fn land_xml(points: &[FilePoint]) -> String {
    let mut text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
        <LandXML xmlns=\"http://www.landxml.org/schema/LandXML-1.2\" version=\"1.2\">\n\
        \x20 <Units><Metric areaUnit=\"squareMeter\" linearUnit=\"meter\" volumeUnit=\"cubicMeter\" \
        temperatureUnit=\"celsius\" pressureUnit=\"milliBars\"/></Units>\n\
        \x20 <CoordinateSystem desc=\"north and east in the plane of the site; height above the WGS84 ellipsoid\"/>\n\
        \x20 <CgPoints>\n"
        .to_owned();
    for point in points {
        let ([e, n, _], [_, _, height]) = (point.place_m, point.wgs84);
        let _ = writeln!(
            text,
            "    <CgPoint name=\"{}\" code=\"{}\" desc=\"{}\">{n:.4} {e:.4} {height:.4}</CgPoint>",
            escaped(&point.name),
            escaped(&point.code),
            escaped(&told(point))
        );
    }
    text.push_str("  </CgPoints>\n</LandXML>\n");
    text
}

/// Its code, and how sure it is: the only place for that in these forms.
fn told(point: &FilePoint) -> String {
    let [e, n, u] = point.sigma_m;
    format!("{} sigma {n:.3} {e:.3} {u:.3}", point.code).trim_start().to_owned()
}

/// A text as a cell: as it is where it can be.
pub(crate) fn cell(text: &str) -> String {
    let plain = text.chars().all(|c| c.is_alphanumeric() || matches!(c, ' ' | '_' | '.' | '#' | '/'));
    if plain { text.to_owned() } else { harmless(text) }
}

fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars().filter(|c| !c.is_control()) {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point() -> FilePoint {
        FilePoint {
            name: "A<1>, \"south\"".to_owned(),
            code: "ACT".to_owned(),
            wgs84: [25.65, 106.85, 1112.5],
            place_m: [1.0, 2.0, 2.5],
            sigma_m: [0.011, 0.012, 0.013],
        }
    }

    #[test]
    fn programs_of_surveyors_get_north_before_east_and_the_height_of_the_ellipsoid() {
        let points = [FilePoint { name: "A1".to_owned(), ..point() }];
        assert_eq!(
            write_points(Form::Pnezd, &points),
            "A1,2.0000,1.0000,1112.5000,ACT sigma 0.012 0.011 0.013\n"
        );
        let xml = write_points(Form::LandXml, &points);
        assert!(xml.contains(">2.0000 1.0000 1112.5000</CgPoint>"), "{xml}");
    }

    #[test]
    fn names_cannot_break_out_of_a_file() {
        let xml = write_points(Form::LandXml, &[point()]);
        assert!(xml.contains("name=\"A&lt;1&gt;, &quot;south&quot;\""), "{xml}");
        let csv = write_points(Form::Csv, &[FilePoint { name: "=A1".to_owned(), ..point() }]);
        assert!(!csv.lines().nth(1).unwrap().starts_with('='), "{csv}");
        assert_eq!(Form::of_extension("xml"), Form::LandXml);
    }
}
