//! What the server has said is on disk, and every time it did not keep its word.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Mutex, MutexGuard};

use lodestep_engine::systems::pedestrian::Side;
use uuid::Uuid;

/// What was promised, to be held against what is there.
#[derive(Debug, Default)]
pub struct Promises {
    told: Mutex<Told>,
}

/// All that the clients were told.
#[derive(Clone, Debug, Default)]
pub struct Told {
    /// Of each streamed session, how many batches of each foot are on disk.
    pub batches: BTreeMap<Uuid, [u64; 2]>,
    /// Of each upload, how many bytes are on disk.
    pub upload_bytes: BTreeMap<Uuid, u64>,
    /// Uploads whose samples are stored.
    pub accepted: BTreeSet<Uuid>,
    /// Places that the moved marker has been put to, in order, by their number.
    pub moves: Vec<u64>,
    /// Faults that were reported.
    pub faults: BTreeSet<Uuid>,
    /// Times that the server refused for lack of room, or because the disk failed.
    pub refusals: u64,
    /// Links that were made again.
    pub links: u64,
    /// What was not as promised, in sentences.
    pub broken: Vec<String>,
}

impl Promises {
    /// Everything so far.
    pub fn told(&self) -> Told {
        self.lock().clone()
    }

    /// A device was told, by an acknowledgement or a welcome, that so many batches of this foot are on disk. A
    /// welcome that takes something back breaks a promise.
    pub fn batches(&self, session: Uuid, foot: Side, batches: u64, is_welcome: bool) {
        let mut told = self.lock();
        let known = &mut told.batches.entry(session).or_default()[foot.index()];
        let before = *known;
        *known = before.max(batches);
        if is_welcome && batches < before {
            told.broken.push(format!(
                "session {session}, {} foot: {before} batches had been acknowledged, the server asks for batch {batches}",
                foot.name()
            ));
        }
    }

    /// A sender was told that so many bytes of its upload are on disk.
    pub fn upload(&self, log: Uuid, bytes: u64) {
        let mut told = self.lock();
        let known = told.upload_bytes.entry(log).or_default();
        let before = *known;
        *known = before.max(bytes);
        if bytes < before {
            told.broken.push(format!("upload {log}: {before} bytes had been acknowledged, now {bytes} are"));
        }
    }

    /// A sender was told that its log is stored.
    pub fn accepted(&self, log: Uuid) {
        self.lock().accepted.insert(log);
    }

    /// Somebody was told that the marker stands at its place of this number.
    pub fn moved(&self, number: u64) {
        self.lock().moves.push(number);
    }

    /// Somebody was told that a fault is stored.
    pub fn fault(&self, id: Uuid) {
        self.lock().faults.insert(id);
    }

    /// The server refused for lack of room, or because the disk failed.
    pub fn refused(&self) {
        self.lock().refusals += 1;
    }

    /// A link was made again.
    pub fn linked(&self) {
        self.lock().links += 1;
    }

    /// Something is not as promised.
    pub fn broken(&self, sentence: String) {
        self.lock().broken.push(sentence);
    }

    fn lock(&self) -> MutexGuard<'_, Told> {
        self.told.lock().expect("nothing panics while it holds the promises")
    }
}
