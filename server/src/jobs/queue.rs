//! Asking for work, and looking at how far it is.

use std::collections::{HashMap, HashSet};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard};

use futures_util::FutureExt;
use tokio::sync::Notify;
use uuid::Uuid;

use crate::error::{Error, Result};
use crate::sessions::uploads::publish_session;
use crate::state::App;
use crate::store::jobs::{self, Job, JobState};
use crate::store::live_states;
use crate::store::sessions::{self, SessionState};
use crate::wire::Change;

/// What the requests and the worker share.
#[derive(Debug, Default)]
pub struct Queue {
    /// Wakes the worker.
    pub(crate) asked: Notify,
    /// Stage and progress of the jobs that run now.
    running: Mutex<HashMap<Uuid, (&'static str, f64)>>,
    /// Those that were given up while they ran, until the worker has let go of them.
    given_up: Mutex<HashSet<Uuid>>,
    /// Whether somebody does what is asked for.
    has_worker: AtomicBool,
}

/// The worker is there for as long as this is.
pub(super) struct AtWork<'a>(&'a Queue);

impl Drop for AtWork<'_> {
    fn drop(&mut self) {
        self.0.has_worker.store(false, Ordering::Relaxed);
    }
}

impl Queue {
    /// Somebody begins to do what is asked for, until the guard is dropped: however that comes about.
    pub(super) fn at_work(&self) -> AtWork<'_> {
        self.has_worker.store(true, Ordering::Relaxed);
        AtWork(self)
    }

    /// Whether somebody does what is asked for.
    pub(crate) fn has_worker(&self) -> bool {
        self.has_worker.load(Ordering::Relaxed)
    }

    /// A job with its progress of this moment.
    pub(crate) fn as_it_stands(&self, job: Job) -> Job {
        match self.running().get(&job.id) {
            Some((stage, progress)) if job.state == JobState::Running => {
                Job { stage: (*stage).to_owned(), progress: *progress, ..job }
            }
            _ => job,
        }
    }

    pub(super) fn note(&self, job_id: Uuid, stage: &'static str, progress: f64) {
        self.running().insert(job_id, (stage, progress));
    }

    pub(super) fn forget(&self, job_id: Uuid) {
        self.running().remove(&job_id);
        self.given_up().remove(&job_id);
    }

    /// The worker takes a job up.
    pub(super) fn begin(&self, job_id: Uuid) {
        self.note(job_id, "reading", 0.0);
    }

    /// Whether it is being done.
    pub(super) fn is_in_hand(&self, job_id: Uuid) -> bool {
        self.running().contains_key(&job_id)
    }

    /// The worker is to let go of this job, if it has it.
    pub(crate) fn give_up(&self, job_id: Uuid) {
        if self.running().contains_key(&job_id) {
            self.given_up().insert(job_id);
        }
    }

    /// Whether it was given up.
    pub(super) fn is_given_up(&self, job_id: Uuid) -> bool {
        self.given_up().contains(&job_id)
    }

    fn given_up(&self) -> MutexGuard<'_, HashSet<Uuid>> {
        self.given_up.lock().expect("nothing panics while it holds the list")
    }

    fn running(&self) -> MutexGuard<'_, HashMap<Uuid, (&'static str, f64)>> {
        self.running.lock().expect("nothing panics while it holds the progress")
    }
}

/// Asks for a session's track to be computed from its stored samples. When that is waiting to be done
/// already, the answer is the waiting job.
pub(crate) async fn enqueue(app: &App, session_id: Uuid) -> Result<Job> {
    let session = sessions::get(app.store.read(), session_id).await?;
    let session = session.ok_or_else(|| Error::not_found("session", session_id))?;
    if session.state == SessionState::Live {
        return Err(Error::conflict(
            "session_live",
            "a device still streams this session, and its track grows by itself: finish it on the device, or wait for its end",
        ));
    }
    put(app, session_id).await
}

/// Asks for the final track of a session whose stream has ended; in one write with the end, so that no
/// session is left without its job.
pub(crate) async fn enqueue_ended_stream(app: &App, session_id: Uuid) -> Result<Job> {
    put(app, session_id).await
}

async fn put(app: &App, session_id: Uuid) -> Result<Job> {
    let job = Job::new(session_id, None);
    let job = app
        .store
        .writer()
        .run(move |db| {
            async move {
                if let Some(waiting) = jobs::unfinished_of_session(&mut *db, session_id).await?
                    && waiting.state == JobState::Queued
                {
                    return Ok(waiting);
                }
                jobs::insert(&mut *db, &job).await?;
                sessions::set_state(&mut *db, session_id, SessionState::Processing, None).await?;
                live_states::clear(&mut *db, session_id).await?;
                Ok::<_, Error>(job)
            }
            .boxed()
        })
        .await?;
    app.hub.publish(Change::Job { job: job.clone() });
    publish_session(app, session_id).await?;
    app.jobs.asked.notify_one();
    Ok(job)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_worker_that_has_gone_is_missed_also_when_it_panicked() {
        let queue = Queue::default();
        assert!(!queue.has_worker());
        let panicked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            let _at_work = queue.at_work();
            assert!(queue.has_worker());
            std::panic::resume_unwind(Box::new("the worker fails"));
        }));
        assert!(panicked.is_err() && !queue.has_worker());
    }
}
