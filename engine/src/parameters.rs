//! The parameters that an engineer may turn, of every system: values for some of them, each within its range, read from and
//! written to the very configuration that a session runs with, so that a list of them cannot say anything else.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::system::{Declaration, Parameter, SessionConfig};
use crate::systems::catalogue;

/// Values for some of the parameters, each within its range; those that are the default are left out, so that two
/// that mean the same are the same.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "BTreeMap<String, f64>", into = "BTreeMap<String, f64>")]
pub struct Parameters(BTreeMap<&'static str, f64>);

/// Why a value is not taken.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ParameterError {
    /// Nobody knows this key.
    #[error("there is no parameter {0:?}: the list of parameters names those that there are")]
    Unknown(String),
    /// It is outside of its range, or no number.
    #[error(
        "expected {key} from {least} to {most}{unit}, found {found}: choose a value in that range, or leave it out for the default of {default}"
    )]
    OutOfRange {
        /// Its key.
        key: &'static str,
        /// Its unit, with a space before it, where it has one.
        unit: String,
        /// The smallest value that is taken.
        least: f64,
        /// The largest.
        most: f64,
        /// What it is without being set.
        default: f64,
        /// What was given.
        found: f64,
    },
}

/// The parameter of this key, and whose it is: of the first system that has it.
fn named(key: &str) -> Option<(&'static Declaration, &'static Parameter)> {
    catalogue::SYSTEMS.iter().find_map(|system| Some((*system, system.parameter(key)?)))
}

impl Parameters {
    /// Of keys and values, whichever system they are of.
    ///
    /// # Errors
    ///
    /// Where no system has such a parameter, or a value is out of its range.
    pub fn new<K: AsRef<str>>(given: impl IntoIterator<Item = (K, f64)>) -> Result<Self, ParameterError> {
        let mut parameters = Parameters::default();
        for (key, value) in given {
            parameters.set(key.as_ref(), value)?;
        }
        Ok(parameters)
    }

    /// Of keys and values for this system.
    ///
    /// # Errors
    ///
    /// Where the system has no such parameter, or a value is out of its range.
    pub fn of<K: AsRef<str>>(
        system: &'static Declaration,
        given: impl IntoIterator<Item = (K, f64)>,
    ) -> Result<Self, ParameterError> {
        let mut parameters = Parameters::default();
        for (key, value) in given {
            let key = key.as_ref();
            let known = system.parameter(key).ok_or_else(|| ParameterError::Unknown(key.to_owned()))?;
            parameters.set_known(system, known, value)?;
        }
        Ok(parameters)
    }

    /// Sets one, of whichever system.
    ///
    /// # Errors
    ///
    /// Where no system has such a parameter, or the value is out of its range.
    pub fn set(&mut self, key: &str, value: f64) -> Result<(), ParameterError> {
        let (system, known) = named(key).ok_or_else(|| ParameterError::Unknown(key.to_owned()))?;
        self.set_known(system, known, value)
    }

    fn set_known(
        &mut self,
        system: &'static Declaration,
        known: &'static Parameter,
        value: f64,
    ) -> Result<(), ParameterError> {
        let default = known.default_of(system);
        if !(known.least..=known.most).contains(&value) {
            return Err(ParameterError::OutOfRange {
                key: known.key,
                unit: if known.unit == "1" { String::new() } else { format!(" {}", known.unit) },
                least: known.least,
                most: known.most,
                default,
                found: value,
            });
        }
        if value == default {
            self.0.remove(known.key);
        } else {
            self.0.insert(known.key, value);
        }
        Ok(())
    }

    /// Writes those of its system into a configuration. Those of identification reach only one that names markers.
    pub fn apply(&self, config: &mut SessionConfig) {
        let system = config.system.declaration();
        for (key, value) in &self.0 {
            if let Some(known) = system.parameter(key) {
                (known.write)(config, *value);
            }
        }
    }

    /// Keys and values, by key.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, f64)> + '_ {
        self.0.iter().map(|(key, value)| (*key, *value))
    }

    /// Whether all are as they are by default.
    pub fn is_default(&self) -> bool {
        self.0.is_empty()
    }
}

impl TryFrom<BTreeMap<String, f64>> for Parameters {
    type Error = ParameterError;

    fn try_from(given: BTreeMap<String, f64>) -> Result<Self, ParameterError> {
        Parameters::new(given)
    }
}

impl From<Parameters> for BTreeMap<String, f64> {
    fn from(parameters: Parameters) -> Self {
        parameters.0.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
    }
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;
    use crate::identify::Identification;
    use crate::systems::pedestrian::{self, Config, DECLARATION};

    fn config() -> SessionConfig {
        SessionConfig { identification: Some(Identification::default()), ..pedestrian::two_feet() }
    }

    /// Every number of a configuration with its path.
    fn numbers(path: &str, value: &Value, found: &mut BTreeMap<String, f64>) {
        match value {
            Value::Number(number) => {
                found.insert(path.to_owned(), number.as_f64().unwrap());
            }
            Value::Object(fields) => {
                for (name, value) in fields {
                    numbers(&format!("{path}.{name}"), value, found);
                }
            }
            _ => {}
        }
    }

    fn all_numbers(config: &SessionConfig) -> BTreeMap<String, f64> {
        let mut found = BTreeMap::new();
        let own: &Config = config.own().unwrap();
        numbers(".tuning", &serde_json::to_value(&own.tuning).unwrap(), &mut found);
        let identification = serde_json::to_value(&config.identification).unwrap();
        numbers(".identification", &identification, &mut found);
        found
    }

    #[test]
    fn each_key_is_the_path_of_the_one_number_that_it_reads_and_writes() {
        let before = all_numbers(&config());
        for parameter in DECLARATION.parameters {
            let default = parameter.default_of(&DECLARATION);
            assert!(parameter.least <= default && default <= parameter.most, "{}", parameter.key);
            assert!(parameter.least < parameter.most, "{}", parameter.key);
            let other = if default == parameter.most { parameter.least } else { parameter.most };
            let mut changed = config();
            Parameters::new([(parameter.key, other)]).unwrap().apply(&mut changed);
            assert_eq!((parameter.read)(&changed), other, "{}", parameter.key);
            let differing: Vec<_> =
                all_numbers(&changed).into_iter().filter(|(path, value)| before[path] != *value).collect();
            assert_eq!(differing.len(), 1, "{}: {differing:?}", parameter.key);
            let path = differing[0].0.replace(".identification.tuning.", ".identification.");
            assert!(
                path == format!(".tuning.{}", parameter.key) || path == format!(".{}", parameter.key),
                "{path} is told as {}",
                parameter.key
            );
        }
    }

    /// What only trades work for a fineness that nobody sees.
    const NOT_OFFERED: &[&str] = &[
        ".tuning.swing_interval_s",
        ".tuning.hold_interval_s",
        ".tuning.hold_share",
        ".tuning.longest_hold_s",
        ".tuning.history_s",
        ".tuning.slowest_flight_m_s",
        ".tuning.flight_gate",
        ".identification.tuning.heading_sigma_rad",
        ".identification.tuning.heading_length_m",
        ".identification.tuning.scale_sigma",
        ".identification.tuning.scale_length_m",
        ".identification.tuning.walk_sigma_m_rtm",
        ".identification.tuning.height_walk_sigma_m_rtm",
        ".identification.tuning.none_of",
    ];

    #[test]
    fn a_new_number_of_the_configuration_is_offered_or_left_out_on_purpose() {
        for path in all_numbers(&config()).into_keys() {
            let key = path
                .strip_prefix(".tuning.")
                .map(str::to_owned)
                .unwrap_or_else(|| path[1..].replace("identification.tuning.", "identification."));
            let offered = DECLARATION.parameter(&key).is_some();
            assert_ne!(offered, NOT_OFFERED.contains(&path.as_str()), "{path}");
        }
    }

    #[test]
    fn keys_end_in_their_unit() {
        for parameter in DECLARATION.parameters {
            let ending = parameter.unit.replace("1/", "").replace("µT", "ut").replace(['/', '√', '²'], "");
            let plain: String = parameter.key.replace("sqrt_", "").replace(['_', '2'], "");
            assert!(
                parameter.unit == "1" || plain.ends_with(&ending),
                "{} in {}",
                parameter.key,
                parameter.unit
            );
        }
    }

    #[test]
    fn what_is_out_of_range_or_unknown_is_refused_in_a_sentence() {
        let refused = |key: &str, value| Parameters::new([(key, value)]).unwrap_err().to_string();
        assert_eq!(
            refused("stance.threshold", 0.0),
            "expected stance.threshold from 0.5 to 200, found 0: choose a value in that range, or leave it out for the default of 8"
        );
        assert!(refused("stance.threshold", f64::NAN).contains("found NaN"));
        assert!(refused("zupt_sigma", 0.02).contains("no parameter \"zupt_sigma\""));
        let read: Result<Parameters, _> = serde_json::from_str(r#"{"marker_sigma_m": 1e9}"#);
        assert!(read.unwrap_err().to_string().contains("from 0.01 to 20 m"));
    }

    #[test]
    fn a_default_is_left_out_and_values_keep_every_bit() {
        let set = Parameters::new([("marker_sigma_m", 1.0), ("separation_m", 0.1 + 0.2)]).unwrap();
        assert_eq!(set.iter().collect::<Vec<_>>(), [("separation_m", 0.1 + 0.2)]);
        let again: Parameters = serde_json::from_str(&serde_json::to_string(&set).unwrap()).unwrap();
        assert_eq!(again, set);
        assert!(Parameters::new([("marker_sigma_m", 1.0)]).unwrap().is_default());
        let mut bare = pedestrian::two_feet();
        Parameters::new([("identification.slip", 0.1)]).unwrap().apply(&mut bare);
        assert_eq!(format!("{bare:?}"), format!("{:?}", pedestrian::two_feet()));
    }
}
