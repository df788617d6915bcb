//! Does what is asked for, a few jobs at a time and never two of one session, the computing on threads of their own.

use std::collections::HashSet;
use std::time::Instant;

use futures_util::FutureExt;
use tokio::task::{JoinError, JoinSet};
use tracing::Instrument;
use uuid::Uuid;

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
    let (mut interrupted, mut died) = (true, true);
    let mut in_hand = InHand::default();
    while !app.stopping.is_cancelled() {
        if interrupted {
            if let Err(error) = queue_interrupted(&app, died).await {
                tracing::warn!(%error, "jobs that were cut short could not be queued again yet: {error}");
                pause(&app).await;
                continue;
            }
            (interrupted, died) = (false, false);
        }
        // Asked before the table is read, so that no job falls between.
        let asked = app.jobs.asked.notified();
        let next = if in_hand.sessions.len() < app.config.jobs_at_a_time() {
            next(&app, &in_hand.sessions).await
        } else {
            Ok(None)
        };
        match next {
            Ok(Some(job)) => in_hand.take(&app, job),
            Ok(None) => tokio::select! {
                () = asked => {}
                Some(ended) = in_hand.jobs.join_next() => {
                    if let Err(error) = in_hand.ended(ended) {
                        tracing::error!(%error, "a job could not be finished: {error}");
                        interrupted = true;
                        pause(&app).await;
                    }
                }
                () = app.stopping.cancelled() => {}
            },
            Err(error) => {
                tracing::error!(%error, "the queue of jobs could not be read: {error}");
                pause(&app).await;
            }
        }
    }
    // They stop by themselves, each within some thousand samples.
    while let Some(ended) = in_hand.jobs.join_next().await {
        if let Err(error) = in_hand.ended(ended) {
            tracing::error!(%error, "a job could not be put back: {error}");
        }
    }
}

/// The jobs that are being done, and whose sessions they are.
#[derive(Default)]
struct InHand {
    jobs: JoinSet<(Uuid, Result<()>)>,
    sessions: HashSet<Uuid>,
}

impl InHand {
    fn take(&mut self, app: &App, job: Job) {
        let span = tracing::info_span!("job", job_id = %job.id, session_id = %job.session_id);
        let (app, session_id) = (app.clone(), job.session_id);
        self.sessions.insert(session_id);
        self.jobs.spawn(async move { (session_id, run(&app, job).await) }.instrument(span));
    }

    /// What one came to. One that panicked takes the worker with it, which is missed then.
    fn ended(&mut self, ended: std::result::Result<(Uuid, Result<()>), JoinError>) -> Result<()> {
        match ended {
            Ok((session_id, outcome)) => {
                self.sessions.remove(&session_id);
                outcome
            }
            Err(error) => match error.try_into_panic() {
                Ok(panic) => std::panic::resume_unwind(panic),
                Err(_) => Ok(()),
            },
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

/// How often a server may die while it does a job.
const MOST_TRIES: u32 = 2;

/// Queues the jobs again that were running and are not in hand; of a server that `died` those are set aside under which that happened before.
async fn queue_interrupted(app: &App, died: bool) -> Result<()> {
    for job in jobs::unfinished(app.store.read()).await? {
        if job.state == JobState::Running && !app.jobs.is_in_hand(job.id) {
            if died && job.tries >= MOST_TRIES {
                let why = format!(
                    "the server ended {} times while it did this job, so it is set aside, and the former track stays: see the server's log and its memory, and look at the times and units of the logs; then process again",
                    job.tries
                );
                tracing::error!(job_id = %job.id, session_id = %job.session_id, "a job was set aside: {why}");
                let done =
                    Job { state: JobState::Failed, finished_at: Some(utc::now()), error: Some(why), ..job };
                fail(app, Job { stage: String::new(), ..done }).await?;
                continue;
            }
            let again = Job {
                state: JobState::Queued,
                stage: "waiting".to_owned(),
                progress: 0.0,
                started_at: None,
                // It was not the job's doing that its end could not be written.
                tries: if died { job.tries } else { job.tries.saturating_sub(1) },
                ..job
            };
            save(app, &again).await?;
        }
    }
    Ok(())
}

/// The next that is to be done, of a session of which no other is.
async fn next(app: &App, in_hand: &HashSet<Uuid>) -> Result<Option<Job>> {
    let unfinished = jobs::unfinished(app.store.read()).await?;
    let is_next = |job: &Job| job.state == JobState::Queued && !in_hand.contains(&job.session_id);
    Ok(unfinished.into_iter().find(is_next))
}

async fn run(app: &App, job: Job) -> Result<()> {
    let tries = job.tries;
    let job = Job {
        state: JobState::Running,
        stage: "reading".to_owned(),
        started_at: Some(utc::now()),
        tries: tries + 1,
        ..job
    };
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
    let outcome = match outcome {
        Err(ProcessError::Stopping)
            if started.elapsed() >= app.config.job_limit()
                && !app.stopping.is_cancelled()
                && !app.jobs.is_given_up(job.id) =>
        {
            Err(ProcessError::TooLong { limit_s: app.config.job_s })
        }
        other => other,
    };
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
        // It is queued again, for the next start; or the table says that it was given up.
        Err(ProcessError::Stopping) => {
            let waiting = "waiting".to_owned();
            let again = Job {
                state: JobState::Queued,
                stage: waiting,
                started_at: None,
                finished_at: None,
                tries,
                ..done
            };
            save(app, &again).await?;
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::serve;
    use crate::store::sessions::{Session, Start};
    use crate::store::{StoreError, inspectors};

    /// A server with a session whose job was running so often when the server died.
    async fn died(folder: &std::path::Path, tries: u32) -> (App, Job) {
        let app = serve::open(Config::for_testing(folder)).await.unwrap();
        let now = utc::now();
        let walker = inspectors::Inspector {
            id: uuid::Uuid::now_v7(),
            name: format!("{tries}"),
            kind: inspectors::person(),
            created_at: now,
        };
        let session = Session {
            id: uuid::Uuid::now_v7(),
            inspector_id: walker.id,
            title: String::new(),
            state: SessionState::Processing,
            started_at: now,
            ended_at: None,
            system: "pedestrian".into(),
            streams: lodestep_engine::systems::pedestrian::BOTH.to_vec(),
            former: Default::default(),
            start: Start::default(),
            instrument: None,
            initial_heading_deg: None,
            automatic_visits: false,
            site_parameters_id: None,
            excluded: false,
            samples: 0,
            epochs: 0,
            duration_s: 0.0,
            distance_m: 0.0,
            since_marker_s: 0.0,
            since_marker_m: 0.0,
            track_sha256: None,
            error: None,
            created_at: now,
        };
        let job = Job { state: JobState::Running, tries, ..Job::new(session.id, None) };
        let row = job.clone();
        let insert = app.store.writer().run(move |db| {
            async move {
                inspectors::insert(&mut *db, &walker).await?;
                sessions::insert(&mut *db, &session).await?;
                jobs::insert(&mut *db, &row).await
            }
            .boxed()
        });
        insert.await.map_err(|error: StoreError| error).unwrap();
        (app, job)
    }

    #[tokio::test]
    async fn a_job_under_which_the_server_died_twice_is_set_aside_and_told() {
        let folder = tempfile::tempdir().unwrap();
        let (app, once) = died(folder.path(), 1).await;
        queue_interrupted(&app, true).await.unwrap();
        let again = jobs::get(app.store.read(), once.id).await.unwrap().unwrap();
        assert_eq!((again.state, again.tries), (JobState::Queued, 1));
        app.store.close().await;

        let folder = tempfile::tempdir().unwrap();
        let (app, twice) = died(folder.path(), 2).await;
        queue_interrupted(&app, true).await.unwrap();
        let aside = jobs::get(app.store.read(), twice.id).await.unwrap().unwrap();
        assert_eq!(aside.state, JobState::Failed);
        assert!(aside.error.as_deref().unwrap().contains("set aside"), "{aside:?}");
        let session = sessions::get(app.store.read(), twice.session_id).await.unwrap().unwrap();
        assert_eq!((session.state, session.error), (SessionState::Failed, aside.error));
        assert!(next(&app, &HashSet::new()).await.unwrap().is_none(), "it is done again");
        app.store.close().await;
    }

    #[tokio::test]
    async fn a_job_in_hand_is_neither_queued_again_nor_is_another_of_its_session_begun() {
        let folder = tempfile::tempdir().unwrap();
        let (app, job) = died(folder.path(), 1).await;
        app.jobs.begin(job.id);
        queue_interrupted(&app, false).await.unwrap();
        let still = jobs::get(app.store.read(), job.id).await.unwrap().unwrap();
        assert_eq!(still.state, JobState::Running);
        app.jobs.forget(job.id);
        queue_interrupted(&app, false).await.unwrap();
        let queued = next(&app, &HashSet::new()).await.unwrap();
        assert_eq!(queued.map(|queued| queued.id), Some(job.id));
        let own = HashSet::from([job.session_id]);
        assert!(next(&app, &own).await.unwrap().is_none(), "two jobs of one session");
        app.store.close().await;
    }

    #[tokio::test]
    async fn a_job_whose_end_could_not_be_written_is_not_to_blame() {
        let folder = tempfile::tempdir().unwrap();
        let (app, job) = died(folder.path(), 2).await;
        queue_interrupted(&app, false).await.unwrap();
        let again = jobs::get(app.store.read(), job.id).await.unwrap().unwrap();
        assert_eq!((again.state, again.tries), (JobState::Queued, 1));
        app.store.close().await;
    }
}
