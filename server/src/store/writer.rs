//! The one writer: a task that owns the only writing connection. Whatever waits while a commit is on
//! its way to the disk is committed together by the next; each caller hears back after that.

use std::panic::AssertUnwindSafe;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use lodestep_engine::event::{Anomaly, TrackPoint, VisitOutcome};
use lodestep_engine::session::Summary;
use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{ConnectOptions, Connection, SqliteConnection};
use tokio::sync::{mpsc, oneshot};
use uuid::Uuid;

use super::raw_chunks::{self, Packed, Samples};
use super::stands::{self, Stand};
use super::track::{self, Run};
use super::visits::Visit;
use super::{StoreError, anomalies, migrations, sessions, visits};

/// Writes that may wait; more make their senders wait.
const QUEUE: usize = 1_024;
/// Writes in one commit: bounds what a failed commit takes with it, and how long the first waits.
const GROUP_WRITES: usize = 256;
/// Bytes of samples in one commit.
const GROUP_BYTES: usize = 256 << 10;

/// Writes to the store. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Writer {
    queue: mpsc::Sender<Message>,
    healthy: Arc<AtomicBool>,
}

/// What a live session found out and wants on disk, all or nothing.
#[derive(Clone, Debug, Default)]
pub struct Record {
    /// The walk.
    pub session_id: Uuid,
    /// Its samples, as they came.
    pub raw: Vec<Samples>,
    /// New points of its main run.
    pub points: Vec<TrackPoint>,
    /// Points that were corrected in hindsight; those that are not stored are passed over.
    pub revised: Vec<TrackPoint>,
    /// Where its inspector stood.
    pub stands: Vec<Stand>,
    /// Visits that automatic mode has made.
    pub automatic: Vec<Visit>,
    /// What became of its visits.
    pub visits: Vec<VisitOutcome>,
    /// What was found wrong.
    pub anomalies: Vec<Anomaly>,
    /// What it amounts to so far.
    pub summary: Option<Summary>,
}

enum Message {
    Write(Write),
    Stop(oneshot::Sender<()>),
}

struct Write {
    bytes: usize,
    work: Box<dyn Work>,
}

/// A write that waits for its turn, with the one who waits for it.
trait Work: Send {
    /// Does it inside the group's transaction; `false` when its own part is to be taken back.
    fn run<'c>(&'c mut self, connection: &'c mut SqliteConnection) -> BoxFuture<'c, bool>;
    /// The group is on disk, or it is not: tells whoever waits.
    fn resolve(self: Box<Self>, committed: Result<(), String>);
}

/// Work of a certain answer.
struct Task<F, T, E> {
    work: Option<F>,
    answer: Option<Result<T, E>>,
    caller: oneshot::Sender<Result<T, E>>,
}

impl<F, T, E> Work for Task<F, T, E>
where
    F: for<'c> FnOnce(&'c mut SqliteConnection) -> BoxFuture<'c, Result<T, E>> + Send,
    T: Send,
    E: From<StoreError> + Send,
{
    fn run<'c>(&'c mut self, connection: &'c mut SqliteConnection) -> BoxFuture<'c, bool> {
        Box::pin(async move {
            let Some(work) = self.work.take() else { return false };
            let answer = AssertUnwindSafe(async { work(connection).await }).catch_unwind().await;
            let answer = answer.unwrap_or_else(|_| {
                Err(StoreError::NotCommitted("the write itself panicked; nothing of it is stored".into())
                    .into())
            });
            self.answer.insert(answer).is_ok()
        })
    }

    fn resolve(self: Box<Self>, committed: Result<(), String>) {
        let answer = match (self.answer, committed) {
            (Some(Ok(answer)), Ok(())) => Ok(answer),
            // What it was turned down for is its own, whatever became of the group.
            (Some(Err(error)), _) => Err(error),
            (Some(Ok(_)), Err(why)) => Err(StoreError::NotCommitted(why).into()),
            (None, Err(why)) => Err(StoreError::NotCommitted(why).into()),
            (None, Ok(())) => Err(StoreError::NotCommitted("it was passed over".into()).into()),
        };
        // Who no longer waits need not be told.
        let _ = self.caller.send(answer);
    }
}

impl Writer {
    /// Opens the writing connection, brings the database up to date and starts the task.
    pub(super) async fn start(options: SqliteConnectOptions) -> Result<Writer, StoreError> {
        let mut connection = options.connect().await?;
        migrations::run(&mut connection).await?;
        let (queue, messages) = mpsc::channel(QUEUE);
        let healthy = Arc::new(AtomicBool::new(true));
        tokio::spawn(write_groups(options, connection, messages, Arc::clone(&healthy)));
        Ok(Writer { queue, healthy })
    }

    /// Puts a live session's findings on disk.
    pub async fn record(&self, record: Record) -> Result<(), StoreError> {
        let raw = record.raw.iter().map(Packed::new).collect::<Result<Vec<_>, _>>()?;
        let bytes = raw.iter().map(Packed::bytes).sum();
        self.submit(bytes, move |db| {
            Box::pin(async move {
                let id = record.session_id;
                for chunk in raw {
                    raw_chunks::insert(&mut *db, id, None, chunk).await?;
                }
                track::upsert(db, id, Run::Main, &record.points).await?;
                track::revise(db, id, Run::Main, &record.revised).await?;
                stands::upsert(&mut *db, id, &record.stands).await?;
                for visit in &record.automatic {
                    visits::insert(&mut *db, visit).await?;
                }
                for told in &record.visits {
                    visits::set_outcome(&mut *db, id, told).await?;
                }
                for found in &record.anomalies {
                    anomalies::insert(&mut *db, id, found).await?;
                }
                if let Some(summary) = &record.summary {
                    sessions::set_summary(&mut *db, id, summary).await?;
                }
                Ok(())
            })
        })
        .await
    }

    /// Does any other write: `work` runs inside a transaction of its own (a savepoint of the group's).
    /// An error of `work` takes back all that it wrote and is the answer; an answer of `Ok` means that
    /// it is on disk.
    pub async fn run<T, E, F>(&self, work: F) -> Result<T, E>
    where
        F: for<'c> FnOnce(&'c mut SqliteConnection) -> BoxFuture<'c, Result<T, E>> + Send + 'static,
        T: Send + 'static,
        E: From<StoreError> + Send + 'static,
    {
        self.submit(0, work).await
    }

    /// Whether the last group reached the disk.
    pub fn is_healthy(&self) -> bool {
        self.healthy.load(Ordering::Relaxed)
    }

    /// Writes what waits and ends; later writes are refused.
    pub(super) async fn stop(&self) {
        let (done, stopped) = oneshot::channel();
        if self.queue.send(Message::Stop(done)).await.is_ok() {
            let _ = stopped.await;
        }
    }

    async fn submit<T, E, F>(&self, bytes: usize, work: F) -> Result<T, E>
    where
        F: for<'c> FnOnce(&'c mut SqliteConnection) -> BoxFuture<'c, Result<T, E>> + Send + 'static,
        T: Send + 'static,
        E: From<StoreError> + Send + 'static,
    {
        let (caller, answer) = oneshot::channel();
        let work = Box::new(Task { work: Some(work), answer: None, caller });
        self.queue.send(Message::Write(Write { bytes, work })).await.map_err(|_| StoreError::Stopped)?;
        answer.await.unwrap_or_else(|_| Err(StoreError::Stopped.into()))
    }
}

/// The task: takes what waits, commits it together, answers, and so on until it is stopped.
async fn write_groups(
    options: SqliteConnectOptions,
    connection: SqliteConnection,
    mut messages: mpsc::Receiver<Message>,
    healthy: Arc<AtomicBool>,
) {
    let mut connection = Some(connection);
    let mut stop = None;
    // A stop closes the queue: what waits in it is still written, then `recv` says that it is empty.
    while let Some(first) = messages.recv().await {
        let mut group = Vec::new();
        let mut bytes = 0;
        let mut next = Some(first);
        // No waiting for more: the commit before this one took as long as the disk needs, and what
        // came meanwhile is here. So an idle server answers at once and a busy one in large groups.
        while let Some(message) = next.take() {
            match message {
                Message::Write(write) => {
                    bytes += write.bytes;
                    group.push(write);
                }
                Message::Stop(done) => {
                    stop = Some(done);
                    messages.close();
                }
            }
            if group.len() < GROUP_WRITES && bytes < GROUP_BYTES {
                next = messages.try_recv().ok();
            }
        }
        commit_group(&options, &mut connection, group, &healthy).await;
    }
    // Closing writes the log back into the database file.
    if let Some(connection) = connection
        && let Err(error) = connection.close().await
    {
        tracing::warn!(%error, "the writing connection did not close cleanly: {error}");
    }
    if let Some(done) = stop {
        let _ = done.send(());
    }
}

/// Commits one group and answers all of it.
async fn commit_group(
    options: &SqliteConnectOptions,
    connection: &mut Option<SqliteConnection>,
    mut group: Vec<Write>,
    healthy: &AtomicBool,
) {
    let begun = Instant::now();
    let committed = try_commit(options, connection, &mut group).await;
    metrics::histogram!("lodestep_commit_seconds").record(begun.elapsed().as_secs_f64());
    metrics::counter!("lodestep_writes_total").increment(group.len() as u64);
    healthy.store(committed.is_ok(), Ordering::Relaxed);
    let committed = committed.map_err(|error| {
        // After a failed sync nobody knows what the disk holds of it: the connection is given up and
        // the next group begins on a new one, which reads the log from the disk.
        *connection = None;
        tracing::error!(%error, writes = group.len(), "a group of {} writes did not reach the disk: {error}", group.len());
        error.to_string()
    });
    for write in group {
        write.work.resolve(committed.clone());
    }
}

async fn try_commit(
    options: &SqliteConnectOptions,
    slot: &mut Option<SqliteConnection>,
    group: &mut [Write],
) -> sqlx::Result<()> {
    if group.is_empty() {
        return Ok(());
    }
    let connection = match slot {
        Some(connection) => connection,
        None => slot.insert(options.connect().await?),
    };
    let mut transaction = connection.begin_with("begin immediate").await?;
    for write in group {
        let mut savepoint = transaction.begin().await?;
        if write.work.run(&mut savepoint).await {
            savepoint.commit().await?;
        } else {
            savepoint.rollback().await?;
        }
    }
    transaction.commit().await
}
