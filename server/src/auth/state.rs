//! What the server keeps in memory of who may do what.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use sha2::{Digest, Sha256};
use tokio::sync::watch;
use tokio::time::timeout;

use super::caller::{By, Caller};
use super::guesses::Guesses;
use super::{Password, Secret, credentials};
use crate::error::Result;
use crate::state::App;
use crate::utc;

/// Sockets look this often whether their caller is still known; a change of accounts or tokens makes them look at once.
const LOOK_AGAIN_EVERY: Duration = Duration::from_secs(3);

/// Shared by all requests.
#[derive(Debug)]
pub(crate) struct Auth {
    /// Whether there is an account: then nobody does anything without one.
    accounts: AtomicBool,
    /// The secret that setting the server up needs; printed at the start, kept nowhere.
    setup_token: String,
    /// What a part of this program shows on the network, such as the demo's devices.
    pub(super) own_token: Secret,
    pub(crate) guesses: Guesses,
    /// How many passwords have been looked at, each at the full cost of a hash.
    passwords_checked: AtomicU64,
    /// Counts the changes after which somebody may be known no longer.
    changes: watch::Sender<u64>,
}

impl Auth {
    /// For a store that holds accounts, or none yet.
    pub(crate) fn new(accounts: bool, setup_token: Option<String>) -> Auth {
        Auth {
            accounts: AtomicBool::new(accounts),
            setup_token: setup_token.unwrap_or_else(|| Secret::random().text().to_owned()),
            own_token: Secret::random(),
            guesses: Guesses::default(),
            passwords_checked: AtomicU64::new(0),
            changes: watch::Sender::new(0),
        }
    }

    /// Whether there is an account.
    pub(crate) fn has_accounts(&self) -> bool {
        self.accounts.load(Ordering::Acquire)
    }

    /// The secret that making the first account needs.
    pub(crate) fn setup_token(&self) -> &str {
        &self.setup_token
    }

    /// Whether this is it. By their hashes: how long the comparison takes then says nothing of the token.
    pub(super) fn is_setup_token(&self, shown: &str) -> bool {
        Sha256::digest(shown.trim()) == Sha256::digest(&self.setup_token)
    }

    /// Whether a password is the one that was kept; where none was, the same work is done for nothing.
    pub(crate) async fn is_password(&self, password: Password, kept: Option<String>) -> Result<bool> {
        self.passwords_checked.fetch_add(1, Ordering::Relaxed);
        metrics::counter!("lodestep_passwords_checked_total").increment(1);
        password.is(kept).await
    }

    /// How many passwords have been looked at.
    #[cfg(test)]
    pub(super) fn passwords_checked(&self) -> u64 {
        self.passwords_checked.load(Ordering::Relaxed)
    }

    /// What the demo's devices show.
    pub(crate) fn own_token(&self) -> &str {
        self.own_token.text()
    }

    /// An account was made, changed or removed, or a token or sign-in ended: what is open looks again.
    pub(crate) fn changed(&self) {
        self.changes.send_modify(|changes| *changes += 1);
    }

    /// The first account is on disk: from now on everybody needs one.
    pub(super) fn has_one_now(&self) {
        self.accounts.store(true, Ordering::Release);
        self.changed();
    }
}

/// Ready when a caller is known no longer, or may do less than before: revoked, expired, signed out, changed. What
/// was opened for it is then to be closed.
pub(crate) async fn until_unknown(app: &App, caller: &Caller) {
    let mut changes = app.auth.changes.subscribe();
    loop {
        // Time passes by itself, and the clock may be set: look now and then.
        let _ = timeout(LOOK_AGAIN_EVERY, changes.changed()).await;
        if caller.by == By::Itself {
            continue;
        }
        if caller.expires_at.is_some_and(|at| at <= utc::now()) {
            return;
        }
        match credentials::again(app, caller).await {
            Ok(Some(now)) if now.rights() == caller.rights() && now.inspector == caller.inspector => {}
            Ok(_) => return,
            // A store that does not answer now is no reason to cut anybody off.
            Err(error) => tracing::warn!(%error, "could not look whether a caller is still known: {error}"),
        }
    }
}
