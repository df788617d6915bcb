//! Where the poses of live sessions are told to all listeners the moment that they are known.
//!
//! They do not wait for the disk, as everything else that is told does: a control loop cannot, and what it is told is never a
//! record.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use lodestep_engine::system::Pose;
use tokio::sync::broadcast;
use tokio::time::Instant;
use uuid::Uuid;

/// Poses that may wait for a listener; one that is slower misses some.
const MOST_WAITING: usize = 64;

/// A pose, and when its sample came.
#[derive(Clone, Debug)]
pub(crate) struct ToldPose {
    pub(crate) pose: Pose,
    pub(crate) came_at: Instant,
    /// What corrects it, by name, in the order of its bits.
    pub(crate) aids: Arc<[String]>,
}

/// The sessions that somebody listens to.
#[derive(Debug, Default)]
pub(crate) struct PoseHub {
    listened: Mutex<HashMap<Uuid, broadcast::Sender<ToldPose>>>,
}

impl PoseHub {
    /// Listens to a session, from now on.
    pub(crate) fn listen(&self, session_id: Uuid) -> broadcast::Receiver<ToldPose> {
        let mut listened = self.lock();
        // Those that nobody listens to any more go when the next one comes.
        listened.retain(|_, told| told.receiver_count() > 0);
        listened.entry(session_id).or_insert_with(|| broadcast::channel(MOST_WAITING).0).subscribe()
    }

    /// Where a session's poses are told; `None` while nobody listens.
    pub(crate) fn listeners(&self, session_id: Uuid) -> Option<broadcast::Sender<ToldPose>> {
        self.lock().get(&session_id).filter(|told| told.receiver_count() > 0).cloned()
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, HashMap<Uuid, broadcast::Sender<ToldPose>>> {
        self.listened.lock().expect("nothing panics while it holds the list")
    }
}
