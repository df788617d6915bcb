//! Markers as CSV: `name,e_m,n_m,u_m` or `name,lat_deg,lon_deg,height_m`, in UTF-8 or GBK, which is
//! what a Chinese spreadsheet saves.

use std::borrow::Cow;
use std::collections::HashMap;
use std::fmt::Write as _;

use crate::parse::error::{ParseError, ParseErrorKind, quoted};
use crate::parse::header::Header;
use crate::parse::number::need_finite;
use crate::parse::records::Record;
use crate::parse::{table, table_text};

const LOCAL: [&str; 4] = ["name", "e_m", "n_m", "u_m"];
const GEODETIC: [&str; 4] = ["name", "lat_deg", "lon_deg", "height_m"];
const KNOWN: [&str; 7] = ["name", "e_m", "n_m", "u_m", "lat_deg", "lon_deg", "height_m"];
/// Farther from the site's origin than this, the flat frame is no place to work in.
const FARTHEST_M: f64 = 100_000.0;

/// A surveyed anchor as the file gives it.
#[derive(Clone, Debug, PartialEq)]
pub struct MarkerRow {
    /// The marker's name, which is unique in the file.
    pub name: String,
    /// Where it is.
    pub place: MarkerPlace,
}

/// Where a marker is, in one of the two ways in which people have surveyed it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MarkerPlace {
    /// In the site's frame.
    Local {
        /// East of the site's origin, m.
        e_m: f64,
        /// North of the site's origin, m.
        n_m: f64,
        /// Above the site's origin, m; `None` where no height was surveyed.
        u_m: Option<f64>,
    },
    /// On the WGS84 ellipsoid.
    Geodetic {
        /// Latitude, degrees.
        latitude_deg: f64,
        /// Longitude, degrees.
        longitude_deg: f64,
        /// Height above the ellipsoid, m; `None` where no height was surveyed.
        height_m: Option<f64>,
    },
}

impl MarkerPlace {
    /// East, north and, where it was surveyed, up in a site's frame, m.
    pub fn to_local_m(&self, frame: &crate::geo::LocalFrame) -> (f64, f64, Option<f64>) {
        match *self {
            MarkerPlace::Local { e_m, n_m, u_m } => (e_m, n_m, u_m),
            MarkerPlace::Geodetic { latitude_deg, longitude_deg, height_m } => {
                // Without a height the plan position is taken at the origin's height: 100 m more
                // would move it by 16 mm for each km from the origin.
                let at = crate::geo::Geodetic {
                    latitude_deg,
                    longitude_deg,
                    height_m: height_m.unwrap_or(frame.origin().height_m),
                };
                let [e, n, u] = frame.to_local_m(at);
                (e, n, height_m.map(|_| u))
            }
        }
    }
}

/// Reads a file of markers.
///
/// # Errors
///
/// At the first thing that is wrong, a name that is there twice included.
pub fn read(bytes: &[u8]) -> Result<Vec<MarkerRow>, ParseError> {
    let text = decode(bytes)?;
    let mut seen: HashMap<String, u64> = HashMap::new();
    table::read(text.as_bytes(), &LOCAL.join(","), Places::find, |places, record| {
        let marker = places.marker(record)?;
        if let Some(first) = seen.insert(marker.name.clone(), record.line) {
            return Err(ParseError::new(
                ParseErrorKind::RepeatedName,
                "every marker once",
                format!("{} in line {first} already", quoted(marker.name.as_bytes())),
                "remove or rename one of the two",
            )
            .at_line(record.line)
            .in_column("name"));
        }
        Ok(marker)
    })
}

/// Markers in the site's frame as CSV, which [`read`] takes back unchanged. It begins with the mark by which spreadsheets
/// know UTF-8; without it one on a Chinese Windows takes it for GBK, and no name survives.
pub fn write<'a>(markers: impl IntoIterator<Item = (&'a str, f64, f64, Option<f64>)>) -> String {
    let mut out = format!("\u{feff}{}\n", LOCAL.join(","));
    for (name, e_m, n_m, u_m) in markers {
        table::push_name(name, &mut out);
        write!(out, ",{e_m},{n_m},").expect("writing to a string cannot fail");
        if let Some(u_m) = u_m {
            write!(out, "{u_m}").expect("writing to a string cannot fail");
        }
        out.push('\n');
    }
    out
}

/// Text in UTF-8 or UTF-16, or else GBK.
pub(super) fn decode(bytes: &[u8]) -> Result<Cow<'_, str>, ParseError> {
    table_text::decode(bytes).map(|(_, text)| text)
}

struct Places {
    name: usize,
    plan: [usize; 2],
    height: Option<usize>,
    columns: [&'static str; 4],
}

impl Places {
    fn find(header: &Header) -> Result<Places, ParseError> {
        let geodetic = header.find("e_m").is_none() && header.find("lat_deg").is_some();
        let columns = if geodetic { GEODETIC } else { LOCAL };
        Ok(Places {
            name: header.need(columns[0], &KNOWN)?,
            plan: [header.need(columns[1], &KNOWN)?, header.need(columns[2], &KNOWN)?],
            height: header.find(columns[3]),
            columns,
        })
    }

    fn marker(&self, record: &Record<'_>) -> Result<MarkerRow, ParseError> {
        let geodetic = self.columns == GEODETIC;
        let limits = if geodetic { [90.0, 180.0] } else { [FARTHEST_M; 2] };
        let bounded = |index: usize, column: &str, limit: f64| {
            let value = need_finite(record, index, column)?;
            if value.abs() <= limit {
                return Ok(value);
            }
            Err(ParseError::new(
                ParseErrorKind::OutOfRange,
                format!("a value from −{limit} to {limit}"),
                quoted(record.field(index)),
                "check the unit and the order of the columns",
            )
            .at_line(record.line)
            .in_column(column))
        };
        let first = bounded(self.plan[0], self.columns[1], limits[0])?;
        let second = bounded(self.plan[1], self.columns[2], limits[1])?;
        let height = match self.height {
            Some(index) if !record.field(index).trim_ascii().is_empty() => {
                Some(bounded(index, self.columns[3], FARTHEST_M)?)
            }
            _ => None,
        };
        let place = if geodetic {
            MarkerPlace::Geodetic { latitude_deg: first, longitude_deg: second, height_m: height }
        } else {
            MarkerPlace::Local { e_m: first, n_m: second, u_m: height }
        };
        Ok(MarkerRow { name: table::name(record, self.name, "name")?, place })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn code(text: &str) -> &'static str {
        read(text.as_bytes()).unwrap_err().code()
    }

    #[test]
    fn both_ways_of_surveying_are_read() {
        let local =
            read("\u{feff}u_m,name,e_m,n_m\r\n1.5, A17 ,10,-20\r\n,\"B, 2\",0,0\r\n".as_bytes()).unwrap();
        assert_eq!(local[0].name, "A17");
        assert_eq!(local[0].place, MarkerPlace::Local { e_m: 10.0, n_m: -20.0, u_m: Some(1.5) });
        assert_eq!(local[1].name, "B, 2");
        assert_eq!(local[1].place, MarkerPlace::Local { e_m: 0.0, n_m: 0.0, u_m: None });
        let geodetic = read(b"name,lat_deg,lon_deg,height_m\nA,25.652944,106.856667,1120\n").unwrap();
        let (e, n, u) = geodetic[0].place.to_local_m(&crate::geo::Site::fast().local_frame());
        assert!(e.abs() < 1e-6 && n.abs() < 1e-6 && (u.unwrap() - 10.0).abs() < 1e-6);
        assert_eq!(read(b"name,e_m,n_m\nA,1,2\n").unwrap().len(), 1);
    }

    #[test]
    fn gbk_is_read() {
        let (bytes, _, _) = encoding_rs::GBK.encode("name,e_m,n_m,u_m,备注\n促动器一号,1,2,3,好\n");
        assert_eq!(read(&bytes).unwrap()[0].name, "促动器一号");
    }

    #[test]
    fn what_is_wrong_is_named() {
        assert_eq!(code("name,e_m,n_m,u_m\nA,1,2,3\nA,1,2,3\n"), "repeated_name");
        assert_eq!(code("name,e_m,n_m,u_m\n,1,2,3\n"), "empty_field");
        assert_eq!(code("name,e_m,n_m,u_m\nA,nan,2,3\n"), "not_a_number");
        assert_eq!(code("name,lat_deg,lon_deg,height_m\nA,106.8,25.6,3\n"), "out_of_range");
        assert_eq!(code("name,e_m,n_m,u_m\nA,2856000,1,3\n"), "out_of_range");
        assert_eq!(code("name,x,y\nA,1,2\n"), "missing_column");
        assert_eq!(code(""), "empty_file");
        assert_eq!(code("name,e_m,n_m\nA\u{7}B,1,2\n"), "not_text");
        let error = read(b"name,e_m,n_m\nA,1,2\n\xFF\xFFx,1,2\n").unwrap_err();
        assert_eq!((error.code(), error.line), ("unknown_encoding", Some(3)));
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_again(
            name in "[=+@'A-Za-z0-9,\" 一-龥-]{0,18}[A-Z]",
            e in -9e4..9e4_f64, n in -9e4..9e4_f64, u in prop::option::of(-500.0..500.0_f64),
        ) {
            prop_assume!(crate::parse::names::cleaned(&name) == name && !name.starts_with('\''));
            let text = write([(name.as_str(), e, n, u)]);
            let back = read(text.as_bytes()).unwrap();
            prop_assert_eq!(&back[0].name, &name);
            prop_assert_eq!(back[0].place, MarkerPlace::Local { e_m: e, n_m: n, u_m: u });
        }

        #[test]
        fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            let _ = read(&bytes);
        }
    }
}
