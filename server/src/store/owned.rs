//! Whose the database is: a file is this server's for as long as it holds the data folder (`data_folder::hold`).

use sqlx::SqliteConnection;

use super::StoreError;
use super::write::Refusal;

/// Says that it is ours.
#[derive(Clone, Debug)]
pub(super) struct Owned;

impl Owned {
    /// Before it is said.
    pub(super) fn not_yet() -> Owned {
        Owned
    }

    /// It is already.
    pub(super) async fn take_over(self, _db: &mut SqliteConnection) -> Result<(), StoreError> {
        Ok(())
    }

    /// It stays so.
    pub(super) async fn expect(&self, _db: &mut SqliteConnection) -> Result<(), Refusal> {
        Ok(())
    }
}
