//! What is known of a rover's instruments beforehand: `rover.toml`, all of it optional.

use serde::Deserialize;

/// The rover's instruments.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Instrument {
    /// The UWB tag.
    pub uwb: Tag,
    /// How ambiguities are treated.
    pub ambiguities: Ambiguities,
    /// The satellite receiver.
    pub gnss: Receiver,
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
        let lengths = instrument.uwb.antenna_offset_m.iter().chain(&instrument.uwb.antenna_height_m);
        if let Some(odd) = lengths.chain(&instrument.uwb.range_bias_m).find(|length| !length.is_finite()) {
            return Err(InstrumentError(format!("[uwb]: expected metres, found {odd}")));
        }
        Ok(instrument)
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
