//! A site: where its origin lies, and which way gravity and the magnetic field point there.

use serde::{Deserialize, Serialize};

use super::ellipsoid::Geodetic;
use super::gravity::normal_gravity_m_s2;
use super::local_frame::LocalFrame;
use super::magnetic_field::MagneticField;

/// The decimal year for which a site's magnetic field is computed when its file names none.
pub const DEFAULT_MAGNETIC_YEAR: f64 = 2026.5;

/// A place of work. Its local frame is east-north-up with the origin at these coordinates, so `u` is
/// the height above `height_m`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Site {
    /// What people call it.
    #[cfg_attr(feature = "schema", schemars(example = &"FAST"))]
    pub name: String,
    /// Latitude of the origin, degrees.
    #[cfg_attr(feature = "schema", schemars(example = 25.652_9))]
    pub latitude_deg: f64,
    /// Longitude of the origin, degrees.
    #[cfg_attr(feature = "schema", schemars(example = 106.856_7))]
    pub longitude_deg: f64,
    /// Height of the origin above the WGS84 ellipsoid, m.
    #[cfg_attr(feature = "schema", schemars(example = 841.0))]
    pub height_m: f64,
    /// Gravity at the origin, m/s².
    #[cfg_attr(feature = "schema", schemars(example = 9.787))]
    pub gravity_m_s2: f64,
    /// Magnetic declination, east of true north positive, degrees.
    #[cfg_attr(feature = "schema", schemars(example = -2.1))]
    pub declination_deg: f64,
    /// Magnetic inclination, below the horizon positive, degrees.
    #[cfg_attr(feature = "schema", schemars(example = 38.0))]
    pub inclination_deg: f64,
    /// Magnitude of the magnetic field, µT.
    #[cfg_attr(feature = "schema", schemars(example = 48.9))]
    pub field_ut: f64,
    /// Azimuth of the plan's +y axis, clockwise from true north, degrees: the published table of the
    /// reflector's nodes does not say that its +y is north.
    #[cfg_attr(feature = "schema", schemars(example = 0.0))]
    pub azimuth_of_plan_deg: f64,
}

/// What a magnetometer sees of a site's undisturbed field without knowing where north is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SiteField {
    /// Its magnitude, µT.
    pub strength_ut: f64,
    /// Its dip, below the horizon positive, rad.
    pub dip_rad: f64,
}

impl SiteField {
    /// The horizontal part, µT.
    pub fn horizontal_ut(&self) -> f64 {
        self.strength_ut * libm::cos(self.dip_rad)
    }

    /// The vertical part, downwards, µT.
    pub fn down_ut(&self) -> f64 {
        self.strength_ut * libm::sin(self.dip_rad)
    }
}

/// A site's file. What can be computed may be left out.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SiteFile {
    name: String,
    latitude_deg: f64,
    longitude_deg: f64,
    height_m: f64,
    gravity_m_s2: Option<f64>,
    magnetic_year: Option<f64>,
    declination_deg: Option<f64>,
    inclination_deg: Option<f64>,
    field_ut: Option<f64>,
    #[serde(default)]
    azimuth_of_plan_deg: f64,
}

/// What is wrong with a site's file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SiteError {
    /// Not TOML, a key that is missing, unknown, or of the wrong type; the message names it and its line.
    #[error(
        "the site file does not read: {0}. Keys: name, latitude_deg, longitude_deg, height_m; and, where the \
         computed value does not suit, gravity_m_s2, magnetic_year, declination_deg, inclination_deg, \
         field_ut, azimuth_of_plan_deg"
    )]
    Unreadable(String),
    /// A value that cannot be.
    #[error("the site file's {key} must lie between {least} and {most}, but is {found}")]
    OutOfRange {
        /// The key.
        key: &'static str,
        /// The least that is possible.
        least: f64,
        /// The most that is possible.
        most: f64,
        /// What the file says.
        found: f64,
    },
}

impl Site {
    /// A site with normal gravity and the magnetic field that the model gives for a decimal year.
    pub fn at(name: &str, origin: Geodetic, decimal_year: f64) -> Site {
        let field = MagneticField::at(origin, decimal_year);
        Site {
            name: name.to_owned(),
            latitude_deg: origin.latitude_deg,
            longitude_deg: origin.longitude_deg,
            height_m: origin.height_m,
            gravity_m_s2: normal_gravity_m_s2(origin.latitude_deg, origin.height_m),
            declination_deg: field.declination_deg(),
            inclination_deg: field.inclination_deg(),
            field_ut: field.magnitude_ut(),
            azimuth_of_plan_deg: 0.0,
        }
    }

    /// FAST, the 500 m telescope in Guizhou. The origin's height is taken as that of the reflector's
    /// lowest node: `u` = 0 there, about 4 m above the ground.
    pub fn fast() -> Site {
        let origin = Geodetic { latitude_deg: 25.652_944, longitude_deg: 106.856_667, height_m: 1110.0 };
        Site::at("FAST", origin, DEFAULT_MAGNETIC_YEAR)
    }

    /// Reads a site's TOML file.
    pub fn from_toml(text: &str) -> Result<Site, SiteError> {
        let file: SiteFile = toml::from_str(text)
            .map_err(|error| SiteError::Unreadable(error.to_string().trim().to_owned()))?;
        let within = |key, found: f64, least: f64, most: f64| {
            if (least..=most).contains(&found) {
                Ok(found)
            } else {
                Err(SiteError::OutOfRange { key, least, most, found })
            }
        };
        let origin = Geodetic {
            latitude_deg: within("latitude_deg", file.latitude_deg, -90.0, 90.0)?,
            longitude_deg: within("longitude_deg", file.longitude_deg, -180.0, 180.0)?,
            height_m: within("height_m", file.height_m, -1000.0, 9000.0)?,
        };
        let year =
            within("magnetic_year", file.magnetic_year.unwrap_or(DEFAULT_MAGNETIC_YEAR), 2020.0, 2035.0)?;
        let computed = Site::at(&file.name, origin, year);
        Ok(Site {
            gravity_m_s2: within(
                "gravity_m_s2",
                file.gravity_m_s2.unwrap_or(computed.gravity_m_s2),
                9.7,
                9.9,
            )?,
            declination_deg: within(
                "declination_deg",
                file.declination_deg.unwrap_or(computed.declination_deg),
                -180.0,
                180.0,
            )?,
            inclination_deg: within(
                "inclination_deg",
                file.inclination_deg.unwrap_or(computed.inclination_deg),
                -90.0,
                90.0,
            )?,
            field_ut: within("field_ut", file.field_ut.unwrap_or(computed.field_ut), 15.0, 75.0)?,
            azimuth_of_plan_deg: within("azimuth_of_plan_deg", file.azimuth_of_plan_deg, -360.0, 360.0)?,
            ..computed
        })
    }

    /// The geodetic place of the local frame's origin.
    pub fn origin(&self) -> Geodetic {
        Geodetic {
            latitude_deg: self.latitude_deg,
            longitude_deg: self.longitude_deg,
            height_m: self.height_m,
        }
    }

    /// The local frame, east-north-up.
    pub fn local_frame(&self) -> LocalFrame {
        LocalFrame::new(self.origin())
    }

    /// The undisturbed magnetic field.
    pub fn magnetic_field(&self) -> MagneticField {
        MagneticField::from_angles(self.declination_deg, self.inclination_deg, self.field_ut)
    }

    /// Strength and dip of that field.
    pub fn field(&self) -> SiteField {
        SiteField { strength_ut: self.field_ut, dip_rad: self.inclination_deg.to_radians() }
    }

    /// The declination that the model gives for a decimal year, degrees.
    pub fn declination_in_deg(&self, decimal_year: f64) -> f64 {
        MagneticField::at(self.origin(), decimal_year).declination_deg()
    }
}

impl Default for Site {
    fn default() -> Self {
        Site::fast()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fast_by_default() {
        let site = Site::default();
        assert!((site.gravity_m_s2 - 9.787).abs() < 5e-4);
        assert!((site.declination_deg + 2.45).abs() < 0.02);
    }

    #[test]
    fn a_file_with_the_least_is_computed_and_a_given_value_wins() {
        let text =
            "name = \"Test\"\nlatitude_deg = 25.652944\nlongitude_deg = 106.856667\nheight_m = 1110.0\n";
        let site = Site::from_toml(text).unwrap();
        assert_eq!(site, Site { name: "Test".into(), ..Site::fast() });
        let given =
            Site::from_toml(&format!("{text}declination_deg = 1.5\nmagnetic_year = 2029.0\n")).unwrap();
        assert_eq!(given.declination_deg, 1.5);
        assert!(given.inclination_deg != site.inclination_deg);
    }

    #[test]
    fn errors_name_the_key() {
        let unknown =
            Site::from_toml("name = \"a\"\nlatitude_deg = 1\nlongitude_deg = 2\nheight_m = 3\nlatitud = 4\n");
        assert!(unknown.unwrap_err().to_string().contains("latitud"));
        let missing =
            Site::from_toml("name = \"a\"\nlatitude_deg = 1\nheight_m = 3\n").unwrap_err().to_string();
        assert!(missing.contains("missing field `longitude_deg`"), "{missing}");
        let text = "name = \"a\"\nlatitude_deg = 91.0\nlongitude_deg = 2.0\nheight_m = 3.0\n";
        let range = Site::from_toml(text).unwrap_err();
        assert!(matches!(range, SiteError::OutOfRange { key: "latitude_deg", .. }), "{range}");
        let kind = Site::from_toml("name = 3\n").unwrap_err().to_string();
        assert!(kind.contains("name"), "{kind}");
        let nan = text.replace("91.0", "nan");
        assert!(Site::from_toml(&nan).is_err());
    }
}
