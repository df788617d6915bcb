//! Where live walks put the samples of their past: one file for all of them, which nobody else sees.
//!
//! It holds what a session needs when a visit makes it look back, minutes of samples for each of a thousand
//! inspectors. Nothing in it is the truth: that is in the store, and the file is gone when the server is.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom, Write as _};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use lodestep_engine::replay::InputStore;

/// What a session puts away at once fits into this.
const SLOT_BYTES: usize = 16 << 10;

/// The file, in slots of one size. Cheap to clone.
#[derive(Clone, Debug)]
pub(crate) struct InputFile(Arc<Mutex<Slots>>);

#[derive(Debug)]
struct Slots {
    file: File,
    free: Vec<u64>,
    /// How many there are, free ones among them.
    count: u64,
}

impl InputFile {
    /// A file without a name in a folder.
    pub(crate) fn new_in(folder: &Path) -> std::io::Result<InputFile> {
        let file = tempfile::tempfile_in(folder)?;
        Ok(InputFile(Arc::new(Mutex::new(Slots { file, free: Vec::new(), count: 0 }))))
    }

    /// The room of one session, given back when it ends.
    pub(crate) fn of_session(&self) -> SessionInputs {
        SessionInputs { shared: self.clone(), kept: BTreeMap::new() }
    }

    fn put(&self, bytes: &[u8]) -> Option<Kept> {
        if bytes.len() > SLOT_BYTES {
            return None;
        }
        let mut slots = self.lock();
        let slot = slots.free.pop().unwrap_or(slots.count);
        slots.count = slots.count.max(slot + 1);
        let at = SeekFrom::Start(slot * SLOT_BYTES as u64);
        let written = slots.file.seek(at).and_then(|_| slots.file.write_all(bytes));
        match written {
            Ok(()) => Some(Kept { slot, bytes: bytes.len() }),
            Err(error) => {
                // The disk is full, or ill: the writer will say so, too. The session keeps it in memory.
                tracing::debug!(%error, "the past of a walk could not be put away: {error}");
                slots.free.push(slot);
                None
            }
        }
    }

    fn get(&self, kept: Kept) -> Option<Vec<u8>> {
        let mut bytes = vec![0; kept.bytes];
        let mut slots = self.lock();
        slots.file.seek(SeekFrom::Start(kept.slot * SLOT_BYTES as u64)).ok()?;
        slots.file.read_exact(&mut bytes).ok()?;
        Some(bytes)
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Slots> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[derive(Clone, Copy, Debug)]
struct Kept {
    slot: u64,
    bytes: usize,
}

/// What one session has put away.
#[derive(Debug)]
pub(crate) struct SessionInputs {
    shared: InputFile,
    kept: BTreeMap<u64, Kept>,
}

impl InputStore for SessionInputs {
    fn put(&mut self, number: u64, bytes: &[u8]) -> bool {
        let Some(kept) = self.shared.put(bytes) else { return false };
        if let Some(before) = self.kept.insert(number, kept) {
            self.shared.lock().free.push(before.slot);
        }
        true
    }

    fn get(&mut self, number: u64) -> Option<Vec<u8>> {
        self.shared.get(*self.kept.get(&number)?)
    }

    fn forget_before(&mut self, number: u64) {
        if self.kept.first_key_value().is_none_or(|(first, _)| *first >= number) {
            return;
        }
        let needed = self.kept.split_off(&number);
        let gone = std::mem::replace(&mut self.kept, needed);
        self.shared.lock().free.extend(gone.values().map(|kept| kept.slot));
    }
}

impl Drop for SessionInputs {
    fn drop(&mut self) {
        self.forget_before(u64::MAX);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_session_gets_back_its_own_and_room_is_used_again() {
        let folder = tempfile::TempDir::new().unwrap();
        let shared = InputFile::new_in(folder.path()).unwrap();
        let (mut one, mut other) = (shared.of_session(), shared.of_session());
        for number in 0..10 {
            assert!(one.put(number, &[number as u8; 100]));
            assert!(other.put(number, &[100 + number as u8; 200]));
        }
        assert_eq!(one.get(3), Some(vec![3; 100]));
        assert_eq!(other.get(3), Some(vec![103; 200]));
        one.forget_before(5);
        assert_eq!(one.get(4), None);
        for number in 10..15 {
            assert!(other.put(number, &[number as u8; 300]));
        }
        assert_eq!(shared.lock().count, 20, "the five that were given back were taken");
        assert_eq!(one.get(5), Some(vec![5; 100]));
        drop(one);
        assert_eq!(shared.lock().free.len(), 5);
        assert!(!other.put(99, &[0; SLOT_BYTES + 1]), "it does not fit");
    }
}
