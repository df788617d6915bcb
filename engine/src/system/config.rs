//! How a session is configured: what every system is told, and the system's own part.

use std::any::Any;
use std::fmt::Debug;

use serde::ser::SerializeMap as _;
use serde::{Serialize, Serializer};

use super::{Declaration, Solution, System};
use crate::event::AidKind;
use crate::geo::{Geodetic, SiteField};
use crate::identify::Identification;
use crate::replay::{self, InputStore};
use crate::stream::Stream;

/// What a session is told before its first reading.
#[derive(Clone, Debug)]
pub struct SessionConfig {
    /// The streams that will send readings, by number.
    pub streams: Vec<Stream>,
    /// Where the system's point is at the start, east-north-up, m.
    pub initial_position_n_m: [f64; 3],
    /// Heading at the start, clockwise from true north, rad; `None` where it is to be found.
    pub initial_heading_rad: Option<f64>,
    /// Magnetic declination, east of north positive, rad.
    pub declination_rad: f64,
    /// Strength and dip of the undisturbed magnetic field; `None` where nobody said, and no magnetometer is held against it.
    pub site_field: Option<SiteField>,
    /// Local gravity, m/s².
    pub gravity_m_s2: f64,
    /// How far one stream's samples may run ahead of another's before the session goes on without
    /// it, ns; `None` waits for ever, as is right for logs that are complete.
    pub max_lead_ns: Option<i64>,
    /// Whether what is reported is smoothed.
    pub solution: Solution,
    /// Where the session's metres count from, on WGS84; `None` where nobody said. What measures places on the Earth (a
    /// receiver) needs it.
    pub origin: Option<Geodetic>,
    /// What the instrument is like, TOML as the system documents it ([`super::InstrumentRule`]); `None` where nothing is said.
    pub instrument: Option<String>,
    /// The markers to choose from where somebody stands; without them stands are not reported.
    pub identification: Option<Identification>,
    /// The system, with its own configuration.
    pub system: Box<dyn SystemConfig>,
}

/// What every configuration can do that can be copied.
pub trait OfOneType {
    /// A copy.
    fn boxed(&self) -> Box<dyn SystemConfig>;
    /// As its own type.
    fn as_any(&self) -> &dyn Any;
    /// As its own type, to be changed.
    fn as_any_mut(&mut self) -> &mut dyn Any;
}

impl<C: SystemConfig + Clone + 'static> OfOneType for C {
    fn boxed(&self) -> Box<dyn SystemConfig> {
        Box::new(self.clone())
    }

    fn as_any(&self) -> &dyn Any {
        self
    }

    fn as_any_mut(&mut self) -> &mut dyn Any {
        self
    }
}

/// A system's own configuration. Its type is the system's; who does not know it asks by words and keys.
pub trait SystemConfig: OfOneType + Debug + Send + Sync {
    /// The system that it is of.
    fn declaration(&self) -> &'static Declaration;
    /// The aids that it uses, in the order of the declaration.
    fn aids(&self) -> Vec<AidKind>;
    /// Its fields by name, for reports.
    fn fields(&self) -> serde_json::Map<String, serde_json::Value>;
    /// Uses these aids and no others; those that the system does not declare are left out.
    fn use_aids(&mut self, aids: &[AidKind]);
    /// How far a streamed session of it looks back, ns: a state that was saved longer than this before another one was is enough
    /// for a session that is the same.
    fn looks_back_ns(&self) -> i64 {
        replay::LOOKS_BACK_NS
    }
    /// A system at the start of a session.
    ///
    /// # Errors
    ///
    /// Where the streams are not such as the system declares.
    fn start(
        &self,
        session: &SessionConfig,
        store: Option<Box<dyn InputStore>>,
    ) -> Result<Box<dyn System>, ConfigError>;
    /// A system as it was saved; it goes on with what came after. One that saves nothing has nothing to do here.
    ///
    /// # Errors
    ///
    /// Where the bytes are not the state of such a session, saved by this engine.
    fn restore(
        &self,
        _session: &SessionConfig,
        _bytes: &[u8],
        _store: Option<Box<dyn InputStore>>,
    ) -> Result<Box<dyn System>, NotRestored> {
        let name = self.declaration().name;
        Err(NotRestored(format!("one of the {name} system, which is computed from all of its readings")))
    }
}

impl Clone for Box<dyn SystemConfig> {
    fn clone(&self) -> Self {
        self.boxed()
    }
}

impl SessionConfig {
    /// Of a system with its configuration, and these streams, at the origin of a place of which nothing is known.
    pub fn new(system: Box<dyn SystemConfig>, streams: Vec<Stream>) -> SessionConfig {
        SessionConfig {
            streams,
            initial_position_n_m: [0.0; 3],
            initial_heading_rad: None,
            declination_rad: 0.0,
            site_field: None,
            gravity_m_s2: 9.80665,
            max_lead_ns: None,
            solution: Solution::default(),
            origin: None,
            instrument: None,
            identification: None,
            system,
        }
    }

    /// A system as it is by default, with its usual streams.
    pub fn by_default(declaration: &Declaration) -> SessionConfig {
        SessionConfig::new((declaration.config)(), declaration.usual_streams())
    }

    /// The system's own configuration, where it is of this type.
    pub fn own<C: 'static>(&self) -> Option<&C> {
        self.system.as_any().downcast_ref()
    }

    /// The same, to be changed.
    pub fn own_mut<C: 'static>(&mut self) -> Option<&mut C> {
        self.system.as_any_mut().downcast_mut()
    }
}

/// Flat, with the fields of the system's own configuration among the others: what a report says of a session.
impl Serialize for SessionConfig {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let system = self.system.declaration();
        let names: Vec<&str> = self.streams.iter().map(|stream| stream.id.name()).collect();
        let mut map = to.serialize_map(None)?;
        map.serialize_entry("system", system.name)?;
        map.serialize_entry("streams", &names)?;
        if let Some(former) = system.former_keys {
            map.serialize_entry(former.streams, &names)?;
        }
        map.serialize_entry("initial_position_n_m", &self.initial_position_n_m)?;
        map.serialize_entry("initial_heading_rad", &self.initial_heading_rad)?;
        map.serialize_entry("declination_rad", &self.declination_rad)?;
        if let Some(field) = &self.site_field {
            map.serialize_entry("site_field", field)?;
        }
        map.serialize_entry("gravity_m_s2", &self.gravity_m_s2)?;
        map.serialize_entry("max_lead_ns", &self.max_lead_ns)?;
        map.serialize_entry("solution", &self.solution)?;
        if let Some(instrument) = &self.instrument {
            map.serialize_entry("instrument", instrument)?;
            // An instrument may be of no place: then its results do not depend on it.
            let origin = self.origin.map(|at| [at.latitude_deg, at.longitude_deg, at.height_m]);
            map.serialize_entry("origin", &origin)?;
        }
        for (name, value) in &self.system.fields() {
            map.serialize_entry(name, value)?;
        }
        map.serialize_entry("identification", &self.identification)?;
        map.end()
    }
}

/// Why a session cannot begin.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ConfigError {
    /// A stream that the system does not have.
    #[error("expected streams of the {system} system ({expected}), found {found:?}: name one of these")]
    UnknownStream {
        /// The system.
        system: &'static str,
        /// What it has.
        expected: String,
        /// What was found.
        found: String,
    },
    /// Fewer or more streams of a role than the system takes.
    #[error("expected {least} to {most} streams of the role {role}, found {found}: see the system's streams")]
    StreamCount {
        /// The role.
        role: &'static str,
        /// At least so many.
        least: usize,
        /// At most so many.
        most: usize,
        /// So many there are.
        found: usize,
    },
    /// Something that only this system asks for.
    #[error("{0}")]
    Own(String),
}

/// Why a saved state could not be taken up.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "expected the state of a session as this engine saves it, found {0}: give the session all of its samples"
)]
pub struct NotRestored(pub String);
