//! The one writer: a task that owns the only writing connection. Whatever waits while a commit is on
//! its way to the disk is committed together by the next; each caller hears back after that.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use sqlx::{ConnectOptions as _, Connection as _};
use tokio::sync::{mpsc, oneshot, watch};
use tokio::task::{JoinError, JoinHandle};

use super::dialect::{BEGIN, ConnectOptions, Connection};
use super::health::{Disk, Health};
use super::owned::Owned;
use super::record::{self, PackedRecord, Record};
use super::waiting::Waiting;
use super::write::{Ran, Recording, Refusal, Task, Work, WriteError};
use super::{StoreError, migrations, write_ahead};

/// What one write may take while all others wait; what may take longer is cut into several.
const PIECE_BUDGET: Duration = Duration::from_millis(250);
/// Writes that may wait; more make their senders wait.
const QUEUE: usize = 4_096;
/// Writes in one commit: bounds what a failed commit takes with it, and how long the first waits.
const GROUP_WRITES: usize = 2_048;
/// From so many writes in one commit on there is a crowd.
const CROWDED_WRITES: usize = 64;
/// Bytes of samples in one commit.
const GROUP_BYTES: usize = 8 << 20;
/// After a commit the writer rests as long as it took, at most so long: of many small commits each would write the same
/// pages again. A commit that takes a few milliseconds makes nobody wait noticeably.
const LONGEST_REST: Duration = Duration::from_millis(50);
/// A commit begins at least so long after the one before, for each write of that: in a crowd each costs a row a stream and an
/// acknowledgement for every session, whether that has sent one frame or two. 220 µs would save a tenth of the processor, and
/// make acknowledgements a hundred milliseconds later (docs/load.md).
const ROUND_PER_WRITE: Duration = Duration::from_micros(170);
/// How often the log is copied into the database file while writes come. Pages that are changed again and again, as those
/// at the end of each walk, are copied once for many commits.
const COPY_EVERY: Duration = Duration::from_secs(3);
/// How long a commit may take before the connection is given up; on a file there is nobody who does not answer.
const LONGEST_COMMIT: Option<Duration> =
    if cfg!(feature = "cluster") { Some(Duration::from_secs(10)) } else { None };
/// How often room is looked for on a full disk.
const PROBE_EVERY: Duration = Duration::from_secs(2);

/// Writes to the store. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Writer {
    queue: mpsc::Sender<Message>,
    health: watch::Receiver<Health>,
    crowded: Arc<AtomicBool>,
    waiting: Waiting,
    owned: Owned,
}

enum Message {
    Write(Write),
    Stop(oneshot::Sender<()>),
}

pub(super) struct Write {
    bytes: usize,
    work: Box<dyn Work>,
}

impl Write {
    /// Work of so many bytes, and where its answer goes.
    pub(super) fn new<T, E, F>(bytes: usize, work: F, caller: oneshot::Sender<Result<T, E>>) -> Write
    where
        F: for<'c> FnOnce(&'c mut Connection) -> BoxFuture<'c, Result<T, E>> + Send + 'static,
        T: Send + 'static,
        E: WriteError,
    {
        Write { bytes, work: Box::new(Task::new(work, caller)) }
    }
}

impl Writer {
    /// Opens the writing connection, brings the database up to date and starts the task.
    pub(super) async fn start(options: ConnectOptions) -> Result<Writer, StoreError> {
        let mut connection = options.connect().await?;
        if let Err(error) = write_ahead::settle(&mut connection).await {
            if error.disk() == Some(Disk::Failing) {
                // Closing it would ask the disk once more.
                std::mem::forget(connection);
            }
            return Err(error);
        }
        migrations::run(&mut connection).await?;
        if let Err(error) = write_ahead::touch(&mut connection).await
            && error.disk() == Some(Disk::Failing)
        {
            return Err(StoreError::Open(format!(
                "expected a database that can be written, found one that takes no write ({error}): see who owns its file and folder, and whether the disk is mounted read-only"
            )));
        }
        let (queue, messages) = mpsc::channel(QUEUE);
        let (told, health) = watch::channel(Health::Good);
        let crowded = Arc::new(AtomicBool::new(false));
        let owned = Owned::not_yet();
        let groups = Groups {
            owned: owned.clone(),
            options,
            connection: Some(connection),
            told,
            crowded: Arc::clone(&crowded),
            copying: None,
            copied_at: Instant::now(),
        };
        tokio::spawn(groups.run(messages));
        Ok(Writer { queue, health, crowded, waiting: Waiting::default(), owned })
    }

    /// Makes the database this server's own: whoever had it before is refused from now on.
    pub(super) async fn take_over(&self) -> Result<(), StoreError> {
        let owned = self.owned.clone();
        self.run(move |db| async move { owned.take_over(db).await }.boxed()).await
    }

    /// Puts a live session's findings on disk.
    pub async fn record(&self, record: Record) -> Result<(), StoreError> {
        let _waits = self.waiting.begin();
        let record = PackedRecord::new(record)?;
        let bytes = record.bytes();
        let (caller, answer) = oneshot::channel();
        let work = Box::new(Recording::new(record, caller));
        self.queue.send(Message::Write(Write { bytes, work })).await.map_err(|_| self.closed())?;
        answer.await.unwrap_or_else(|_| Err(self.closed()))
    }

    /// Does any other write: `work` runs inside a transaction of its own (a savepoint of the group's).
    /// An error of `work` takes back all that it wrote and is the answer; an answer of `Ok` means that
    /// it is on disk.
    pub async fn run<T, E, F>(&self, work: F) -> Result<T, E>
    where
        F: for<'c> FnOnce(&'c mut Connection) -> BoxFuture<'c, Result<T, E>> + Send + 'static,
        T: Send + 'static,
        E: WriteError,
    {
        self.submit(0, work).await
    }

    /// Whether so many write at once that what can wait should: the last commit held the writes of many.
    pub(crate) fn is_crowded(&self) -> bool {
        self.crowded.load(Ordering::Relaxed)
    }

    /// How long the live record has waited that has waited longest.
    pub(super) fn longest_live_wait(&self) -> Duration {
        self.waiting.longest()
    }

    /// How the last write went.
    pub fn health(&self) -> Health {
        *self.health.borrow()
    }

    /// How writing goes, as it changes.
    #[cfg(test)]
    #[cfg(not(feature = "cluster"))]
    pub(super) fn watch(&self) -> watch::Receiver<Health> {
        self.health.clone()
    }

    /// Ready when the disk has failed; never otherwise.
    pub(super) async fn disk_failed(&self) {
        let mut health = self.health.clone();
        if health.wait_for(|health| *health == Health::DiskFailed).await.is_err() {
            // The writer has stopped in good order.
            std::future::pending::<()>().await;
        }
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
        F: for<'c> FnOnce(&'c mut Connection) -> BoxFuture<'c, Result<T, E>> + Send + 'static,
        T: Send + 'static,
        E: WriteError,
    {
        let (caller, answer) = oneshot::channel();
        let write = Write::new(bytes, work, caller);
        let sent = self.queue.send(Message::Write(write)).await;
        sent.map_err(|_| self.closed())?;
        answer.await.unwrap_or_else(|_| Err(self.closed().into()))
    }

    /// Why nothing is taken any more.
    fn closed(&self) -> StoreError {
        match self.health() {
            Health::DiskFailed => StoreError::DiskFailed("the writer has given up".to_owned()),
            _ => StoreError::Stopped,
        }
    }
}

/// The task: takes what waits, commits it together, answers, and so on until it is stopped.
struct Groups {
    owned: Owned,
    options: ConnectOptions,
    connection: Option<Connection>,
    told: watch::Sender<Health>,
    crowded: Arc<AtomicBool>,
    /// The log on its way into the database file, beside the commits.
    copying: Option<JoinHandle<Result<(), sqlx::Error>>>,
    /// When it was there last.
    copied_at: Instant,
}

impl Groups {
    async fn run(mut self, mut messages: mpsc::Receiver<Message>) {
        let (mut stop, mut rest_until) = (None, None);
        // A stop closes the queue: what waits in it is still written, then `recv` says that it is empty.
        while let Some(first) = self.next(&mut messages).await {
            if let Some(until) = rest_until.take() {
                tokio::time::sleep_until(until).await;
            }
            let mut group = Vec::new();
            let mut bytes = 0;
            let mut next = Some(first);
            // What came while the commit before this one was on its way, and in the rest after it, is here. So an
            // idle server answers at once and a busy one in large groups.
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
            let round = ROUND_PER_WRITE * group.len() as u32;
            self.commit(group).await;
            let taken = begun.elapsed();
            let rest =
                if round > LONGEST_REST { round.saturating_sub(taken) } else { taken.min(LONGEST_REST) };
            rest_until = Some(begun + taken + rest);
            if *self.told.borrow() == Health::DiskFailed {
                messages.close();
            }
        }
        if let Some(copying) = self.copying.take() {
            self.on_copied(copying.await).await;
        }
        // Closing writes the log back into the database file.
        if let Some(connection) = self.connection
            && let Err(error) = connection.close().await
        {
            tracing::warn!(%error, "the writing connection did not close cleanly: {error}");
        }
        if let Some(done) = stop {
            let _ = done.send(());
        }
    }

    /// What comes next. While the disk is full, a write of the task's own finds out when there is room.
    async fn next(&mut self, messages: &mut mpsc::Receiver<Message>) -> Option<Message> {
        while *self.told.borrow() == Health::DiskFull {
            match tokio::time::timeout(PROBE_EVERY, messages.recv()).await {
                Ok(message) => return message,
                Err(_) => self.commit(vec![write_ahead::probe()]).await,
            }
        }
        messages.recv().await
    }

    /// Commits one group and answers all of it.
    async fn commit(&mut self, mut group: Vec<Write>) {
        let begun = Instant::now();
        let has_failed = *self.told.borrow() == Health::DiskFailed;
        let committed = if has_failed {
            // It came before the queue was closed.
            Err(Refusal::Disk(Disk::Failing, "the disk had failed before".to_owned()))
        } else {
            self.commit_in_time(&mut group).await
        };
        metrics::histogram!("lodestep_commit_seconds").record(begun.elapsed().as_secs_f64());
        metrics::counter!("lodestep_writes_total").increment(group.len() as u64);
        self.crowded.store(group.len() >= CROWDED_WRITES, Ordering::Relaxed);
        if let Err(refusal) = &committed {
            metrics::counter!("lodestep_write_failures_total").increment(group.len() as u64);
            self.give_up(refusal, group.len()).await;
        } else {
            self.tell(Health::Good);
        }
        for write in group {
            write.work.resolve(committed.clone());
        }
        if let Some(copying) = self.copying.take_if(|copying| copying.is_finished()) {
            self.on_copied(copying.await).await;
        }
        if committed.is_ok() && self.copying.is_none() && self.copied_at.elapsed() >= COPY_EVERY {
            self.copying = Some(tokio::spawn(write_ahead::copy_aside(self.options.clone())));
        }
    }

    /// The same, where nothing answers for as long as a commit never takes, as a database that was cut off: then the connection is
    /// let go of. Whether the group was stored is unknown, and told as not stored; a stream is read again from the database.
    async fn commit_in_time(&mut self, group: &mut [Write]) -> Result<(), Refusal> {
        let Some(longest) = LONGEST_COMMIT else { return self.try_commit(group).await };
        match tokio::time::timeout(longest, self.try_commit(group)).await {
            Ok(committed) => committed,
            Err(_) => Err(Refusal::NotCommitted(format!(
                "expected the database to answer within {} s, found that it does not: whether the group is stored is not known",
                longest.as_secs()
            ))),
        }
    }

    async fn try_commit(&mut self, group: &mut [Write]) -> Result<(), Refusal> {
        if group.is_empty() {
            return Ok(());
        }
        let connection = match &mut self.connection {
            Some(connection) => connection,
            slot => slot.insert(self.options.connect().await?),
        };
        let mut transaction = connection.begin_with(BEGIN).await?;
        self.owned.expect(&mut transaction).await?;
        if group.len() > 1 && group.iter().all(|write| write.work.record().is_some()) {
            // With nothing beside them that would have to stay, no copy is kept of each page as it was.
            if write_records(&mut transaction, group).await? {
                transaction.commit().await?;
                return Ok(());
            }
            transaction.rollback().await?;
            transaction = connection.begin_with(BEGIN).await?;
            self.owned.expect(&mut transaction).await?;
        }
        let mut rest = group;
        while let Some(first) = rest.first() {
            let together = rest.iter().take_while(|write| write.work.record().is_some()).count();
            let is_record = first.work.record().is_some();
            let (now, later) = rest.split_at_mut(if is_record { together } else { 1 });
            rest = later;
            if now.len() > 1 && write_together(&mut transaction, now).await? {
                continue;
            }
            if !is_record {
                write_ahead::be_the_only_one(&mut transaction).await?;
            }
            for write in now {
                let mut savepoint = transaction.begin().await?;
                let begun = Instant::now();
                let ran = write.work.run(&mut savepoint).await;
                look_at(write.work.name(), begun.elapsed());
                match ran {
                    Ran::Done => savepoint.commit().await?,
                    Ran::TakeBack => savepoint.rollback().await?,
                    Ran::Stopped(refusal) => return Err(refusal),
                }
            }
        }
        transaction.commit().await?;
        Ok(())
    }

    /// A group was not stored: lets go of the connection, for nobody knows in which state it is.
    async fn give_up(&mut self, refusal: &Refusal, writes: usize) {
        let before = *self.told.borrow();
        let Some(connection) = self.connection.take() else { return self.tell_of(refusal) };
        match refusal {
            Refusal::Disk(Disk::Failing, why) => {
                // After a failed sync nobody knows what the disk holds: it is not asked again, not even by the
                // connection's own end. The next start reads the log and brings it to disk anew.
                std::mem::forget(connection);
                if before != Health::DiskFailed {
                    tracing::error!(
                        writes,
                        "the disk failed under a group of {writes} writes ({why}): nothing is acknowledged any more, and the server ends to start again from the log"
                    );
                }
            }
            Refusal::Disk(Disk::Full, _) | Refusal::NotCommitted(_) => {
                // The next one first: with the last connection the log's index would go, and on a full disk
                // there might be no room for another.
                self.connection = self.options.connect().await.ok();
                drop(connection);
                match refusal {
                    Refusal::NotCommitted(why) => {
                        tracing::error!(writes, "a group of {writes} writes was not stored: {why}");
                    }
                    Refusal::Disk(..) if before != Health::DiskFull => {
                        tracing::error!(
                            writes,
                            "the disk is full: a group of {writes} writes was refused, and so is everything until there is room"
                        );
                    }
                    Refusal::Disk(..) => {}
                }
            }
        }
        self.tell_of(refusal);
    }

    fn tell_of(&self, refusal: &Refusal) {
        self.tell(match refusal {
            Refusal::NotCommitted(_) => Health::NotStored,
            Refusal::Disk(Disk::Full, _) => Health::DiskFull,
            Refusal::Disk(Disk::Failing, _) => Health::DiskFailed,
        });
    }

    fn tell(&self, health: Health) {
        let before = self.told.send_replace(health);
        if before == Health::DiskFull && health == Health::Good {
            tracing::info!("there is room on the disk again");
        }
    }

    /// The log has been copied but for what came meanwhile: copies that, so that the log can begin anew.
    async fn on_copied(&mut self, aside: Result<Result<(), sqlx::Error>, JoinError>) {
        self.copied_at = Instant::now();
        let Some(connection) = &mut self.connection else { return };
        let copied = match aside {
            Ok(Ok(())) => write_ahead::copy(connection).await,
            Ok(Err(error)) => Err(error),
            Err(error) => return tracing::error!(%error, "copying the log did not come to its end: {error}"),
        };
        if let Err(error) = copied {
            match Disk::of(&error) {
                // It stays in the log, where it is as safe.
                Some(Disk::Full) | None => tracing::warn!(%error, "the log could not be copied: {error}"),
                Some(Disk::Failing) => self.give_up(&error.into(), 0).await,
            }
        }
    }
}

/// Keeps how long a write took of the time of all; one that took too long is to be cut into pieces.
fn look_at(name: &'static str, taken: Duration) {
    metrics::histogram!("lodestep_write_piece_seconds").record(taken.as_secs_f64());
    if taken > PIECE_BUDGET {
        metrics::counter!("lodestep_write_pieces_over_budget_total").increment(1);
        tracing::warn!(
            write = name,
            "a write took {:.2} s of the one writer, and everybody else waited: expected at most {:.2} s (the disk may be busy)",
            taken.as_secs_f64(),
            PIECE_BUDGET.as_secs_f64()
        );
    }
}

/// Writes records in statements that they share, and none of them when one is turned down: then `false`.
async fn write_together(transaction: &mut Connection, records: &mut [Write]) -> Result<bool, Refusal> {
    let mut savepoint = transaction.begin().await?;
    if write_records(&mut savepoint, records).await? {
        savepoint.commit().await?;
        Ok(true)
    } else {
        savepoint.rollback().await?;
        Ok(false)
    }
}

/// The same, but when one is turned down the caller takes back what was written of the others.
async fn write_records(db: &mut Connection, records: &mut [Write]) -> Result<bool, Refusal> {
    let packed: Vec<&PackedRecord> = records.iter().filter_map(|write| write.work.record()).collect();
    match record::write(db, &packed).await {
        Ok(()) => {
            for write in records {
                write.work.was_written();
            }
            Ok(true)
        }
        Err(error) => match error.disk() {
            Some(disk) => Err(Refusal::Disk(disk, error.to_string())),
            None => Ok(false),
        },
    }
}
