//! From raw samples to a stored track, with every aid and smoothed; then, to compare it with, as the filter
//! told it and as if no marker had been visited.

use std::collections::HashMap;
use std::sync::Arc;

use futures_util::FutureExt;
use lodestep_engine::event::{Anomaly, AnomalyKind, TrackPoint, VisitOutcome};
use lodestep_engine::sample::Foot;
use lodestep_engine::session::{SessionConfig, Solution, Visit};
use tokio::runtime::Handle;
use uuid::Uuid;

use super::engine_config::engine_config;
use super::in_time_order::InTimeOrder;
use super::run::{self, Computed};
use super::stored_grid;
use super::stored_samples::{self, Recording, StoredSamples};
use crate::error::{Error, Result};
use crate::jobs::progress::Progress;
use crate::live::session_changes;
use crate::state::App;
use crate::store::sessions::Session;
use crate::store::track::Run;
use crate::store::{self, Store, StoreError};
use crate::utc;

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
    /// Told about visits that cannot be used.
    outcomes: Vec<VisitOutcome>,
    /// Told about feet that have no samples.
    anomalies: Vec<Anomaly>,
}

/// Computes a session's track and stores it in place of the former one; then what it is compared with,
/// which nobody needs to wait for.
pub(crate) async fn process(app: &App, session_id: Uuid, progress: Progress) -> Result<(), ProcessError> {
    let walk = Arc::new(Walk::read(app, session_id).await?);
    let cell_ns = stored_grid::cell_ns(app.config.track_rate_hz);
    let (main, filtered, mut progress) =
        blocking(app, &walk, progress, move |store, runtime, walk, progress| {
            compute(store, runtime, walk, cell_ns, progress)
        })
        .await
        .map(|((main, filtered), progress)| (main, filtered, progress))?;
    put_in_place(app, &walk, main).await?;
    progress.tell("comparing", STORED_AT);
    let without_markers = if walk.visits.is_empty() {
        None
    } else {
        let (points, kept) = blocking(app, &walk, progress, move |store, runtime, walk, progress| {
            without_markers(store, runtime, walk, cell_ns, progress)
        })
        .await?;
        progress = kept;
        Some(points)
    };
    progress.tell("storing", COMPARED_AT);
    put_beside(app, session_id, filtered, without_markers).await
}

/// Does a piece of the work on a thread that may block.
async fn blocking<T: Send + 'static>(
    app: &App,
    walk: &Arc<Walk>,
    mut progress: Progress,
    work: impl FnOnce(&Store, &Handle, &Walk, &mut Progress) -> Result<T, ProcessError> + Send + 'static,
) -> Result<(T, Progress), ProcessError> {
    let (store, runtime, walk) = (app.store.clone(), Handle::current(), Arc::clone(walk));
    let working = tokio::task::spawn_blocking(move || {
        let done = work(&store, &runtime, &walk, &mut progress)?;
        Ok((done, progress))
    });
    working.await.map_err(|error| ProcessError::Panicked(error.to_string()))?
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
        let mut visits = Vec::new();
        let mut outcomes = Vec::new();
        for visit in store::visits::of_session(db, session_id).await? {
            match markers.get(&visit.marker) {
                Some(marker) => visits.push(Visit {
                    marker: visit.marker,
                    t_start_ns: visit.t_start_ns,
                    t_end_ns: visit.t_end_ns,
                    position_n_m: (marker.e_m, marker.n_m, marker.u_m),
                }),
                None => outcomes.push(unknown_marker(visit)),
            }
        }
        let feet = recordings.iter().map(|recording| recording.foot).collect();
        let config = engine_config(&app.site, &session, feet);
        Ok(Walk { session, config, recordings, visits, outcomes, anomalies })
    }

    fn samples(&self) -> u64 {
        self.recordings.iter().map(|recording| recording.samples).sum()
    }

    /// The samples, to be read on a thread that may block.
    fn samples_in_order(&self, store: &Store, runtime: &Handle) -> InTimeOrder<StoredSamples> {
        InTimeOrder::new(self.recordings.iter().map(|recording| {
            (recording.foot, StoredSamples::new(store.clone(), runtime.clone(), recording.origin))
        }))
    }

    /// One run, before its first sample.
    fn begin(&self, run: Run) -> run::Run {
        let mut config = self.config.clone();
        let visits = match run {
            Run::Main => {
                config.solution = Solution::Smoothed;
                &self.visits[..]
            }
            Run::Filtered => &self.visits[..],
            Run::WithoutMarkers => {
                config.aids.markers = false;
                &[]
            }
        };
        run::Run::new(config, visits)
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

/// What share of the job each stage is; the last percents are storing.
const FILTERED_AT: f64 = 0.45;
const SMOOTHED_AT: f64 = 0.7;
const STORED_AT: f64 = 0.75;
const COMPARED_AT: f64 = 0.98;

/// The main run, and its points at the stored rate as they were before smoothing.
fn compute(
    store: &Store,
    runtime: &Handle,
    walk: &Walk,
    cell_ns: i64,
    progress: &mut Progress,
) -> Result<(Computed, Vec<TrackPoint>), ProcessError> {
    let mut main = walk.begin(Run::Main);
    let total = walk.samples().max(1) as f64;
    let fed = run::feed(&mut main, walk.samples_in_order(store, runtime), |done| {
        progress.tell("filtering", FILTERED_AT * done as f64 / total);
        !progress.is_stopping()
    });
    if !fed.map_err(ProcessError::Read)? {
        return Err(ProcessError::Stopping);
    }
    let filtered = run::thinned(&main.track.points, cell_ns);
    if filtered.is_empty() {
        return Err(ProcessError::NoTrack { samples: walk.samples() });
    }
    let finished = main.smooth(|share| {
        progress.tell("smoothing", FILTERED_AT + (SMOOTHED_AT - FILTERED_AT) * share);
        !progress.is_stopping()
    });
    if !finished {
        return Err(ProcessError::Stopping);
    }
    progress.tell("storing", SMOOTHED_AT);
    Ok((main.into_computed(cell_ns), filtered))
}

/// The same walk as if no marker had been visited: its points at the stored rate.
fn without_markers(
    store: &Store,
    runtime: &Handle,
    walk: &Walk,
    cell_ns: i64,
    progress: &mut Progress,
) -> Result<Vec<TrackPoint>, ProcessError> {
    let mut run = walk.begin(Run::WithoutMarkers);
    let total = walk.samples().max(1) as f64;
    let fed = run::feed(&mut run, walk.samples_in_order(store, runtime), |done| {
        progress.tell("comparing", STORED_AT + (COMPARED_AT - STORED_AT) * done as f64 / total);
        !progress.is_stopping()
    });
    if fed.map_err(ProcessError::Read)? {
        Ok(run::thinned(&run.track.points, cell_ns))
    } else {
        Err(ProcessError::Stopping)
    }
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
    let computing = tokio::task::spawn_blocking(move || {
        let mut run = walk.begin(run);
        run::feed(&mut run, walk.samples_in_order(&store, &runtime), |_| true)?;
        run.smooth(|_| true);
        Ok::<_, anyhow::Error>(run.track)
    });
    let track = computing.await.map_err(anyhow::Error::new)??;
    Ok((track.points, track.visits))
}

/// Puts the new result in the place of the former one: all of it or nothing. What the former was compared
/// with goes, too.
async fn put_in_place(app: &App, walk: &Arc<Walk>, main: Computed) -> Result<(), ProcessError> {
    let session_id = walk.session.id;
    let last_ns = main.stored.last().map_or(0, |point| point.t_ns);
    let ended_at = utc::at(walk.session.started_at, last_ns);
    let walk = Arc::clone(walk);
    let stored = app
        .store
        .writer()
        .run(move |db| {
            async move {
                for run in [Run::Main, Run::Filtered, Run::WithoutMarkers] {
                    store::track::clear(&mut *db, session_id, run).await?;
                }
                store::track::upsert(&mut *db, session_id, Run::Main, &main.stored).await?;
                store::visits::clear_outcomes(&mut *db, session_id).await?;
                for outcome in main.visits.iter().chain(&walk.outcomes) {
                    store::visits::set_outcome(&mut *db, session_id, outcome).await?;
                }
                store::anomalies::clear(&mut *db, session_id).await?;
                for anomaly in main.anomalies.iter().chain(&walk.anomalies) {
                    store::anomalies::insert(&mut *db, session_id, anomaly).await?;
                }
                store::sessions::set_summary(&mut *db, session_id, &main.summary).await?;
                store::sessions::finish(&mut *db, session_id, ended_at, &main.sha256).await?;
                Ok::<_, StoreError>(())
            }
            .boxed()
        })
        .await;
    stored.map_err(gone_when_dangling)?;
    if let Some(session) = store::sessions::get(app.store.read(), session_id).await? {
        app.hub.publish_all(session_changes(&app.store, session).await?);
    }
    Ok(())
}

/// Stores the runs that the main one is compared with.
async fn put_beside(
    app: &App,
    session_id: Uuid,
    filtered: Vec<TrackPoint>,
    without_markers: Option<Vec<TrackPoint>>,
) -> Result<(), ProcessError> {
    let stored = app
        .store
        .writer()
        .run(move |db| {
            async move {
                store::track::upsert(&mut *db, session_id, Run::Filtered, &filtered).await?;
                if let Some(points) = without_markers {
                    store::track::upsert(&mut *db, session_id, Run::WithoutMarkers, &points).await?;
                }
                Ok::<_, StoreError>(())
            }
            .boxed()
        })
        .await;
    stored.map_err(gone_when_dangling)
}

fn gone_when_dangling(error: StoreError) -> ProcessError {
    if error.is_dangling() { ProcessError::SessionGone } else { error.into() }
}
