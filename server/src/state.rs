//! What every handler can reach.

use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use metrics_exporter_prometheus::PrometheusHandle;
use time::OffsetDateTime;
use tokio::sync::{Notify, Semaphore};
use tokio_util::sync::CancellationToken;

use crate::auth::Auth;
use crate::backup_schedule::LastChecked;
use crate::config::Config;
use crate::http;
use crate::jobs;
use crate::live::hub::Hub;
use crate::live::registry::Registry;
use crate::live::{InputFile, PoseHub};
use crate::scrub::Scrubbed;
use crate::sessions::identification::SharedMarkers;
use crate::sessions::upload_turns::UploadTurns;
use crate::site::{Plan, Site};
use crate::store::Store;

/// The running server: shared by all handlers and tasks.
pub type App = Arc<State>;

/// What a running server consists of.
pub struct State {
    /// When it was started.
    pub started_at: OffsetDateTime,
    /// How it was set up.
    pub config: Config,
    /// The site it serves.
    pub site: Site,
    /// What stands still there.
    pub plan: Plan,
    /// The description of the API, in JSON.
    pub(crate) openapi: Bytes,
    /// Everything that is kept.
    pub store: Store,
    /// Who is known, and who guesses.
    pub(crate) auth: Auth,
    /// What each route asks of its caller.
    pub(crate) routes: http::Table,
    /// Who may change which upload now.
    pub upload_turns: UploadTurns,
    /// The marker database, as every session's engine wants it.
    pub(crate) shared_markers: SharedMarkers,
    /// Where live walks put their past.
    pub(crate) input_file: InputFile,
    /// Permits to read an uploaded log, which keeps a core busy.
    pub log_readers: Semaphore,
    /// Work that takes a while.
    pub jobs: jobs::Queue,
    /// What was found to have changed on the disk.
    pub(crate) scrubbed: Scrubbed,
    /// What became of the last backup when it was read again.
    pub(crate) last_backup: LastChecked,
    /// One file of markers is applied or reverted at a time.
    pub(crate) import_turns: tokio::sync::Mutex<()>,
    /// Wakes who removes what removed sessions have left.
    pub(crate) removals: Notify,
    /// Wakes who takes events to other programs.
    pub webhooks: Notify,
    /// Where changes are told, once they are on disk.
    pub hub: Arc<Hub>,
    /// The walks that are streamed right now.
    pub live: Registry,
    /// Where their poses are told at once.
    pub(crate) poses: PoseHub,
    /// The figures behind `/metrics`.
    pub metrics: PrometheusHandle,
    /// Cancelled when the server begins to stop: sockets and jobs end what they are doing.
    pub stopping: CancellationToken,
}

/// How long open requests, sockets and jobs may go on once the server stops.
pub(crate) const STOP_WITHIN: Duration = Duration::from_secs(10);
