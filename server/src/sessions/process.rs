//! From raw samples to a stored track: with every aid, smoothed and as the filter told it, and again as
//! if no marker had been visited.

use std::collections::HashMap;

use futures_util::FutureExt;
use lodestep_engine::event::{Anomaly, AnomalyKind, TrackPoint, VisitOutcome};
use lodestep_engine::identify::automatic_visits;
use lodestep_engine::sample::Foot;
use lodestep_engine::session::{SessionConfig, Solution, Visit};
use lodestep_engine::track::Track;
use tokio::runtime::Handle;
use uuid::Uuid;

use super::engine_config::engine_config;
use super::identification::identification;
use super::in_time_order::InTimeOrder;
use super::run::{self, Computed, FullRun};
use super::stored_grid::{self, Grid};
use super::stored_samples::{self, Recording, StoredSamples};
use crate::error::{Error, Result};
use crate::jobs::progress::Progress;
use crate::live::session_changes;
use crate::state::App;
use crate::store::sessions::Session;
use crate::store::track::Run;
use crate::store::visits::Origin;
use crate::store::{self, Store, StoreError};
use crate::utc;
use crate::wire::Change;

/// Why a session's track could not be computed. The former track stays.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ProcessError {
    #[error("the server is stopping")]
    Stopping,
    #[error("the session was deleted")]
    SessionGone,
    #[error(
        "there are no samples to compute a track from: upload a log of at least one foot, then process again"
    )]
    NoSamples,
    #[error(
        "{samples} samples gave no position: expected a standing start of some seconds and a walk; check that the right log was uploaded"
    )]
    NoTrack { samples: u64 },
    #[error("the computation met a fault of its own and was given up ({0}): please report it with the log")]
    Panicked(String),
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error(transparent)]
    Read(anyhow::Error),
}

/// What a session is computed from.
struct Walk {
    session: Session,
    config: SessionConfig,
    recordings: Vec<Recording>,
    visits: Vec<Visit>,
    /// Visits that automatic mode had made of the walk.
    automatic: Vec<store::visits::Visit>,
    /// Told about visits that cannot be used.
    outcomes: Vec<VisitOutcome>,
    /// Told about feet that have no samples.
    anomalies: Vec<Anomaly>,
}

/// Both runs.
struct Runs {
    main: Computed,
    /// The main run's points at the stored rate, as they were before smoothing.
    filtered: Vec<TrackPoint>,
    without_markers: Option<Computed>,
}

/// Computes a session's track and stores it in place of the former one.
pub(crate) async fn process(app: &App, session_id: Uuid, progress: Progress) -> Result<(), ProcessError> {
    let walk = Walk::read(app, session_id).await?;
    let cell_ns = stored_grid::cell_ns(app.config.track_rate_hz);
    let (store, runtime) = (app.store.clone(), Handle::current());
    let computing = tokio::task::spawn_blocking(move || {
        let (mut walk, mut progress) = (walk, progress);
        compute(&store, &runtime, &mut walk, cell_ns, &mut progress).map(|runs| (walk, runs))
    });
    let (walk, runs) = computing.await.map_err(|error| ProcessError::Panicked(error.to_string()))??;
    put_in_place(app, walk, runs).await
}

impl Walk {
    async fn read(app: &App, session_id: Uuid) -> Result<Walk, ProcessError> {
        let db = app.store.read();
        let session = store::sessions::get(db, session_id).await?.ok_or(ProcessError::SessionGone)?;
        let mut recordings = Vec::new();
        let mut anomalies = Vec::new();
        for &foot in &session.feet {
            match stored_samples::recording(&app.store, session_id, foot).await? {
                Some(recording) => recordings.push(recording),
                None => anomalies.push(missing_foot(foot)),
            }
        }
        if recordings.is_empty() {
            return Err(ProcessError::NoSamples);
        }
        let markers: HashMap<_, _> =
            store::markers::list(db).await?.into_iter().map(|marker| (marker.name.clone(), marker)).collect();
        let (mut visits, mut automatic) = (Vec::new(), Vec::new());
        let mut outcomes = Vec::new();
        let mut identification = identification(&app.store, &session).await?.unwrap_or_default();
        // What is nearly certain is decided when the whole walk is known, by `make_automatically`.
        identification.automatic = false;
        for visit in store::visits::of_session(db, session_id).await? {
            let made = visit.origin == Origin::Automatic;
            if made {
                automatic.push(visit.clone());
            }
            match markers.get(&visit.marker) {
                Some(marker) => {
                    let list = if made { &mut identification.automatic_visits } else { &mut visits };
                    list.push(Visit {
                        marker: visit.marker,
                        t_start_ns: visit.t_start_ns,
                        t_end_ns: visit.t_end_ns,
                        position_n_m: (marker.e_m, marker.n_m, marker.u_m),
                    });
                }
                None if made => {}
                None => outcomes.push(unknown_marker(visit)),
            }
        }
        let feet = recordings.iter().map(|recording| recording.foot).collect();
        let mut config = engine_config(&app.site, &session, feet);
        config.identification = (!identification.markers.is_empty()).then_some(identification);
        Ok(Walk { session, config, recordings, visits, automatic, outcomes, anomalies })
    }

    /// The visits that automatic mode has made.
    fn made(&self) -> &[Visit] {
        self.config.identification.as_ref().map_or(&[], |identification| &identification.automatic_visits)
    }

    fn samples(&self) -> u64 {
        self.recordings.iter().map(|recording| recording.samples).sum()
    }

    /// Computes one run, on a thread that may block.
    fn run(
        &self,
        store: &Store,
        runtime: &Handle,
        run: Run,
        go_on: impl FnMut(u64) -> bool,
        on_filtered: impl FnOnce(&Track),
    ) -> anyhow::Result<Option<FullRun>> {
        let feet = self.recordings.iter().map(|recording| {
            (recording.foot, StoredSamples::new(store.clone(), runtime.clone(), recording.origin))
        });
        let mut config = self.config.clone();
        let visits = match run {
            Run::Main => {
                config.solution = Solution::Smoothed;
                &self.visits[..]
            }
            Run::Filtered => &self.visits[..],
            Run::WithoutMarkers => {
                config.aids.markers = false;
                config.identification = None;
                &[]
            }
        };
        run::run(config, visits, InTimeOrder::new(feet), go_on, on_filtered)
    }
}

/// A session that says both feet and holds one is computed with the one, and says so.
fn missing_foot(foot: Foot) -> Anomaly {
    Anomaly {
        kind: AnomalyKind::FootMissing,
        foot: Some(foot),
        t_start_ns: 0,
        t_end_ns: 0,
        samples: 0,
        detail: format!(
            "expected samples of the {} foot, found none: the track was computed without it",
            foot.name()
        ),
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

/// A visit that automatic mode has made, as it is stored.
fn automatic_row(session_id: Uuid, visit: &Visit) -> store::visits::Visit {
    store::visits::Visit {
        id: Uuid::now_v7(),
        session_id,
        marker: visit.marker.clone(),
        t_start_ns: visit.t_start_ns,
        t_end_ns: visit.t_end_ns,
        origin: Origin::Automatic,
        created_at: utc::now(),
        outcome: None,
    }
}

/// The runs, one after the other.
fn compute(
    store: &Store,
    runtime: &Handle,
    walk: &mut Walk,
    cell_ns: i64,
    progress: &mut Progress,
) -> Result<Runs, ProcessError> {
    make_automatically(store, runtime, walk, progress)?;
    let walk = &*walk;
    let runs = if walk.visits.is_empty() && walk.made().is_empty() { 1 } else { 2 };
    let total = (runs * walk.samples()).max(1) as f64;
    let mut filtered = Vec::new();
    let mut one = |run, stage, before: u64| {
        let go_on = |done| {
            // The last percent is for storing.
            progress.tell(stage, 0.99 * (before + done) as f64 / total);
            !progress.is_stopping()
        };
        let on_filtered = |track: &Track| {
            if run == Run::Main {
                filtered = run::thinned(&track.points, &mut Grid::new(cell_ns));
            }
        };
        let full = walk.run(store, runtime, run, go_on, on_filtered);
        full.map_err(ProcessError::Read)?
            .ok_or(ProcessError::Stopping)
            .map(|full| full.into_computed(cell_ns))
    };
    let main = one(Run::Main, "filtering", 0)?;
    if main.stored.is_empty() {
        return Err(ProcessError::NoTrack { samples: walk.samples() });
    }
    let without_markers = match runs {
        1 => None,
        _ => Some(one(Run::WithoutMarkers, "filtering_without_markers", walk.samples())?),
    };
    progress.tell("storing", 0.99);
    Ok(Runs { main, filtered, without_markers })
}

/// In automatic mode, finds in a run of its own which stands are nearly certain by all of the walk.
fn make_automatically(
    store: &Store,
    runtime: &Handle,
    walk: &mut Walk,
    progress: &mut Progress,
) -> Result<(), ProcessError> {
    let Some(identification) = &mut walk.config.identification else { return Ok(()) };
    identification.automatic_visits.clear();
    if !walk.session.automatic_visits {
        return Ok(());
    }
    let total = walk.samples().max(1) as f64;
    let go_on = |done| {
        progress.tell("identifying", 0.99 * done as f64 / total);
        !progress.is_stopping()
    };
    let full = walk.run(store, runtime, Run::Filtered, go_on, |_| {}).map_err(ProcessError::Read)?;
    let stands = full.ok_or(ProcessError::Stopping)?.track.stands;
    if let Some(identification) = &mut walk.config.identification {
        identification.automatic_visits = automatic_visits(&stands, identification);
    }
    Ok(())
}

/// Every epoch of a run, computed from the raw samples for this one answer, with its visits.
pub(crate) async fn full_track(
    app: &App,
    session_id: Uuid,
    run: Run,
) -> Result<(Vec<TrackPoint>, Vec<VisitOutcome>)> {
    let walk = match Walk::read(app, session_id).await {
        Err(ProcessError::SessionGone) => return Err(Error::not_found("session", session_id)),
        Err(ProcessError::Store(error)) => return Err(error.into()),
        Err(error) => return Err(Error::invalid("no_samples", error.to_string())),
        Ok(walk) => walk,
    };
    let (store, runtime) = (app.store.clone(), Handle::current());
    let _permit = app.log_readers.acquire().await;
    let computing = tokio::task::spawn_blocking(move || walk.run(&store, &runtime, run, |_| true, |_| {}));
    let full = computing.await.map_err(anyhow::Error::new)??;
    Ok(full.map(|full| (full.track.points, full.track.visits)).unwrap_or_default())
}

/// Puts the new result in the place of the former one: all of it or nothing.
async fn put_in_place(app: &App, walk: Walk, runs: Runs) -> Result<(), ProcessError> {
    let session_id = walk.session.id;
    let last_ns = runs.main.stored.last().map_or(0, |point| point.t_ns);
    let ended_at = utc::at(walk.session.started_at, last_ns);
    let made: Vec<_> = walk.made().iter().map(|visit| automatic_row(session_id, visit)).collect();
    let is_made = |known: &store::visits::Visit| {
        made.iter().any(|made| made.marker == known.marker && made.t_start_ns == known.t_start_ns)
    };
    let removed: Vec<Uuid> =
        walk.automatic.iter().filter(|known| !is_made(known)).map(|known| known.id).collect();
    let gone = removed.clone();
    let stored = app
        .store
        .writer()
        .run(move |db| {
            async move {
                let without_markers = runs.without_markers.as_ref().map(|computed| &computed.stored);
                for (run, points) in [
                    (Run::Main, Some(&runs.main.stored)),
                    (Run::Filtered, Some(&runs.filtered)),
                    (Run::WithoutMarkers, without_markers),
                ] {
                    store::track::clear(&mut *db, session_id, run).await?;
                    if let Some(points) = points {
                        store::track::upsert(&mut *db, session_id, run, points).await?;
                    }
                }
                for visit in gone {
                    store::visits::delete(&mut *db, visit).await?;
                }
                for visit in &made {
                    store::visits::insert(&mut *db, visit).await?;
                }
                store::stands::clear(&mut *db, session_id).await?;
                let stands: Vec<_> = runs.main.stands.iter().map(store::stands::Stand::from).collect();
                store::stands::upsert(&mut *db, session_id, &stands).await?;
                store::visits::clear_outcomes(&mut *db, session_id).await?;
                for outcome in runs.main.visits.iter().chain(&walk.outcomes) {
                    store::visits::set_outcome(&mut *db, session_id, outcome).await?;
                }
                store::anomalies::clear(&mut *db, session_id).await?;
                for anomaly in runs.main.anomalies.iter().chain(&walk.anomalies) {
                    store::anomalies::insert(&mut *db, session_id, anomaly).await?;
                }
                store::sessions::set_summary(&mut *db, session_id, &runs.main.summary).await?;
                store::sessions::finish(&mut *db, session_id, ended_at, &runs.main.sha256).await?;
                Ok::<_, StoreError>(())
            }
            .boxed()
        })
        .await;
    match stored {
        Err(error) if error.is_dangling() => return Err(ProcessError::SessionGone),
        other => other?,
    }
    app.hub.publish_all(removed.into_iter().map(|id| Change::VisitRemoved { session_id, id }));
    if let Some(session) = store::sessions::get(app.store.read(), session_id).await? {
        app.hub.publish_all(session_changes(&app.store, session).await?);
    }
    Ok(())
}
