//! From raw samples to a stored track, with every aid and smoothed; then, to compare it with, as the filter
//! told it and as if no marker had been visited.

use std::collections::HashMap;

use futures_util::FutureExt;
use lodestep_engine::event::{Anomaly, AnomalyKind, TrackPoint, VisitOutcome};
use lodestep_engine::identify::automatic_visits;
use lodestep_engine::sample::Foot;
use lodestep_engine::session::{SessionConfig, Solution, Visit};
use tokio::runtime::Handle;
use uuid::Uuid;

use super::engine_config::engine_config;
use super::identification::identification;
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

/// Computes a session's track and stores it in place of the former one; then what it is compared with,
/// which nobody needs to wait for.
pub(crate) async fn process(app: &App, session_id: Uuid, progress: Progress) -> Result<(), ProcessError> {
    let walk = Walk::read(app, session_id).await?;
    let cell_ns = stored_grid::cell_ns(app.config.track_rate_hz);
    let ((main, filtered), walk, mut progress) =
        blocking(app, walk, progress, move |store, runtime, walk, progress| {
            compute(store, runtime, walk, cell_ns, progress)
        })
        .await?;
    put_in_place(app, &walk, main).await?;
    progress.tell("comparing", STORED_AT);
    let without_markers = if walk.visits.is_empty() && walk.made().is_empty() {
        None
    } else {
        let (points, _, kept) = blocking(app, walk, progress, move |store, runtime, walk, progress| {
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
    mut walk: Walk,
    mut progress: Progress,
    work: impl FnOnce(&Store, &Handle, &mut Walk, &mut Progress) -> Result<T, ProcessError> + Send + 'static,
) -> Result<(T, Walk, Progress), ProcessError> {
    let (store, runtime) = (app.store.clone(), Handle::current());
    let working = tokio::task::spawn_blocking(move || {
        let done = work(&store, &runtime, &mut walk, &mut progress)?;
        Ok((done, walk, progress))
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
                config.identification = None;
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

/// What share of the job each stage is; the last percents are storing.
const FILTERED_AT: f64 = 0.45;
const SMOOTHED_AT: f64 = 0.7;
const STORED_AT: f64 = 0.75;
const COMPARED_AT: f64 = 0.98;

/// The main run, and its points at the stored rate as they were before smoothing.
fn compute(
    store: &Store,
    runtime: &Handle,
    walk: &mut Walk,
    cell_ns: i64,
    progress: &mut Progress,
) -> Result<(Computed, Vec<TrackPoint>), ProcessError> {
    make_automatically(store, runtime, walk, progress)?;
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
    let mut run = walk.begin(Run::Filtered);
    let total = walk.samples().max(1) as f64;
    let fed = run::feed(&mut run, walk.samples_in_order(store, runtime), |done| {
        progress.tell("identifying", FILTERED_AT * done as f64 / total);
        !progress.is_stopping()
    });
    if !fed.map_err(ProcessError::Read)? {
        return Err(ProcessError::Stopping);
    }
    let stands = run.track.stands;
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
async fn put_in_place(app: &App, walk: &Walk, main: Computed) -> Result<(), ProcessError> {
    let session_id = walk.session.id;
    let last_ns = main.stored.last().map_or(0, |point| point.t_ns);
    let ended_at = utc::at(walk.session.started_at, last_ns);
    let made: Vec<_> = walk.made().iter().map(|visit| automatic_row(session_id, visit)).collect();
    let is_made = |known: &store::visits::Visit| {
        made.iter().any(|made| made.marker == known.marker && made.t_start_ns == known.t_start_ns)
    };
    let removed: Vec<Uuid> =
        walk.automatic.iter().filter(|known| !is_made(known)).map(|known| known.id).collect();
    let gone = removed.clone();
    let outcomes: Vec<_> = main.visits.iter().chain(&walk.outcomes).cloned().collect();
    let anomalies: Vec<_> = main.anomalies.iter().chain(&walk.anomalies).cloned().collect();
    let stored = app
        .store
        .writer()
        .run(move |db| {
            async move {
                for run in [Run::Main, Run::Filtered, Run::WithoutMarkers] {
                    store::track::clear(&mut *db, session_id, run).await?;
                }
                store::track::upsert(&mut *db, session_id, Run::Main, &main.stored).await?;
                for visit in gone {
                    store::visits::delete(&mut *db, visit).await?;
                }
                for visit in &made {
                    store::visits::insert(&mut *db, visit).await?;
                }
                store::stands::clear(&mut *db, session_id).await?;
                let stands: Vec<_> = main.stands.iter().map(store::stands::Stand::from).collect();
                store::stands::upsert(&mut *db, session_id, &stands).await?;
                store::visits::clear_outcomes(&mut *db, session_id).await?;
                for outcome in &outcomes {
                    store::visits::set_outcome(&mut *db, session_id, outcome).await?;
                }
                store::anomalies::clear(&mut *db, session_id).await?;
                for anomaly in &anomalies {
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
    app.hub.publish_all(removed.into_iter().map(|id| Change::VisitRemoved { session_id, id }));
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
