//! The pedestrian's own configuration.

use serde::Serialize;

use super::DECLARATION;
use super::aids::Aids;
use super::side::{Side, stream};
use super::system::Pedestrian;
use super::tuning::Tuning;
use crate::event::AidKind;
use crate::replay::InputStore;
use crate::system::{ConfigError, Declaration, NotRestored, SessionConfig, System, SystemConfig};

/// What the pedestrian is told beside what every system is.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Config {
    /// The aids to use, as far as the data allow them.
    pub aids: Aids,
    /// The parameters of the filter and its detectors.
    pub tuning: Tuning,
}

/// A walk with a sensor on each foot, all else as it is by default.
pub fn two_feet() -> SessionConfig {
    Config::default().session(&Side::BOTH)
}

impl Config {
    /// A walk with sensors on these feet.
    pub fn session(self, sides: &[Side]) -> SessionConfig {
        SessionConfig::new(Box::new(self), sides.iter().map(|side| stream(*side)).collect())
    }

    /// The pedestrian's part of a session's configuration.
    ///
    /// # Panics
    ///
    /// Where the session is of another system.
    pub fn of(session: &SessionConfig) -> &Config {
        session.own().expect("the session is a walk")
    }

    /// The same, to be changed.
    ///
    /// # Panics
    ///
    /// Where the session is of another system.
    pub fn of_mut(session: &mut SessionConfig) -> &mut Config {
        session.own_mut().expect("the session is a walk")
    }
}

impl SystemConfig for Config {
    fn declaration(&self) -> &'static Declaration {
        &DECLARATION
    }

    fn aids(&self) -> Vec<AidKind> {
        self.aids.kinds()
    }

    fn fields(&self) -> serde_json::Map<String, serde_json::Value> {
        match serde_json::to_value(self) {
            Ok(serde_json::Value::Object(fields)) => fields,
            _ => serde_json::Map::new(),
        }
    }

    fn use_aids(&mut self, aids: &[AidKind]) {
        self.aids = Aids::only(aids);
    }

    fn start(
        &self,
        session: &SessionConfig,
        store: Option<Box<dyn InputStore>>,
    ) -> Result<Box<dyn System>, ConfigError> {
        DECLARATION.check_streams(&session.streams)?;
        if session.streams.is_empty() {
            return Err(ConfigError::Own(
                "expected the left foot, the right foot or both, found none".into(),
            ));
        }
        Ok(Box::new(Pedestrian::new(session, self, store)))
    }

    fn restore(
        &self,
        session: &SessionConfig,
        bytes: &[u8],
        store: Option<Box<dyn InputStore>>,
    ) -> Result<Box<dyn System>, NotRestored> {
        Ok(Box::new(Pedestrian::restored(session, self, bytes, store)?))
    }
}
