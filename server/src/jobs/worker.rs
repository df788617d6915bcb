//! Does what is asked for, one job after the other, the computing on a thread of its own.

use std::time::Instant;

use futures_util::FutureExt;
use tracing::Instrument;

use super::progress::Progress;
use crate::error::{Error, Result};
use crate::sessions::lab_run;
use crate::sessions::process::{self, ProcessError};
use crate::sessions::uploads::publish_session;
use crate::state::App;
use crate::store::jobs::{self, Job, JobState};
use crate::store::sessions::{self, SessionState};
use crate::utc;
use crate::wire::Change;

/// Works until the server stops. Jobs that a stopped server left come first; so do those whose end could not be
/// written, as soon as the store takes writes again.
pub(crate) async fn work(app: App) {
    let _at_work = app.jobs.at_work();
    let mut interrupted = true;
    while !app.stopping.is_cancelled() {
        if interrupted {
            if let Err(error) = queue_interrupted(&app).await {
                tracing::warn!(%error, "jobs that were cut short could not be queued again yet: {error}");
                pause(&app).await;
                continue;
            }
            interrupted = false;
        }
        // Asked before the table is read, so that no job falls between.
        let asked = app.jobs.asked.notified();
        match next(&app).await {
            Ok(Some(job)) => {
                let span = tracing::info_span!("job", job_id = %job.id, session_id = %job.session_id);
                if let Err(error) = run(&app, job).instrument(span).await {
                    tracing::error!(%error, "a job could not be finished: {error}");
                    interrupted = true;
                    pause(&app).await;
                }
            }
            Ok(None) => tokio::select! {
                () = asked => {}
                () = app.stopping.cancelled() => {}
            },
            Err(error) => {
                tracing::error!(%error, "the queue of jobs could not be read: {error}");
                pause(&app).await;
            }
        }
    }
}

/// Lets a store that fails recover.
async fn pause(app: &App) {
    tokio::select! {
        () = tokio::time::sleep(std::time::Duration::from_secs(1)) => {}
        () = app.stopping.cancelled() => {}
    }
}

async fn queue_interrupted(app: &App) -> Result<()> {
    for job in jobs::unfinished(app.store.read()).await? {
        if job.state == JobState::Running {
            let again = Job {
                state: JobState::Queued,
                stage: "waiting".to_owned(),
                progress: 0.0,
                started_at: None,
                ..job
            };
            save(app, &again).await?;
        }
    }
    Ok(())
}

async fn next(app: &App) -> Result<Option<Job>> {
    let unfinished = jobs::unfinished(app.store.read()).await?;
    Ok(unfinished.into_iter().find(|job| job.state == JobState::Queued))
}

async fn run(app: &App, job: Job) -> Result<()> {
    let job =
        Job { state: JobState::Running, stage: "reading".to_owned(), started_at: Some(utc::now()), ..job };
    app.jobs.begin(job.id);
    let begun = save(app, &job).await;
    if !matches!(begun, Ok(true)) {
        app.jobs.forget(job.id);
    }
    if !begun? {
        // Somebody gave it up while it waited.
        return Ok(());
    }
    let progress = Progress::new(app.clone(), job.clone());
    let started = Instant::now();
    let outcome = match job.lab_run_id {
        None => process::process(app, job.session_id, progress).await,
        Some(run_id) => lab_run::compute(app, &job, run_id, progress).await,
    };
    metrics::histogram!("lodestep_job_seconds").record(started.elapsed().as_secs_f64());
    let word = match &outcome {
        Ok(()) => "finished",
        Err(ProcessError::Stopping | ProcessError::SessionGone) => "broken_off",
        Err(_) => "failed",
    };
    metrics::counter!("lodestep_jobs_total", "outcome" => word).increment(1);
    app.jobs.forget(job.id);
    let done = Job { finished_at: Some(utc::now()), stage: String::new(), ..job };
    match outcome {
        Ok(()) => {
            save(app, &Job { state: JobState::Finished, progress: 1.0, ..done }).await?;
        }
        // It stays `running` in the table and is queued again at the next start; or the table says that it was given up.
        Err(ProcessError::Stopping) => return Ok(()),
        // Its row went with the session.
        Err(ProcessError::SessionGone) => return Ok(()),
        // It is not the job's fault: it is done again when the store takes writes.
        Err(ProcessError::Store(error)) if error.is_passing() => return Err(error.into()),
        Err(error) => {
            let why = error.to_string();
            tracing::warn!(job_id = %done.id, session_id = %done.session_id, "a job failed: {why}");
            fail(app, Job { state: JobState::Failed, error: Some(why), ..done }).await?;
        }
    }
    Ok(())
}

/// Notes why, on the job and, where it was to make the session's own track, on that; the former track stays.
async fn fail(app: &App, job: Job) -> Result<()> {
    let row = job.clone();
    app.store
        .writer()
        .run(move |db| {
            async move {
                if !jobs::update(&mut *db, &row).await? || row.lab_run_id.is_some() {
                    return Ok(());
                }
                sessions::set_state(&mut *db, row.session_id, SessionState::Failed, row.error.as_deref())
                    .await?;
                Ok::<_, Error>(())
            }
            .boxed()
        })
        .await?;
    let session_id = job.session_id;
    app.hub.publish(Change::Job { job });
    publish_session(app, session_id).await
}

/// `false` where it has ended meanwhile: somebody gave it up.
async fn save(app: &App, job: &Job) -> Result<bool> {
    let row = job.clone();
    let saved = app
        .store
        .writer()
        .run(move |db| async move { Ok::<_, Error>(jobs::update(&mut *db, &row).await?) }.boxed())
        .await?;
    if saved {
        app.hub.publish(Change::Job { job: job.clone() });
    }
    Ok(saved)
}
