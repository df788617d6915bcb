//! How the cabin is set up in a session: what can be chosen, and what its instrument and streams have to be.

use super::charts::Charts;
use super::declaration::{ANTENNAS, DECLARATION, ENCODERS, GNSS, IMU, PLATFORM_IMU, RAYS, STATIONS};
use super::instrument::Instrument;
use super::intake::Intake;
use super::lead::Lead;
use super::order::Order;
use super::plan::Plan;
use super::points::Pairs;
use super::saved;
use super::session::{CabinConfig, CabinSession, Estimator};
use super::system::{Cabin, DEVICES, Smoothed};
use super::weighing::Weighing;
use crate::event::AidKind;
use crate::parse::name_number;
use crate::replay::InputStore;
use crate::stream::StreamId;
use crate::system::{
    ConfigError, Declaration, NotRestored, Progress, SessionConfig, Solution, System, SystemConfig,
};

/// Points of a track, a second.
const RATE_HZ: f64 = 20.0;

/// What can be chosen.
#[derive(Clone, Debug)]
pub(super) struct Config {
    /// Whether the stations' rays are weighed.
    stations: bool,
}

impl Default for Config {
    fn default() -> Config {
        Config { stations: true }
    }
}

impl SystemConfig for Config {
    fn declaration(&self) -> &'static Declaration {
        &DECLARATION
    }

    fn aids(&self) -> Vec<AidKind> {
        if self.stations { vec![ANTENNAS, STATIONS] } else { vec![ANTENNAS] }
    }

    fn fields(&self) -> serde_json::Map<String, serde_json::Value> {
        serde_json::Map::from_iter([("stations".to_owned(), self.stations.into())])
    }

    /// To nothing but what its state holds; the points of some seconds may not have been stored with it.
    fn looks_back_ns(&self) -> i64 {
        10_000_000_000
    }

    /// Without antennas there is no place to start from: they are always used.
    fn use_aids(&mut self, aids: &[AidKind]) {
        self.stations = aids.contains(&STATIONS);
    }

    fn start(
        &self,
        session: &SessionConfig,
        _: Option<Box<dyn InputStore>>,
    ) -> Result<Box<dyn System>, ConfigError> {
        Ok(Box::new(self.begin(session)?))
    }

    fn restore(
        &self,
        session: &SessionConfig,
        bytes: &[u8],
        _: Option<Box<dyn InputStore>>,
    ) -> Result<Box<dyn System>, NotRestored> {
        let cabin = self.begin(session).map_err(|error| NotRestored(error.to_string()))?;
        Ok(Box::new(cabin.restored(bytes)?))
    }
}

impl Config {
    fn begin(&self, session: &SessionConfig) -> Result<Cabin, ConfigError> {
        DECLARATION.check_streams(&session.streams)?;
        let text = session.instrument.as_deref().ok_or_else(|| {
            ConfigError::Own(
                "expected the cabin's file as the instrument (TOML: where antennas, stations, prisms and joints are), found none: give it along".to_owned(),
            )
        })?;
        let instrument = Instrument::from_toml(text).map_err(|error| ConfigError::Own(error.to_string()))?;
        check_names(&instrument)?;
        let has = |id: StreamId| session.streams.iter().any(|stream| stream.id == id);
        let has_stations = has(RAYS) && self.stations;
        let config = CabinConfig {
            estimator: Estimator::Own,
            smoothed: false,
            rate_hz: RATE_HZ,
            has_stations,
            has_encoders: has(ENCODERS),
            has_platform_imu: has(PLATFORM_IMU),
            platform: has(ENCODERS) || has_stations,
        };
        let begin = |smoothed| {
            CabinSession::new(&instrument, CabinConfig { smoothed, ..config.clone() })
                .map(Box::new)
                .map_err(|error| ConfigError::Own(error.to_string()))
        };
        let is_live = session.max_lead_ns.is_some();
        let smoothed = session.solution == Solution::Smoothed && !is_live;
        let smoothed = if smoothed { Some(begin(true)?) } else { None };
        let sources =
            [IMU, PLATFORM_IMU, ENCODERS, GNSS, RAYS].map(|id| has(id) && (id != RAYS || has_stations));
        Ok(Cabin {
            filtered: Some(begin(false)?),
            smoothed: smoothed.map(|session| Smoothed {
                session: Some(session),
                pairs: Pairs::default(),
                points: Vec::new(),
            }),
            intakes: DEVICES.map(|device| Intake::new(device, &instrument)),
            troubles_told: [[false; 3]; 3],
            lead: Lead::default(),
            order: (!is_live).then(|| Order::new(sources)),
            pairs: Pairs::default(),
            weighing: Weighing::default(),
            plan: Plan::default(),
            held: Vec::new(),
            charts: Charts::default(),
            newest_ns: 0,
            progress: Progress::default(),
            counted_n_m: None,
            config,
            instrument: Box::new(instrument),
            told: saved::told(session),
            saved_ns: None,
        })
    }
}

/// A stream's rows name devices by numbers that hold so many letters.
fn check_names(instrument: &Instrument) -> Result<(), ConfigError> {
    let targets = instrument.target_names();
    let lists = [&instrument.antennas.names, &instrument.stations.names, &targets];
    match lists.into_iter().flatten().find(|name| name_number::number(name).is_none()) {
        None => Ok(()),
        Some(name) => Err(ConfigError::Own(format!(
            "expected names of antennas, stations and prisms of 1 to {} letters, digits and underscores, found {name:?}: rename it here and in the logs",
            name_number::MOST_LETTERS
        ))),
    }
}
