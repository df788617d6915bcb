//! From raw samples to a stored track, with every aid and smoothed, after [`clock_tie`] has put what was keyed in onto
//! the log's clock; then the walk's faults are placed by it; and then, to compare it with, as the filter
//! told it and as if no marker had been visited.

use std::time::Instant;

use lodestep_engine::anomaly::Anomaly;
use lodestep_engine::event::{TrackPoint, VisitOutcome};
use lodestep_engine::identify::automatic_visits;
use lodestep_engine::session::{ConfigError, Solution};
use tokio::runtime::Handle;
use uuid::Uuid;

use super::clock_tie;
use super::computation::{self, Computed};
use super::parameters::Wanted;
use super::provenance::provenance;
use super::replace_result::{gone_when_dangling, put_beside, replace_result};
use super::stored_session::StoredSession;
use super::thinning;
use crate::background::in_background;
use crate::error::{Error, Result};
use crate::faults::place_again;
use crate::jobs::progress::Progress;
use crate::state::App;
use crate::store::lab_runs::Provenance;
use crate::store::track::TrackKind;
use crate::store::{Store, StoreError};

/// Why a session's track could not be computed. The former track stays.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ProcessError {
    #[error("the server is stopping")]
    Stopping,
    #[error("the session was deleted")]
    SessionGone,
    #[error("{0}")]
    Parameters(String),
    #[error(transparent)]
    Streams(#[from] ConfigError),
    #[error(
        "there are no samples to compute a track from: upload a log of at least one stream, then process again"
    )]
    NoSamples,
    #[error("{samples} samples gave no position: {why}")]
    NoTrack { samples: u64, why: String },
    #[error(
        "working it out took longer than {limit_s} s and was ended: look at the times and the rate of the logs, or let it take longer with `serve --job-s`"
    )]
    TooLong { limit_s: u64 },
    #[error(
        "the {epochs} epochs of this walk would take {needed_bytes} bytes of memory, more than the {most_bytes} that a walk may take: look at the times and the rate of the logs, or allow more with `serve --job-bytes`"
    )]
    TooLarge { epochs: u64, needed_bytes: u64, most_bytes: u64 },
    #[error("the computation met a fault of its own and was given up ({0}): please report it with the log")]
    Panicked(String),
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error(transparent)]
    Read(anyhow::Error),
}

/// Computes a session's track and stores it in place of the former one; then what it is compared with,
/// which nobody needs to wait for.
pub(crate) async fn process(app: &App, session_id: Uuid, progress: Progress) -> Result<(), ProcessError> {
    let progress = clock_tie::tie(app, session_id, progress).await?;
    let walk = StoredSession::read(app, session_id, Wanted::Site).await?;
    let cell_ns = thinning::cell_ns(app.config.track_rate_hz);
    let ((main, filtered), walk, mut progress) =
        blocking(app, walk, progress, move |store, runtime, walk, progress| {
            compute(store, runtime, walk, cell_ns, progress)
        })
        .await?;
    replace_result(app, &walk, main).await?;
    place_again(app, session_id).await.map_err(|error| match error {
        Error::Store(error) => gone_when_dangling(error),
        error => ProcessError::Read(anyhow::Error::new(error)),
    })?;
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
pub(super) async fn blocking<T: Send + 'static>(
    app: &App,
    mut walk: StoredSession,
    mut progress: Progress,
    work: impl FnOnce(&Store, &Handle, &mut StoredSession, &mut Progress) -> Result<T, ProcessError>
    + Send
    + 'static,
) -> Result<(T, StoredSession, Progress), ProcessError> {
    let (store, runtime) = (app.store.clone(), Handle::current());
    let working = in_background(move || {
        let done = work(&store, &runtime, &mut walk, &mut progress)?;
        Ok((done, walk, progress))
    });
    working.await.map_err(|error| ProcessError::Panicked(error.to_string()))?
}

/// What share of the job each stage is; the last percents are storing.
const FILTERED_AT: f64 = 0.45;
const SMOOTHED_AT: f64 = 0.7;
const STORED_AT: f64 = 0.75;
const COMPARED_AT: f64 = 0.98;

/// The main run with where it comes from, and its points at the stored rate as they were before smoothing.
fn compute(
    store: &Store,
    runtime: &Handle,
    walk: &mut StoredSession,
    cell_ns: i64,
    progress: &mut Progress,
) -> Result<((Computed, Provenance), Vec<TrackPoint>), ProcessError> {
    let begun = Instant::now();
    let clocks_told = walk.clocks_told(store, runtime);
    walk.anomalies.extend(clocks_told);
    make_automatically(store, runtime, walk, cell_ns, progress)?;
    let mut main = walk.begin(TrackKind::Main)?;
    main.record();
    let total = walk.samples().max(1) as f64;
    let fed = computation::feed(&mut main, walk.samples_in_order(store, runtime), |done| {
        progress.tell("filtering", FILTERED_AT * done as f64 / total);
        !progress.is_stopping()
    });
    if !fed.map_err(ProcessError::Read)? {
        return Err(ProcessError::Stopping);
    }
    let filtered = computation::thinned(&main.track.points, cell_ns);
    if filtered.is_empty() {
        return Err(no_track(walk.samples(), &main.track.anomalies));
    }
    let finished = main.smooth(|share| {
        progress.tell("smoothing", FILTERED_AT + (SMOOTHED_AT - FILTERED_AT) * share);
        !progress.is_stopping()
    });
    if !finished {
        return Err(ProcessError::Stopping);
    }
    progress.tell("storing", SMOOTHED_AT);
    let main = main.into_computed(cell_ns, begun.elapsed().as_secs_f64());
    let told = (&walk.chosen, Solution::Smoothed, &main.sha256[..]);
    let provenance = provenance(walk, store, runtime, told)?;
    Ok(((main, provenance), filtered))
}

/// Why there is no position: what the system says of the whole session, where it says something.
pub(super) fn no_track(samples: u64, anomalies: &[Anomaly]) -> ProcessError {
    let why = anomalies.iter().rfind(|anomaly| anomaly.stream.is_none());
    let why = why.map_or(
        "expected a standing start of some seconds and a walk; check that the right log was uploaded",
        |why| &why.detail,
    );
    ProcessError::NoTrack { samples, why: why.to_owned() }
}

/// The same walk as if no marker had been visited: its points at the stored rate.
fn without_markers(
    store: &Store,
    runtime: &Handle,
    walk: &StoredSession,
    cell_ns: i64,
    progress: &mut Progress,
) -> Result<Vec<TrackPoint>, ProcessError> {
    let mut run = walk.begin(TrackKind::WithoutMarkers)?;
    run.thin(cell_ns);
    let total = walk.samples().max(1) as f64;
    let fed = computation::feed(&mut run, walk.samples_in_order(store, runtime), |done| {
        progress.tell("comparing", STORED_AT + (COMPARED_AT - STORED_AT) * done as f64 / total);
        !progress.is_stopping()
    });
    if fed.map_err(ProcessError::Read)? { Ok(run.track.points) } else { Err(ProcessError::Stopping) }
}

/// In automatic mode, finds in a run of its own which stands are nearly certain by all of the walk.
pub(super) fn make_automatically(
    store: &Store,
    runtime: &Handle,
    walk: &mut StoredSession,
    cell_ns: i64,
    progress: &mut Progress,
) -> Result<(), ProcessError> {
    let Some(identification) = &mut walk.config.identification else { return Ok(()) };
    identification.automatic_visits.clear();
    if !walk.session.automatic_visits {
        return Ok(());
    }
    let mut run = walk.begin(TrackKind::Filtered)?;
    run.thin(cell_ns);
    let total = walk.samples().max(1) as f64;
    let fed = computation::feed(&mut run, walk.samples_in_order(store, runtime), |done| {
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
    run: TrackKind,
) -> Result<(Vec<TrackPoint>, Vec<VisitOutcome>)> {
    let walk = match StoredSession::read(app, session_id, Wanted::AsStored).await {
        Err(ProcessError::SessionGone) => return Err(Error::not_found("session", session_id)),
        Err(ProcessError::Store(error)) => return Err(error.into()),
        Err(ProcessError::Parameters(why)) => return Err(Error::conflict("wrong_parameter", why)),
        Err(error) => return Err(Error::invalid("no_samples", error.to_string())),
        Ok(walk) => walk,
    };
    let (store, runtime) = (app.store.clone(), Handle::current());
    let _permit = app.log_readers.acquire().await;
    let computing = in_background(move || {
        let mut run = walk.begin(run)?;
        computation::feed(&mut run, walk.samples_in_order(&store, &runtime), |_| true)?;
        run.smooth(|_| true);
        Ok::<_, anyhow::Error>(run.track)
    });
    let track = computing.await.map_err(anyhow::Error::new)??;
    Ok((track.points, track.visits))
}
