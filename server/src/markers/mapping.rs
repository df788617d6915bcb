//! Which column of a file is what: guessed by the columns' names, put right by people.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Which column is what, by number from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "frame", rename_all = "snake_case", deny_unknown_fields)]
#[schemars(rename = "MarkerColumns")]
pub(crate) enum Mapping {
    /// In the site's frame, m.
    Local {
        /// The marker's name.
        name: usize,
        /// East.
        e_m: usize,
        /// North.
        n_m: usize,
        /// Up; `None`: the file leaves heights alone.
        u_m: Option<usize>,
    },
    /// On the WGS84 ellipsoid.
    Geographic {
        /// The marker's name.
        name: usize,
        /// Latitude, degrees.
        latitude_deg: usize,
        /// Longitude, degrees.
        longitude_deg: usize,
        /// Height above the ellipsoid, m; `None`: the file leaves heights alone.
        height_m: Option<usize>,
    },
}

const NAMES: &[&str] = &[
    "name",
    "marker",
    "pointname",
    "point",
    "id",
    "no",
    "number",
    "station",
    "actuator",
    "点名",
    "点号",
    "名称",
    "编号",
    "pointid",
    "pointno",
    "pointnumber",
    "markerid",
    "markername",
    "label",
    "target",
    "pt",
    "ptno",
    "ptid",
    "p",
    "punkt",
    "punktnummer",
    "punktnr",
    "nom",
    "nombre",
    "点",
    "点位",
    "点位编号",
    "测点",
    "测点编号",
    "测点号",
    "测点名",
    "控制点",
    "控制点号",
    "标志点编号",
    "促动器",
    "促动器编号",
    "标志点",
    "标志",
    "节点",
    "节点编号",
];
const EASTS: &[&str] =
    &["e", "east", "easting", "eastings", "rechtswert", "ost", "est", "este", "x", "东", "横", "东向"];
const NORTHS: &[&str] =
    &["n", "north", "northing", "northings", "hochwert", "nord", "norte", "y", "北", "纵", "北向"];
const UPS: &[&str] = &[
    "u",
    "up",
    "z",
    "h",
    "height",
    "elevation",
    "elev",
    "alt",
    "altitude",
    "hohe",
    "höhe",
    "大地高",
    "椭球高",
    "高",
    "高程",
    "高程h",
    "h高程",
    "标高",
    "正常高",
    "海拔",
    "海拔高",
    "海拔高度",
    "天",
];
/// What says of a column in Chinese, whatever else it says, which axis it is: `纵坐标X`, `北坐标(X)`, `X北`.
const NORTH_LETTERS: [char; 2] = ['北', '纵'];
const EAST_LETTERS: [char; 2] = ['东', '横'];
const LATITUDES: &[&str] = &["lat", "latitude", "b", "纬度"];
const LONGITUDES: &[&str] = &["lon", "lng", "long", "longitude", "l", "经度"];
/// Those of them that mean nothing else.
const LATITUDE_WORDS: &[&str] = &["lat", "latitude", "纬度"];
const LONGITUDE_WORDS: &[&str] = &["lon", "lng", "longitude", "经度"];
const HEIGHTS: &[&str] = &[
    "大地高",
    "椭球高",
    "大地高h",
    "ellipsoidheight",
    "ellipsoidalheight",
    "hae",
    "height",
    "h",
    "alt",
    "altitude",
    "elevation",
    "elev",
    "高",
    "高程",
    "标高",
    "正常高",
    "海拔",
    "海拔高",
    "海拔高度",
    "z",
];
/// Words of heights above the sea, or the quasi-geoid, in a column's name.
const SEA_LEVEL: &[&str] = &[
    "正常高",
    "正高",
    "海拔",
    "水准",
    "高程",
    "标高",
    "黄海",
    "1985",
    "orthometric",
    "msl",
    "asl",
    "elev",
    "geoid",
    "sea level",
    "sealevel",
];
/// … and of those above the ellipsoid.
const ELLIPSOIDAL: &[&str] = &["大地高", "椭球", "ellips", "hae", "height_m"];
/// Units that stand behind a column's name.
const UNITS: &[&str] = &["deg", "degrees", "metres", "meters", "米", "度", "m", "mm", "cm", "km", "ft"];
/// Units of length that a column or a row of units may name, in metres.
const LENGTHS: &[(&[&str], f64)] =
    &[(&["mm", "毫米"], 1e-3), (&["cm", "厘米"], 1e-2), (&["km", "千米", "公里"], 1e3), (&["ft"], 0.3048)];

impl Mapping {
    /// The mapping that the names of the columns suggest; `None` where name or plan coordinates are missing.
    pub(crate) fn guess(columns: &[String]) -> Option<Mapping> {
        let words: Vec<String> = columns.iter().map(|column| word(column)).collect();
        let axis = |of: &[&str]| columns.iter().position(|column| in_brackets(column, of));
        // Exactly the words, in the order in which they are listed: `name` is meant before `no`.
        let find = |known: &[&str]| known.iter().find_map(|word| words.iter().position(|w| w == word));
        let name = find(NAMES)?;
        let other = |index: Option<usize>| index.filter(|index| *index != name);
        // Two columns of one name: nobody but the user knows which is meant.
        let repeated =
            |at: usize| !words[at].is_empty() && words.iter().filter(|w| **w == words[at]).count() > 1;
        let coordinates = [EASTS, NORTHS, LATITUDE_WORDS, LONGITUDE_WORDS];
        if (0..words.len()).any(|at| repeated(at) && coordinates.iter().any(|of| of.contains(&&*words[at]))) {
            return None;
        }
        // What stands in brackets beside a letter says which axis it is, and so does a letter in the name.
        let letter = |of: [char; 2], not: [char; 2]| {
            let mut all = (0..columns.len())
                .filter(|at| *at != name && columns[*at].contains(of) && !columns[*at].contains(not));
            all.next().filter(|_| all.next().is_none())
        };
        let easts = axis(EAST_AXES).or_else(|| letter(EAST_LETTERS, NORTH_LETTERS));
        let norths = axis(NORTH_AXES).or_else(|| letter(NORTH_LETTERS, EAST_LETTERS));
        if let (Some(e_m), Some(n_m)) = (easts, norths) {
            return Some(Mapping::Local { name, e_m, n_m, u_m: other(find(UPS)) });
        }
        let (x, y) = (other(find(&["x"])), other(find(&["y"])));
        if let (Some(x), Some(y)) = (x, y)
            && is_of_surveyors(columns)
        {
            return Some(Mapping::Local { name, e_m: y, n_m: x, u_m: other(find(UPS)) });
        }
        // A survey that says both was perhaps made from another origin: degrees are the same everywhere.
        if let (Some(latitude_deg), Some(longitude_deg)) =
            (other(find(LATITUDE_WORDS)), other(find(LONGITUDE_WORDS)))
        {
            return Some(Mapping::Geographic {
                name,
                latitude_deg,
                longitude_deg,
                height_m: other(find(HEIGHTS)),
            });
        }
        match (other(find(EASTS)), other(find(NORTHS))) {
            (Some(e_m), Some(n_m)) => Some(Mapping::Local { name, e_m, n_m, u_m: other(find(UPS)) }),
            _ => Some(Mapping::Geographic {
                name,
                latitude_deg: other(find(LATITUDES))?,
                longitude_deg: other(find(LONGITUDES))?,
                height_m: other(find(HEIGHTS)),
            }),
        }
    }

    /// Whether its axes are called X and Y in a table of Chinese surveyors, with whom X goes north, and nothing says which is
    /// meant.
    pub(super) fn is_by_custom(self, columns: &[String]) -> bool {
        let (_, [e, n], _) = self.columns();
        let letter = |at: usize| {
            columns.get(at).is_some_and(|column| {
                matches!(word(column).as_str(), "x" | "y")
                    && !in_brackets(column, EAST_AXES)
                    && !in_brackets(column, NORTH_AXES)
            })
        };
        matches!(self, Mapping::Local { .. }) && letter(e) && letter(n) && is_of_surveyors(columns)
    }

    /// The same with the two axes of the plan changed over.
    pub(super) fn swapped(self) -> Mapping {
        match self {
            Mapping::Local { name, e_m, n_m, u_m } => Mapping::Local { name, e_m: n_m, n_m: e_m, u_m },
            Mapping::Geographic { name, latitude_deg, longitude_deg, height_m } => Mapping::Geographic {
                name,
                latitude_deg: longitude_deg,
                longitude_deg: latitude_deg,
                height_m,
            },
        }
    }

    /// The same columns read in the other frame; north and latitude are one axis.
    pub(super) fn in_the_other_frame(self) -> Mapping {
        match self {
            Mapping::Local { name, e_m, n_m, u_m } => {
                Mapping::Geographic { name, latitude_deg: n_m, longitude_deg: e_m, height_m: u_m }
            }
            Mapping::Geographic { name, latitude_deg, longitude_deg, height_m } => {
                Mapping::Local { name, e_m: longitude_deg, n_m: latitude_deg, u_m: height_m }
            }
        }
    }

    /// Name, the two axes as this frame names them (east, north; latitude, longitude), and the height.
    pub(super) fn columns(self) -> (usize, [usize; 2], Option<usize>) {
        match self {
            Mapping::Local { name, e_m, n_m, u_m } => (name, [e_m, n_m], u_m),
            Mapping::Geographic { name, latitude_deg, longitude_deg, height_m } => {
                (name, [latitude_deg, longitude_deg], height_m)
            }
        }
    }

    /// Whether the name of the column of heights says that they are above the sea, and not above the ellipsoid.
    pub(super) fn has_heights_above_the_sea(self, columns: &[String]) -> bool {
        let (_, _, height) = self.columns();
        let name = height.and_then(|at| columns.get(at)).map(|name| name.to_lowercase()).unwrap_or_default();
        let says = |words: &[&str]| words.iter().any(|word| name.contains(word));
        says(SEA_LEVEL) && !says(ELLIPSOIDAL)
    }

    /// The same without heights.
    pub(super) fn without_heights(self) -> Mapping {
        match self {
            Mapping::Local { name, e_m, n_m, .. } => Mapping::Local { name, e_m, n_m, u_m: None },
            Mapping::Geographic { name, latitude_deg, longitude_deg, .. } => {
                Mapping::Geographic { name, latitude_deg, longitude_deg, height_m: None }
            }
        }
    }

    /// Whether each column is there, and none is two things.
    pub(super) fn fits(self, columns: usize) -> bool {
        let (name, [first, second], height) = self.columns();
        let mut used = vec![name, first, second];
        used.extend(height);
        used.sort_unstable();
        used.iter().all(|index| *index < columns) && used.windows(2).all(|pair| pair[0] != pair[1])
    }
}

/// How many metres a 1 in a column is, by its name or the row of units below it.
pub(super) fn metres_in(column: &str, below: &str) -> f64 {
    let lower = column.to_lowercase();
    let inside = |open: &[char], close: &[char]| {
        let (_, rest) = lower.split_once(open)?;
        Some(rest.split(close).next().unwrap_or_default().trim().to_owned())
    };
    let last = lower.rsplit([' ', '_', '/']).next().unwrap_or_default().to_owned();
    let said = [inside(&['(', '（', '['], &[')', '）', ']']), Some(last), Some(below.trim().to_lowercase())];
    let bare = |unit: &str| unit.trim_matches(['(', ')', '[', ']', '（', '）']).to_owned();
    let of = |unit: String| {
        LENGTHS.iter().find(|(words, _)| words.contains(&&*bare(&unit))).map(|(_, metres)| *metres)
    };
    said.into_iter().flatten().find_map(of).unwrap_or(1.0)
}

/// What brackets say of an axis.
const NORTH_AXES: &[&str] = &["北", "n", "north", "northing", "北向", "纵"];
const EAST_AXES: &[&str] = &["东", "e", "east", "easting", "东向", "横"];

/// Whether what stands in a column's brackets is one of these words.
fn in_brackets(column: &str, words: &[&str]) -> bool {
    let lower = column.to_lowercase();
    let Some((_, rest)) = lower.split_once(['(', '（', '[']) else { return false };
    let inside = rest.split([')', '）', ']']).next().unwrap_or_default();
    inside.split([' ', ',', '，', '/', ';']).any(|word| words.contains(&word.trim()))
}

/// Whether a table's columns are named as Chinese surveyors name them: in Chinese, or with H for the height.
fn is_of_surveyors(columns: &[String]) -> bool {
    columns.iter().any(|column| column.chars().any(|c| ('\u{4e00}'..='\u{9fff}').contains(&c)))
}

/// A column's name without its unit, its brackets and what parts its words.
fn word(column: &str) -> String {
    let lower = column.to_lowercase();
    let bare = lower.split(['(', '（', '[', '/']).next().unwrap_or_default().trim();
    let parted: Vec<&str> = bare.split([' ', '_', '-', '.', ':']).filter(|part| !part.is_empty()).collect();
    let kept = match parted.split_last() {
        Some((last, rest)) if !rest.is_empty() && UNITS.contains(last) => rest,
        _ => &parted[..],
    };
    let whole = kept.concat();
    // `X坐标` is X.
    match whole.trim_end_matches("坐标").trim_start_matches("坐标").trim_end_matches('值') {
        "" => whole,
        axis => axis.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guess(header: &str) -> Option<Mapping> {
        Mapping::guess(&header.split(',').map(str::to_owned).collect::<Vec<_>>())
    }

    #[test]
    fn names_are_known_in_two_languages_and_any_order() {
        let local = |name, e_m, n_m, u_m| Some(Mapping::Local { name, e_m, n_m, u_m });
        assert_eq!(guess("name,e_m,n_m,u_m"), local(0, 1, 2, Some(3)));
        assert_eq!(guess("Height (m),North (m),East (m),No.,Point name"), local(4, 2, 1, Some(0)));
        assert_eq!(guess("编号,备注,北坐标(m),东坐标(m)"), local(0, 3, 2, None));
        let geographic =
            Mapping::Geographic { name: 2, latitude_deg: 1, longitude_deg: 0, height_m: Some(3) };
        assert_eq!(guess("lon_deg,lat_deg,name,height_m"), Some(geographic));
        assert_eq!(guess("经度,纬度,点名,大地高（米）"), Some(geographic));
    }

    #[test]
    fn brackets_say_which_axis_a_letter_is_and_custom_where_they_do_not() {
        let columns = |header: &str| header.split(',').map(str::to_owned).collect::<Vec<_>>();
        let north_first = Some(Mapping::Local { name: 0, e_m: 2, n_m: 1, u_m: Some(3) });
        for (header, by_custom) in
            [("点号,X(北),Y(东),H", false), ("No,X (north),Y (east),H", false), ("点号,X,Y,H", true)]
        {
            let guessed = guess(header);
            assert_eq!(guessed, north_first, "{header}");
            assert_eq!(guessed.unwrap().is_by_custom(&columns(header)), by_custom, "{header}");
        }
        let east_first = guess("name,x,y,z").unwrap();
        assert_eq!(east_first, Mapping::Local { name: 0, e_m: 1, n_m: 2, u_m: Some(3) });
        assert!(!east_first.is_by_custom(&columns("name,x,y,z")));
    }

    #[test]
    fn the_points_of_a_survey_are_read_by_their_degrees_whatever_origin_their_metres_have() {
        let header = "name,lat_deg,lon_deg,height_m,e_m,n_m,u_m,sigma_e_m,sigma_n_m,sigma_u_m,Code,Description,Lateral RMS";
        let geographic =
            Mapping::Geographic { name: 0, latitude_deg: 1, longitude_deg: 2, height_m: Some(3) };
        assert_eq!(guess(header), Some(geographic));
    }

    #[test]
    fn units_of_length_are_read_wherever_they_stand() {
        for (column, below, metres) in [
            ("E (mm)", "", 1e-3),
            ("e_cm", "", 1e-2),
            ("东坐标（km）", "", 1e3),
            ("X/mm", "", 1e-3),
            ("N", "(mm)", 1e-3),
            ("e_m", "", 1.0),
            ("E", "m", 1.0),
        ] {
            assert_eq!(metres_in(column, below), metres, "{column} {below}");
        }
        assert!(guess("name,e_cm,n_cm").is_some());
    }

    #[test]
    fn surveyors_programs_call_their_columns_many_things() {
        let north_first = Some(Mapping::Local { name: 0, e_m: 2, n_m: 1, u_m: Some(3) });
        for header in [
            "点号,纵坐标X(m),横坐标Y(m),高程H(m)",
            "测点,北坐标X,东坐标Y,高程",
            "点位,X坐标,Y坐标,Z坐标",
            "Pt,N(X),E(Y),Elev",
            "PointID,Northing (m),Easting (m),Elevation (m)",
            "Punktnr,Hochwert,Rechtswert,Höhe",
            "点名,X北,Y东,H",
        ] {
            assert_eq!(guess(header), north_first, "{header}");
        }
        assert_eq!(guess("点号,设计X,设计Y,X,Y,X,Y"), None, "which X is meant");
        let both = guess("点名,纬度,经度,正常高,大地高(m)").unwrap();
        assert_eq!(both.columns().2, Some(4), "the ellipsoid's");
        let columns = |header: &str| header.split(',').map(str::to_owned).collect::<Vec<_>>();
        for (header, sea) in [
            ("name,lat,lon,正常高", true),
            ("name,lat,lon,大地高", false),
            ("name,lat,lon,height_m", false),
            ("name,lat,lon,Elev (MSL)", true),
        ] {
            assert_eq!(
                guess(header)
                    .unwrap_or_else(|| panic!("{header}"))
                    .has_heights_above_the_sea(&columns(header)),
                sea,
                "{header}"
            );
        }
    }

    #[test]
    fn what_is_not_there_is_not_guessed() {
        assert_eq!(guess("name,a,b2"), None);
        assert_eq!(guess("e_m,n_m"), None);
    }

    #[test]
    fn a_mapping_uses_each_column_once() {
        let mapping = Mapping::Local { name: 0, e_m: 1, n_m: 2, u_m: Some(3) };
        assert!(mapping.fits(4) && !mapping.fits(3));
        assert!(!Mapping::Local { name: 0, e_m: 1, n_m: 1, u_m: None }.fits(4));
        assert_eq!(mapping.swapped().swapped(), mapping);
        assert_eq!(mapping.in_the_other_frame().in_the_other_frame(), mapping);
    }
}
