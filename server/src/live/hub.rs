//! Where changes are told once they are on disk, and where the feed hears of them.

use tokio::sync::broadcast;

use crate::wire::Change;

/// How many changes wait for a slow listener before it is told that it missed some.
const CAPACITY: usize = 4_096;

/// Tells changes to whoever listens.
#[derive(Clone, Debug)]
pub struct Hub {
    changes: broadcast::Sender<Change>,
}

impl Default for Hub {
    fn default() -> Self {
        Hub { changes: broadcast::Sender::new(CAPACITY) }
    }
}

impl Hub {
    /// Tells a change. Call it after the change is on disk.
    pub fn publish(&self, change: Change) {
        // An error says that nobody listens, which is fine.
        let _ = self.changes.send(change);
    }

    /// Hears every change from now on.
    pub fn subscribe(&self) -> broadcast::Receiver<Change> {
        self.changes.subscribe()
    }
}
