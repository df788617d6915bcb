//! A walk worked out once more with chosen parameters and aids, beside its own track, which stays as it is. With the
//! parameters of that it comes to the session's own track, to the last bit.

use std::time::Instant;

use futures_util::FutureExt;
use lodestep_engine::event::AidKind;
use lodestep_engine::parameters::Parameters;
use tokio::runtime::Handle;
use uuid::Uuid;

use super::computation;
use super::parameters::Wanted;
use super::process::{ProcessError, blocking, make_automatically, no_track};
use super::provenance::provenance;
use super::replace_result::gone_when_dangling;
use super::stored_session::StoredSession;
use super::thinning;
use crate::jobs::progress::Progress;
use crate::state::App;
use crate::store::jobs::{self, Job, JobState};
use crate::store::lab_runs::{self, Figures, LabRun, Provenance};
use crate::store::{Store, StoreError, lab_tracks};

/// What share of the job each stage is; the last percents are storing.
const FILTERED_AT: f64 = 0.65;
const SMOOTHED_AT: f64 = 0.98;

/// Computes a run and stores it, unless its job was given up meanwhile.
pub(crate) async fn compute(
    app: &App,
    job: &Job,
    run_id: Uuid,
    progress: Progress,
) -> Result<(), ProcessError> {
    let asked = lab_runs::get(app.store.read(), run_id).await?.ok_or(ProcessError::SessionGone)?;
    // A newer engine may know a parameter no longer, or in another range.
    let parameters = Parameters::new(asked.parameters.clone())
        .map_err(|error| ProcessError::Parameters(error.to_string()))?;
    let mut walk = StoredSession::read(app, asked.session_id, Wanted::Defaults).await?;
    parameters.apply(&mut walk.config);
    walk.chosen.parameters = parameters;
    if let Some(kinds) = &asked.aids {
        walk.config.system.use_aids(kinds);
    }
    if !walk.config.system.aids().contains(&AidKind::MARKERS) {
        walk.config.identification = None;
    }
    let cell_ns = thinning::cell_ns(app.config.track_rate_hz);
    let (computed, _, _) = blocking(app, walk, progress, move |store, runtime, walk, progress| {
        work(store, runtime, walk, &asked, cell_ns, progress)
    })
    .await?;
    keep(app, job.id, run_id, computed).await
}

/// What is stored of a run.
struct Outcome {
    figures: Figures,
    provenance: Provenance,
    track: lab_tracks::Packed,
}

/// The computing, on a thread that may block.
fn work(
    store: &Store,
    runtime: &Handle,
    walk: &mut StoredSession,
    asked: &LabRun,
    cell_ns: i64,
    progress: &mut Progress,
) -> Result<Outcome, ProcessError> {
    let begun = Instant::now();
    make_automatically(store, runtime, walk, cell_ns, progress)?;
    let mut run = walk.begin_in_lab(asked.solution)?;
    let total = walk.samples().max(1) as f64;
    let fed = computation::feed(&mut run, walk.samples_in_order(store, runtime), |done| {
        progress.tell("filtering", FILTERED_AT * done as f64 / total);
        !progress.is_stopping()
    });
    if !fed.map_err(ProcessError::Read)? {
        return Err(ProcessError::Stopping);
    }
    if run.track.points.is_empty() {
        return Err(no_track(walk.samples(), &run.track.anomalies));
    }
    let finished = run.smooth(|share| {
        progress.tell("smoothing", FILTERED_AT + (SMOOTHED_AT - FILTERED_AT) * share);
        !progress.is_stopping()
    });
    if !finished {
        return Err(ProcessError::Stopping);
    }
    progress.tell("storing", SMOOTHED_AT);
    let process_s = begun.elapsed().as_secs_f64();
    let computed = run.into_computed(cell_ns, process_s);
    let told = (&walk.chosen, asked.solution, &computed.sha256[..]);
    Ok(Outcome {
        provenance: provenance(walk, store, runtime, told)?,
        track: lab_tracks::Packed::new(&computed.stored)?,
        figures: computed.figures,
    })
}

async fn keep(app: &App, job_id: Uuid, run_id: Uuid, result: Outcome) -> Result<(), ProcessError> {
    let stored = app
        .store
        .writer()
        .run(move |db| {
            async move {
                // Given up at the last moment: nothing of it is wanted.
                let job = jobs::get(&mut *db, job_id).await?;
                if job.is_some_and(|job| job.state == JobState::Running) {
                    lab_runs::set_result(&mut *db, run_id, &result.figures, &result.provenance).await?;
                    lab_tracks::set(&mut *db, run_id, &result.track).await?;
                }
                Ok::<_, StoreError>(())
            }
            .boxed()
        })
        .await;
    stored.map_err(gone_when_dangling)
}
