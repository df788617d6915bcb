//! Checksums of what is stored: of a row's values in a fixed layout, so that a bit that has changed on the disk is found when
//! the row is read.
//!
//! CRC-32 (ISO 3309) finds every change of one bit, every burst of up to 32, and of others all but one in four billion.

use crc32fast::Hasher;
use sqlx::Row as _;

use super::StoreError;
use super::dialect::Row;

/// What a row is checked by. Each value goes in with its length or in a fixed number of bytes, so that no two rows look alike.
#[derive(Clone, Debug, Default)]
pub(super) struct Checksum(Hasher);

impl Checksum {
    /// Of this text next.
    pub(super) fn text(self, text: &str) -> Checksum {
        self.bytes(text.as_bytes())
    }

    /// Of these bytes next.
    pub(super) fn bytes(self, bytes: &[u8]) -> Checksum {
        let mut with_length = self.integer(bytes.len() as i64);
        with_length.0.update(bytes);
        with_length
    }

    /// Of this number next.
    pub(super) fn integer(mut self, value: i64) -> Checksum {
        self.0.update(&value.to_le_bytes());
        self
    }

    /// Of this number next; `None` differs from all of them.
    pub(super) fn real(mut self, value: Option<f64>) -> Checksum {
        // The database keeps a negative zero as zero.
        let word = value.map_or(u64::MAX, |value| (value + 0.0).to_bits());
        self.0.update(&word.to_le_bytes());
        self
    }

    /// As its column holds it.
    pub(super) fn column(self) -> i64 {
        i64::from(self.0.finalize())
    }

    /// Whether a row is as it was written; rows from before there were checksums are taken as they are. `what` names the row.
    pub(super) fn agrees(self, row: &Row, what: impl FnOnce() -> String) -> Result<(), StoreError> {
        let stored: Option<i64> = row.try_get("checksum")?;
        let found = self.column();
        match stored {
            Some(stored) if stored != found => Err(StoreError::Damaged {
                what: what(),
                why: format!(
                    "expected the checksum {stored:08x}, found {found:08x}: the disk has changed it; everything else can be read. Bring it back from a backup"
                ),
            }),
            _ => Ok(()),
        }
    }
}
