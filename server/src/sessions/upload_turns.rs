//! One writer at a time for each upload, and the newest comes first.
//!
//! A device whose link was cut comes back while the server still waits on the dead connection. The
//! new request ends the old one, which keeps what it received, and then has its turn.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use tokio::sync::OwnedMutexGuard;
use tokio_util::sync::CancellationToken;
use uuid::Uuid;

#[derive(Default)]
struct Upload {
    /// Held by the one that has the turn.
    turn: Arc<tokio::sync::Mutex<()>>,
    /// Ends the request that has the turn.
    displaced: CancellationToken,
    /// Requests that have the turn or wait for it.
    requests: usize,
}

/// Whose turn it is, for each upload that somebody works on.
#[derive(Clone, Default)]
pub struct UploadTurns {
    uploads: Arc<Mutex<HashMap<Uuid, Upload>>>,
}

/// The right to change one upload; given back when it is dropped.
pub(crate) struct Turn {
    log_id: Uuid,
    turns: UploadTurns,
    displaced: CancellationToken,
    _guard: Option<OwnedMutexGuard<()>>,
}

impl UploadTurns {
    /// Asks the one that has the turn to end, and waits for it.
    pub(crate) async fn take(&self, log_id: Uuid) -> Turn {
        let displaced = CancellationToken::new();
        let turn = {
            let mut uploads = self.uploads.lock().expect("nothing panics while it holds the turns");
            let upload = uploads.entry(log_id).or_default();
            upload.displaced.cancel();
            upload.displaced = displaced.clone();
            upload.requests += 1;
            upload.turn.clone()
        };
        // Made before the wait, so that a request that is given up while it waits is counted out.
        let mut taken = Turn { log_id, turns: self.clone(), displaced, _guard: None };
        taken._guard = Some(turn.lock_owned().await);
        taken
    }
}

impl Turn {
    /// Comes to pass when a newer request wants the turn.
    pub(crate) async fn displaced(&self) {
        self.displaced.cancelled().await;
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        let mut uploads = self.turns.uploads.lock().expect("nothing panics while it holds the turns");
        if let Some(upload) = uploads.get_mut(&self.log_id) {
            upload.requests -= 1;
            if upload.requests == 0 {
                uploads.remove(&self.log_id);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_newer_request_displaces_the_older_and_waits_for_it() {
        let turns = UploadTurns::default();
        let id = Uuid::now_v7();
        let old = turns.take(id).await;
        assert!(!old.displaced.is_cancelled());
        let newer = tokio::spawn({
            let turns = turns.clone();
            async move { turns.take(id).await }
        });
        old.displaced().await;
        assert!(!newer.is_finished());
        drop(old);
        let newer = newer.await.unwrap();
        assert!(!newer.displaced.is_cancelled());
        drop(newer);
        assert!(turns.uploads.lock().unwrap().is_empty());
    }

    #[tokio::test]
    async fn a_request_that_is_given_up_while_it_waits_is_forgotten() {
        let turns = UploadTurns::default();
        let id = Uuid::now_v7();
        let old = turns.take(id).await;
        let waiting = tokio::spawn({
            let turns = turns.clone();
            async move { turns.take(id).await }
        });
        old.displaced().await;
        waiting.abort();
        assert!(waiting.await.is_err());
        drop(old);
        assert!(turns.uploads.lock().unwrap().is_empty());
    }

    #[tokio::test]
    async fn different_uploads_do_not_meet() {
        let turns = UploadTurns::default();
        let a = turns.take(Uuid::now_v7()).await;
        let _b = turns.take(Uuid::now_v7()).await;
        assert!(!a.displaced.is_cancelled());
    }
}
