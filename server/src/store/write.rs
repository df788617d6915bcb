//! A write that waits for the writer, with the one who waits for it.

use std::panic::AssertUnwindSafe;

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use tokio::sync::oneshot;

use super::StoreError;
use super::dialect::Connection;
use super::health::Disk;
use super::record::{self, PackedRecord};

/// An error that a write may end with.
pub trait WriteError: From<StoreError> + Send + 'static {
    /// What it says about the disk: then the whole group is given up, not this write alone.
    fn disk(&self) -> Option<Disk>;
}

impl WriteError for StoreError {
    fn disk(&self) -> Option<Disk> {
        self.disk()
    }
}

/// Why a group was not stored.
#[derive(Clone, Debug)]
pub(super) enum Refusal {
    /// For a reason of its own.
    NotCommitted(String),
    /// Because of the disk.
    Disk(Disk, String),
}

impl From<sqlx::Error> for Refusal {
    fn from(error: sqlx::Error) -> Self {
        match Disk::of(&error) {
            Some(disk) => Refusal::Disk(disk, error.to_string()),
            None => Refusal::NotCommitted(error.to_string()),
        }
    }
}

impl From<Refusal> for StoreError {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::NotCommitted(why) => StoreError::NotCommitted(why),
            Refusal::Disk(Disk::Full, _) => StoreError::DiskFull,
            Refusal::Disk(Disk::Failing, why) => StoreError::DiskFailed(why),
        }
    }
}

/// What a write came to inside its group's transaction.
pub(super) enum Ran {
    /// It may be committed.
    Done,
    /// Its own part is to be taken back.
    TakeBack,
    /// The disk did not do its part: nothing of the group can be committed.
    Stopped(Refusal),
}

/// A write that waits for its turn.
pub(super) trait Work: Send {
    /// Does it inside the group's transaction.
    fn run<'c>(&'c mut self, connection: &'c mut Connection) -> BoxFuture<'c, Ran>;
    /// What it is called in the log: where it is asked for.
    fn name(&self) -> &'static str;
    /// The record that it is, when it is one: those are written together.
    fn record(&self) -> Option<&PackedRecord> {
        None
    }
    /// Its record was written with others.
    fn was_written(&mut self) {}
    /// The group is on disk, or it is not: tells the one that waits.
    fn resolve(self: Box<Self>, committed: Result<(), Refusal>);
}

/// A live session's record.
pub(super) struct Recording {
    record: PackedRecord,
    answer: Option<Result<(), StoreError>>,
    caller: oneshot::Sender<Result<(), StoreError>>,
}

impl Recording {
    /// A record, and where its answer goes.
    pub(super) fn new(record: PackedRecord, caller: oneshot::Sender<Result<(), StoreError>>) -> Recording {
        Recording { record, answer: None, caller }
    }
}

impl Work for Recording {
    fn run<'c>(&'c mut self, connection: &'c mut Connection) -> BoxFuture<'c, Ran> {
        Box::pin(async move { ran(self.answer.insert(record::write(connection, &[&self.record]).await)) })
    }

    fn name(&self) -> &'static str {
        "a live record"
    }

    fn record(&self) -> Option<&PackedRecord> {
        Some(&self.record)
    }

    fn was_written(&mut self) {
        self.answer = Some(Ok(()));
    }

    fn resolve(self: Box<Self>, committed: Result<(), Refusal>) {
        resolve(self.answer, self.caller, committed);
    }
}

/// Work of a certain answer.
pub(super) struct Task<F, T, E> {
    work: Option<F>,
    answer: Option<Result<T, E>>,
    caller: oneshot::Sender<Result<T, E>>,
}

impl<F, T, E> Task<F, T, E> {
    /// Work, and where its answer goes.
    pub(super) fn new(work: F, caller: oneshot::Sender<Result<T, E>>) -> Task<F, T, E> {
        Task { work: Some(work), answer: None, caller }
    }
}

impl<F, T, E> Work for Task<F, T, E>
where
    F: for<'c> FnOnce(&'c mut Connection) -> BoxFuture<'c, Result<T, E>> + Send,
    T: Send,
    E: WriteError,
{
    fn run<'c>(&'c mut self, connection: &'c mut Connection) -> BoxFuture<'c, Ran> {
        Box::pin(async move {
            let Some(work) = self.work.take() else { return Ran::TakeBack };
            let answer = AssertUnwindSafe(async { work(connection).await }).catch_unwind().await;
            let answer = answer
                .unwrap_or_else(|_| Err(not_committed("the write itself panicked; nothing of it is stored")));
            ran(self.answer.insert(answer))
        })
    }

    fn name(&self) -> &'static str {
        std::any::type_name::<F>()
    }

    fn resolve(self: Box<Self>, committed: Result<(), Refusal>) {
        resolve(self.answer, self.caller, committed);
    }
}

/// What a write's own answer means for its group.
fn ran<T, E: WriteError>(answer: &Result<T, E>) -> Ran {
    match answer {
        Ok(_) => Ran::Done,
        Err(error) => match error.disk() {
            Some(disk) => Ran::Stopped(Refusal::Disk(disk, "the database could not write".to_owned())),
            None => Ran::TakeBack,
        },
    }
}

/// Tells the one that waits what became of the work, by its own answer and that of its group.
fn resolve<T, E: WriteError>(
    own: Option<Result<T, E>>,
    caller: oneshot::Sender<Result<T, E>>,
    committed: Result<(), Refusal>,
) {
    let answer = match (own, committed) {
        (Some(Ok(answer)), Ok(())) => Ok(answer),
        // What it was turned down for is its own, whatever became of the group.
        (Some(Err(error)), _) => Err(error),
        (Some(Ok(_)) | None, Err(refusal)) => Err(StoreError::from(refusal).into()),
        (None, Ok(())) => Err(not_committed("it was passed over")),
    };
    // Who no longer waits need not be told.
    let _ = caller.send(answer);
}

fn not_committed<E: From<StoreError>>(why: &str) -> E {
    StoreError::NotCommitted(why.to_owned()).into()
}
