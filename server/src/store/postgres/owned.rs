//! Whose the database is. Servers count up as they take it over, and each group of writes looks whether the count is still its
//! server's own: one that was frozen, or cut off from those who took its place, writes nothing any more. No clock takes part.

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

use super::StoreError;
use super::dialect::Connection;
use super::write::Refusal;

/// This server's count; 0 before it has taken the database over, as of who only looks or makes an account.
#[derive(Clone, Debug)]
pub(super) struct Owned(Arc<AtomicI64>);

impl Owned {
    /// Before the database is taken over.
    pub(super) fn not_yet() -> Owned {
        Owned(Arc::default())
    }

    /// Makes it ours. Waits for the group that is being written, and every later one of another server is refused.
    pub(super) async fn take_over(self, db: &mut Connection) -> Result<(), StoreError> {
        let query = "update database_owner set epoch = epoch + 1 where \"only\" = 1 returning epoch";
        let epoch: i64 = sqlx::query_scalar(query).fetch_one(db).await?;
        self.0.store(epoch, Ordering::Relaxed);
        Ok(())
    }

    /// Refused, where another server has taken it over. Until this transaction ends none can.
    pub(super) async fn expect(&self, db: &mut Connection) -> Result<(), Refusal> {
        let own = self.0.load(Ordering::Relaxed);
        if own == 0 {
            return Ok(());
        }
        let query = "select epoch from database_owner where \"only\" = 1 for share";
        let epoch: i64 = sqlx::query_scalar(query).fetch_one(db).await?;
        if epoch == own {
            return Ok(());
        }
        Err(Refusal::NotCommitted(format!(
            "another server has taken this database over (it is the {epoch}th to do so, this one was the {own}th): stop this one, or start it again to take the database back"
        )))
    }
}
