//! What is known of a rover's instruments beforehand: `rover.toml`, all of it optional.

use serde::Deserialize;

use super::anchors::distance_m;
use crate::geo::Geodetic;
use crate::sample::SurveyedAnchor;

/// A `rover.toml` that says all that can be said, but for how good observations are, which is learnt.
pub(super) const EXAMPLE: &str = "[base]
latitude_deg = 25.652944
longitude_deg = 106.856667
height_m = 1110.0

[uwb]
# UWB antenna minus satellite antenna, east north up, metres
antenna_offset_m = [0.0, 0.0, -0.35]

# east, north and up of the base's antenna, metres
[[anchors]]
name = \"A1\"
e_m = 12.30
n_m = 4.85
u_m = 2.10

[[anchors]]
name = \"A2\"
e_m = 21.75
n_m = 4.90
u_m = 3.05

[[anchors]]
name = \"A3\"
e_m = 17.20
n_m = 15.40
u_m = 2.60
";

/// The rover's instruments.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Instrument {
    /// The base's antenna, where the base's file does not say it or says it wrong.
    pub base: Option<Place>,
    /// What the metres of a session count from, where the session itself does not say it.
    pub site: Option<Place>,
    /// The surveyed anchors.
    pub anchors: Vec<Anchor>,
    /// The UWB tag.
    pub uwb: Tag,
    /// How ambiguities are treated.
    pub ambiguities: Ambiguities,
    /// The satellite receiver.
    pub gnss: Receiver,
}

/// A place on WGS84.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Place {
    /// Degrees north.
    pub latitude_deg: f64,
    /// Degrees east.
    pub longitude_deg: f64,
    /// Above the ellipsoid, m.
    pub height_m: f64,
}

impl Place {
    /// As the Earth's part has it.
    pub fn geodetic(self) -> Geodetic {
        let Place { latitude_deg, longitude_deg, height_m } = self;
        Geodetic { latitude_deg, longitude_deg, height_m }
    }

    fn is_on_earth(&self) -> bool {
        self.latitude_deg.abs() <= 90.0
            && self.longitude_deg.abs() <= 360.0
            && (-1000.0..20_000.0).contains(&self.height_m)
    }
}

/// An anchor, surveyed in the tangent plane at the base's antenna; without satellites in any plane.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Anchor {
    /// Its name, as the ranges spell it.
    pub name: String,
    /// East, m.
    pub e_m: f64,
    /// North, m.
    pub n_m: f64,
    /// Up, m.
    pub u_m: f64,
}

impl From<&Anchor> for SurveyedAnchor {
    fn from(anchor: &Anchor) -> SurveyedAnchor {
        SurveyedAnchor { name: anchor.name.clone(), p_n: [anchor.e_m, anchor.n_m, anchor.u_m] }
    }
}

impl From<SurveyedAnchor> for Anchor {
    fn from(SurveyedAnchor { name, p_n: [e_m, n_m, u_m] }: SurveyedAnchor) -> Anchor {
        Anchor { name, e_m, n_m, u_m }
    }
}

/// The UWB tag.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Tag {
    /// UWB antenna minus satellite antenna: east, north, up, m.
    pub antenna_offset_m: [f64; 3],
    /// Height of the UWB antenna in the anchors' frame, m, where it is known.
    pub antenna_height_m: Option<f64>,
    /// Its standard deviation, m; 0.1 where only the height is given.
    pub antenna_height_sigma_m: Option<f64>,
    /// Standard deviation of a range, m.
    pub range_sigma_m: Option<f64>,
    /// What ranges have too much, m: the same for all anchors until more is learnt.
    pub range_bias_m: Option<f64>,
}

/// How ambiguities are treated.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Ambiguities {
    /// Carried from epoch to epoch, or not.
    pub mode: AmbiguityMode,
}

/// Whether ambiguities are carried.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AmbiguityMode {
    /// From epoch to epoch, until the receiver loses the satellite.
    #[default]
    Carried,
    /// Every epoch by itself: nothing is carried, for checks.
    Epoch,
}

/// The satellite receiver.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Receiver {
    /// Standard deviation of a code observation at the zenith, m; learnt where it is not given.
    pub code_sigma_m: Option<f64>,
    /// Standard deviation of a phase observation at the zenith, m; learnt where it is not given.
    pub phase_sigma_m: Option<f64>,
    /// Satellites below are left out, degrees; 10 where it is not given.
    pub elevation_mask_deg: Option<f64>,
}

/// A `rover.toml` that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct InstrumentError(String);

impl Instrument {
    /// Reads the text of a `rover.toml`.
    ///
    /// # Errors
    ///
    /// A key that is not known, a value of the wrong kind or out of its range, each with its place.
    pub fn from_toml(text: &str) -> Result<Instrument, InstrumentError> {
        let instrument: Instrument =
            toml::from_str(text).map_err(|error| InstrumentError(error.to_string().trim_end().to_owned()))?;
        let positive = [
            ("[uwb] antenna_height_sigma_m", instrument.uwb.antenna_height_sigma_m),
            ("[uwb] range_sigma_m", instrument.uwb.range_sigma_m),
            ("[gnss] code_sigma_m", instrument.gnss.code_sigma_m),
            ("[gnss] phase_sigma_m", instrument.gnss.phase_sigma_m),
        ];
        for (name, value) in positive {
            if let Some(value) = value
                && !(value > 0.0 && value < 1000.0)
            {
                return Err(InstrumentError(format!(
                    "{name}: expected metres above 0 and below 1000, found {value}"
                )));
            }
        }
        if let Some(mask) = instrument.gnss.elevation_mask_deg
            && !(0.0..90.0).contains(&mask)
        {
            return Err(InstrumentError(format!(
                "[gnss] elevation_mask_deg: expected 0 to 90 degrees, found {mask}"
            )));
        }
        for (name, place) in [("[base]", &instrument.base), ("[site]", &instrument.site)] {
            if let Some(place) = place
                && !place.is_on_earth()
            {
                return Err(InstrumentError(format!(
                    "{name}: expected degrees north, degrees east and metres above the ellipsoid, found {}, {}, {}",
                    place.latitude_deg, place.longitude_deg, place.height_m
                )));
            }
        }
        instrument.check_anchors()?;
        let lengths = instrument.uwb.antenna_offset_m.iter().chain(&instrument.uwb.antenna_height_m);
        if let Some(odd) = lengths.chain(&instrument.uwb.range_bias_m).find(|length| !length.is_finite()) {
            return Err(InstrumentError(format!("[uwb]: expected metres, found {odd}")));
        }
        Ok(instrument)
    }

    /// The surveyed anchors.
    pub fn surveyed(&self) -> Vec<SurveyedAnchor> {
        self.anchors.iter().map(SurveyedAnchor::from).collect()
    }

    fn check_anchors(&self) -> Result<(), InstrumentError> {
        /// Farther from the base than this it is no plane to work in.
        const FARTHEST_M: f64 = 100_000.0;
        /// Two antennas do not hang in one place.
        const NEAREST_M: f64 = 0.01;
        let surveyed = self.surveyed();
        for (k, anchor) in surveyed.iter().enumerate() {
            let name = &anchor.name;
            if name.trim().is_empty() {
                return Err(InstrumentError("[[anchors]]: expected a name, found none".to_owned()));
            }
            if let Some(odd) = anchor.p_n.iter().find(|x| x.is_nan() || x.abs() > FARTHEST_M) {
                return Err(InstrumentError(format!(
                    "[[anchors]] {name}: expected metres from the base, found {odd}"
                )));
            }
            for other in &surveyed[..k] {
                if other.name == *name {
                    return Err(InstrumentError(format!(
                        "[[anchors]]: expected every anchor once, found {name} twice"
                    )));
                }
                if distance_m(&other.p_n, &anchor.p_n) < NEAREST_M {
                    return Err(InstrumentError(format!(
                        "[[anchors]]: expected every anchor in a place of its own, found {name} where {} is",
                        other.name
                    )));
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_file_is_an_instrument_of_which_nothing_is_known() {
        assert_eq!(Instrument::from_toml("").unwrap(), Instrument::default());
    }

    #[test]
    fn every_key_is_read() {
        let text = "[uwb]\nantenna_offset_m = [0.0, 0.1, -0.2]\nantenna_height_m = 1.0\nantenna_height_sigma_m = 0.2\n\
                    range_sigma_m = 0.1\nrange_bias_m = 0.2\n[ambiguities]\nmode = \"epoch\"\n\
                    [gnss]\ncode_sigma_m = 3.0\nphase_sigma_m = 0.006\nelevation_mask_deg = 10\n";
        let read = Instrument::from_toml(text).unwrap();
        assert_eq!(read.uwb.antenna_offset_m, [0.0, 0.1, -0.2]);
        assert_eq!(read.uwb.antenna_height_sigma_m, Some(0.2));
        assert_eq!(read.ambiguities.mode, AmbiguityMode::Epoch);
        assert_eq!(read.gnss.elevation_mask_deg, Some(10.0));
    }

    #[test]
    fn the_example_is_read_and_anchors_that_cannot_be_are_named() {
        let read = Instrument::from_toml(EXAMPLE).unwrap();
        assert_eq!((read.surveyed().len(), read.anchors[2].name.as_str()), (3, "A3"));
        assert_eq!(read.base.unwrap().geodetic().height_m, 1110.0);
        for (from, to, said) in [
            ("\"A2\"", "\"A1\"", "A1 twice"),
            ("e_m = 12.30", "e_m = 482300.0", "482300"),
            ("latitude_deg = 25.652944", "latitude_deg = 125.0", "[base]"),
            ("u_m = 2.10", "up_m = 2.10", "up_m"),
        ] {
            let error = Instrument::from_toml(&EXAMPLE.replace(from, to)).unwrap_err().to_string();
            assert!(error.contains(said), "{error}");
        }
    }

    #[test]
    fn a_misspelt_key_and_a_negative_sigma_are_named() {
        assert!(
            Instrument::from_toml("[gnss]\ncode_sigma = 1.0\n")
                .unwrap_err()
                .to_string()
                .contains("code_sigma")
        );
        let error = Instrument::from_toml("[gnss]\nphase_sigma_m = -0.003\n").unwrap_err().to_string();
        assert!(error.contains("phase_sigma_m") && error.contains("-0.003"), "{error}");
    }
}
