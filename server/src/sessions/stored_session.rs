//! A walk as the store has it: samples, visits and how it is to be computed.

use std::collections::HashMap;
use std::sync::OnceLock;

use lodestep_engine::anomaly::{Anomaly, Cause as _};
use lodestep_engine::event::{AidKind, TrackPoint, VisitOutcome};
use lodestep_engine::parse::remark::{self, LogCause};
use lodestep_engine::session::{ConfigError, SessionConfig, Solution, Visit};
use lodestep_engine::system::ClockAhead;
use tokio::runtime::Handle;
use uuid::Uuid;

use super::computation;
use super::engine_config::engine_config;
use super::identification::identification;
use super::merge_by_time::{MergedByTime, StreamReadings as _};
use super::parameters::{self, Chosen, Wanted};
use super::process::ProcessError;
use super::stored_samples::{self, Recording, StoredSamples};
use crate::state::App;
use crate::store::raw_chunks::Origin;
use crate::store::sessions::Session;
use crate::store::track::TrackKind;
use crate::store::visits;
use crate::store::{self, Store};

/// What a session is computed from.
pub(super) struct StoredSession {
    pub(super) session: Session,
    pub(super) config: SessionConfig,
    /// What the configuration says where it is not the default.
    pub(super) chosen: Chosen,
    pub(super) recordings: Vec<Recording>,
    pub(super) visits: Vec<Visit>,
    /// Visits that automatic mode had made of the walk.
    pub(super) automatic: Vec<store::visits::Visit>,
    /// Told about visits that cannot be used.
    pub(super) outcomes: Vec<VisitOutcome>,
    /// Told about streams that have no samples.
    pub(super) anomalies: Vec<Anomaly>,
    /// The log whose clock is ahead, once that was looked for.
    clocks: OnceLock<Option<ClockAhead>>,
}

impl StoredSession {
    pub(super) async fn read(
        app: &App,
        session_id: Uuid,
        wanted: Wanted,
    ) -> Result<StoredSession, ProcessError> {
        let db = app.store.read();
        let session = store::sessions::get(db, session_id).await?.ok_or(ProcessError::SessionGone)?;
        let mut recordings = Vec::new();
        let mut anomalies = Vec::new();
        for &stream in &session.streams {
            match stored_samples::recording(&app.store, session_id, stream).await? {
                Some(recording) => recordings.push(recording),
                None => anomalies.push((session.declaration().not_stored)(stream)),
            }
        }
        if recordings.is_empty() {
            return Err(ProcessError::NoSamples);
        }
        let epochs = recordings.iter().map(|recording| recording.samples).max().unwrap_or_default();
        let needed_bytes = epochs.saturating_mul(size_of::<TrackPoint>() as u64);
        let most_bytes = app.config.job_bytes;
        if needed_bytes > most_bytes {
            return Err(ProcessError::TooLarge { epochs, needed_bytes, most_bytes });
        }
        // What was done to read the logs is found once, when they come in, and holds for every run.
        let known = store::anomalies::of_session(db, session_id).await?.into_iter();
        // How far clocks are apart is found by each run anew.
        let of_log =
            |found: &Anomaly| remark::KINDS.contains(&found.kind) && found.kind != remark::CLOCKS_APART;
        anomalies.extend(known.map(|known| known.found).filter(of_log));
        let markers: HashMap<_, _> =
            store::markers::list(db).await?.into_iter().map(|marker| (marker.name.clone(), marker)).collect();
        let (mut told, mut automatic) = (Vec::new(), Vec::new());
        let mut outcomes = Vec::new();
        let mut identification = identification(app, &session).await?.unwrap_or_default();
        // What is nearly certain is decided when the whole walk is known, by `make_automatically`.
        identification.automatic = false;
        for visit in store::visits::of_session(db, session_id).await? {
            let made = visit.origin == visits::Origin::Automatic;
            if made {
                automatic.push(visit.clone());
            }
            match markers.get(&visit.marker) {
                Some(marker) => {
                    let list = if made { &mut identification.automatic_visits } else { &mut told };
                    list.push(Visit {
                        marker: visit.marker,
                        t_start_ns: visit.t_start_ns,
                        t_end_ns: visit.t_end_ns,
                        position_n_m: (marker.e_m, marker.n_m, marker.u_m),
                    });
                }
                None if made => {}
                None if session.declaration().surveys() => told.push(Visit {
                    marker: visit.marker,
                    t_start_ns: visit.t_start_ns,
                    t_end_ns: visit.t_end_ns,
                    position_n_m: Visit::NOWHERE,
                }),
                None => outcomes.push(unknown_marker(visit)),
            }
        }
        let streams: Vec<_> = recordings.iter().map(|recording| recording.stream).collect();
        let mut config = engine_config(&app.site, &session, &streams);
        config.identification = (!identification.markers.all().is_empty()).then_some(identification);
        let chosen = parameters::of_walk(app, &session, wanted).await?;
        chosen.parameters.apply(&mut config);
        let clocks = OnceLock::new();
        Ok(StoredSession {
            session,
            config,
            chosen,
            recordings,
            visits: told,
            automatic,
            outcomes,
            anomalies,
            clocks,
        })
    }

    /// The log whose clock is ahead of the other's, where what they hold shows that. Found once, on a thread that may block.
    fn clock_ahead(&self, store: &Store, runtime: &Handle) -> Option<ClockAhead> {
        *self.clocks.get_or_init(|| {
            let mut clocks = self.session.declaration().log_clocks.map(|clocks| clocks())?;
            if !self.is_of_logs() || self.recordings.len() < 2 {
                return None;
            }
            for recording in &self.recordings {
                let mut samples = StoredSamples::new(store.clone(), runtime.clone(), recording.origin);
                while !clocks.has_enough(recording.stream) {
                    // What cannot be read is told where the walk is computed.
                    let piece = samples.next_piece().ok().filter(|piece| !piece.is_empty());
                    let Some(piece) = piece else { break };
                    piece.iter().for_each(|reading| clocks.take(recording.stream, reading));
                }
            }
            clocks.ahead()
        })
    }

    /// What is to be told of the clocks of its logs.
    pub(super) fn clocks_told(&self, store: &Store, runtime: &Handle) -> Option<Anomaly> {
        let ClockAhead { stream, ahead_by_s, sigma_s } = self.clock_ahead(store, runtime)?;
        Some(LogCause::ClocksApart { ahead_by_s, sigma_s }.anomaly(Some(stream), [0; 2], 0))
    }

    /// The visits that automatic mode has made.
    pub(super) fn made(&self) -> &[Visit] {
        self.config.identification.as_ref().map_or(&[], |identification| &identification.automatic_visits)
    }

    /// Whether all its samples come from logs, which have a clock of their own.
    pub(super) fn is_of_logs(&self) -> bool {
        self.recordings.iter().all(|recording| matches!(recording.origin, Origin::Log(_)))
    }

    pub(super) fn samples(&self) -> u64 {
        self.recordings.iter().map(|recording| recording.samples).sum()
    }

    /// An epoch has a sample of each stream that is recorded.
    fn most_epochs(&self) -> u64 {
        self.recordings.iter().map(|recording| recording.samples).max().unwrap_or_default()
    }

    /// The samples, to be read on a thread that may block.
    pub(super) fn samples_in_order(&self, store: &Store, runtime: &Handle) -> MergedByTime<StoredSamples> {
        let ahead = self.clock_ahead(store, runtime);
        MergedByTime::new(self.recordings.iter().map(|recording| {
            let ahead = ahead.filter(|ahead| ahead.stream == recording.stream);
            let ahead_ns = ahead.map_or(0, |ahead| (ahead.ahead_by_s * 1e9).round() as i64);
            let samples = StoredSamples::new(store.clone(), runtime.clone(), recording.origin);
            (recording.stream, samples.ahead_by(ahead_ns))
        }))
    }

    /// One run, before its first sample.
    pub(super) fn begin(&self, run: TrackKind) -> Result<computation::Computation, ConfigError> {
        let mut config = self.config.clone();
        let visits = match run {
            TrackKind::Main => {
                config.solution = Solution::Smoothed;
                &self.visits[..]
            }
            TrackKind::Filtered => &self.visits[..],
            TrackKind::WithoutMarkers => {
                let mut aids = config.system.aids();
                aids.retain(|aid| *aid != AidKind::MARKERS);
                config.system.use_aids(&aids);
                config.identification = None;
                &[]
            }
        };
        computation::Computation::new(config, visits, self.most_epochs())
    }
}

impl StoredSession {
    /// A run that knows no marker and tells its stands all the same, before its first sample.
    pub(super) fn begin_to_tie(&self) -> Result<computation::Computation, ConfigError> {
        let mut config = self.config.clone();
        let mut aids = config.system.aids();
        aids.retain(|aid| *aid != AidKind::MARKERS);
        config.system.use_aids(&aids);
        if let Some(identification) = &mut config.identification {
            identification.automatic_visits.clear();
        }
        computation::Computation::new(config, &[], self.most_epochs())
    }

    /// A lab run, before its first sample: as the configuration has it, for this solution.
    pub(super) fn begin_in_lab(&self, solution: Solution) -> Result<computation::Computation, ConfigError> {
        let mut config = self.config.clone();
        config.solution = solution;
        let visits = if config.system.aids().contains(&AidKind::MARKERS) { &self.visits[..] } else { &[] };
        computation::Computation::new(config, visits, self.most_epochs())
    }

    /// Visits of whatever origin that a run with markers uses.
    pub(super) fn used_visits(&self) -> impl Iterator<Item = &Visit> {
        let used = self.config.system.aids().contains(&AidKind::MARKERS);
        self.visits.iter().chain(self.made()).filter(move |_| used)
    }
}

/// A visit whose marker has been deleted or renamed measures nothing.
fn unknown_marker(visit: store::visits::Visit) -> VisitOutcome {
    VisitOutcome {
        reason: format!("there is no marker {:?} now: add it and process again", visit.marker),
        marker: visit.marker,
        t_ns: visit.t_start_ns,
        before_minus_marker_n_m: [0.0; 3],
        after_minus_marker_n_m: [0.0; 3],
        nis: 0.0,
        degrees_of_freedom: 0,
        accepted: false,
    }
}
