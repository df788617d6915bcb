//! The one writer: a task that owns the only writing connection. Whatever waits while a commit is on
//! its way to the disk is committed together by the next; each caller hears back after that.

use std::panic::AssertUnwindSafe;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{ConnectOptions, Connection, SqliteConnection};
use tokio::sync::{mpsc, oneshot};

use super::record::{self, PackedRecord, Record};
use super::{StoreError, migrations};

/// Writes that may wait; more make their senders wait.
const QUEUE: usize = 4_096;
/// Writes in one commit: bounds what a failed commit takes with it, and how long the first waits.
const GROUP_WRITES: usize = 2_048;
/// Bytes of samples in one commit.
const GROUP_BYTES: usize = 8 << 20;
/// After a commit the writer rests as long as it took, at most so long: of many small commits each would write the same
/// pages again. A commit that takes a few milliseconds makes nobody wait noticeably.
const LONGEST_REST: Duration = Duration::from_millis(50);

/// Writes to the store. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Writer {
    queue: mpsc::Sender<Message>,
    healthy: Arc<AtomicBool>,
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
    /// The record that it is, when it is one: those are written together.
    fn record(&self) -> Option<&PackedRecord> {
        None
    }
    /// Its record was written with others.
    fn was_written(&mut self) {}
    /// The group is on disk, or it is not: tells whoever waits.
    fn resolve(self: Box<Self>, committed: Result<(), String>);
}

/// A live session's record.
struct Recording {
    record: PackedRecord,
    answer: Option<Result<(), StoreError>>,
    caller: oneshot::Sender<Result<(), StoreError>>,
}

impl Work for Recording {
    fn run<'c>(&'c mut self, connection: &'c mut SqliteConnection) -> BoxFuture<'c, bool> {
        Box::pin(async move { self.answer.insert(record::write(connection, &[&self.record]).await).is_ok() })
    }

    fn record(&self) -> Option<&PackedRecord> {
        Some(&self.record)
    }

    fn was_written(&mut self) {
        self.answer = Some(Ok(()));
    }

    fn resolve(self: Box<Self>, committed: Result<(), String>) {
        resolve(self.answer, self.caller, committed);
    }
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
        resolve(self.answer, self.caller, committed);
    }
}

/// Tells whoever waits what became of the work, by its own answer and that of its group.
fn resolve<T, E: From<StoreError>>(
    own: Option<Result<T, E>>,
    caller: oneshot::Sender<Result<T, E>>,
    committed: Result<(), String>,
) {
    let answer = match (own, committed) {
        (Some(Ok(answer)), Ok(())) => Ok(answer),
        // What it was turned down for is its own, whatever became of the group.
        (Some(Err(error)), _) => Err(error),
        (Some(Ok(_)), Err(why)) => Err(StoreError::NotCommitted(why).into()),
        (None, Err(why)) => Err(StoreError::NotCommitted(why).into()),
        (None, Ok(())) => Err(StoreError::NotCommitted("it was passed over".into()).into()),
    };
    // Who no longer waits need not be told.
    let _ = caller.send(answer);
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
        let record = PackedRecord::new(record)?;
        let bytes = record.bytes();
        let (caller, answer) = oneshot::channel();
        let work = Box::new(Recording { record, answer: None, caller });
        self.queue.send(Message::Write(Write { bytes, work })).await.map_err(|_| StoreError::Stopped)?;
        answer.await.unwrap_or(Err(StoreError::Stopped))
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
    let mut rest_until = None;
    while let Some(first) = messages.recv().await {
        if let Some(until) = rest_until.take() {
            tokio::time::sleep_until(until).await;
        }
        let mut group = Vec::new();
        let mut bytes = 0;
        let mut next = Some(first);
        // What came while the commit before this one was on its way, and in the rest after it, is here. So an idle
        // server answers at once and a busy one in large groups.
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
        let begun = tokio::time::Instant::now();
        commit_group(&options, &mut connection, group, &healthy).await;
        rest_until = Some(begun + begun.elapsed() + begun.elapsed().min(LONGEST_REST));
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
    let mut rest = group;
    while let Some(first) = rest.first() {
        let together = rest.iter().take_while(|write| write.work.record().is_some()).count();
        let is_record = first.work.record().is_some();
        let (now, later) = rest.split_at_mut(if is_record { together } else { 1 });
        rest = later;
        if now.len() > 1 && write_together(&mut transaction, now).await? {
            continue;
        }
        for write in now {
            let mut savepoint = transaction.begin().await?;
            if write.work.run(&mut savepoint).await {
                savepoint.commit().await?;
            } else {
                savepoint.rollback().await?;
            }
        }
    }
    transaction.commit().await
}

/// Writes records in statements that they share; `false` when one of them was turned down, and none is written.
async fn write_together(transaction: &mut SqliteConnection, records: &mut [Write]) -> sqlx::Result<bool> {
    let mut savepoint = transaction.begin().await?;
    let packed: Vec<&PackedRecord> = records.iter().filter_map(|write| write.work.record()).collect();
    if record::write(&mut savepoint, &packed).await.is_err() {
        savepoint.rollback().await?;
        return Ok(false);
    }
    savepoint.commit().await?;
    for write in records {
        write.work.was_written();
    }
    Ok(true)
}
