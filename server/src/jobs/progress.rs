//! How far the running job is: told in steps, so that nobody is told too often.

use std::time::Instant;

use crate::state::App;
use crate::store::jobs::Job;
use crate::wire::Change;

/// Steps from nothing to done.
const STEPS: f64 = 50.0;

/// Tells the progress of one job.
pub(crate) struct Progress {
    app: App,
    job: Job,
    stage: &'static str,
    step: f64,
    begun_at: Instant,
}

impl Progress {
    pub(crate) fn new(app: App, job: Job) -> Progress {
        Progress { app, job, stage: "", step: 0.0, begun_at: Instant::now() }
    }

    /// The job is in this stage and this far, from 0 to 1, over all stages.
    pub(crate) fn tell(&mut self, stage: &'static str, progress: f64) {
        let step = (progress * STEPS).floor();
        // What was given up is told as that, and nothing after it.
        if (step == self.step && stage == self.stage) || self.app.jobs.is_given_up(self.job.id) {
            return;
        }
        (self.stage, self.step) = (stage, step);
        self.app.jobs.note(self.job.id, stage, progress);
        let job = Job { stage: stage.to_owned(), progress, ..self.job.clone() };
        self.app.hub.publish(Change::Job { job });
    }

    /// Whether to end early: the server is stopping, and the job will be begun again at the next start; or somebody
    /// has given it up; or it has taken as long as a job may.
    pub(crate) fn is_stopping(&self) -> bool {
        self.begun_at.elapsed() >= self.app.config.job_limit()
            || self.app.stopping.is_cancelled()
            || self.app.jobs.is_given_up(self.job.id)
    }
}
