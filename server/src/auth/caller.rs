//! Who asks.

use axum::extract::FromRequestParts;
use axum::http::StatusCode;
use axum::http::request::Parts;
use time::OffsetDateTime;
use uuid::Uuid;

use crate::error::{Error, Result};
use crate::http::{Describer, RequestPart};
use crate::rights::{Right, Role};
use crate::store::audit::Entry;
use crate::utc;

/// Who asks, as [`guard`](super::guard()) found out; handlers take it as an argument.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Caller {
    /// What it was known by.
    pub(crate) by: By,
    /// The account behind it.
    pub(crate) account: Option<Uuid>,
    /// For the audit log: the account's name, with its token's.
    pub(crate) who: String,
    /// From where, as far as that is known.
    pub(crate) address: String,
    /// What it may do.
    rights: Vec<Right>,
    /// The inspector whose walks it may write, where it may not write all.
    pub(crate) inspector: Option<Uuid>,
    /// When it is known no longer.
    pub(crate) expires_at: Option<OffsetDateTime>,
}

/// What somebody was known by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum By {
    /// Nothing: nobody has signed in, and nobody needs to, for there are no accounts yet.
    WorkingAtTheMachine,
    /// Nothing, and there are accounts.
    Nothing,
    /// A cookie; the id of the sign-in.
    SignIn(Uuid),
    /// A bearer token; its id.
    Token(Uuid),
    /// A part of this very program.
    Itself,
}

impl Caller {
    /// Somebody at the machine, before there are accounts: may do everything but what needs an account of one's own.
    pub(crate) fn working_at_the_machine(address: String) -> Caller {
        Caller {
            by: By::WorkingAtTheMachine,
            account: None,
            who: "somebody at this machine".to_owned(),
            address,
            rights: Role::Admin.rights().to_vec(),
            inspector: None,
            expires_at: None,
        }
    }

    /// Somebody who showed nothing.
    pub(crate) fn unknown(address: String) -> Caller {
        Caller {
            by: By::Nothing,
            account: None,
            who: String::new(),
            address,
            rights: Vec::new(),
            inspector: None,
            expires_at: None,
        }
    }

    /// A part of this program, such as `demo`.
    pub(crate) fn itself(part: &str) -> Caller {
        Caller {
            by: By::Itself,
            account: None,
            who: part.to_owned(),
            address: String::new(),
            rights: Role::Admin.rights().to_vec(),
            inspector: None,
            expires_at: None,
        }
    }

    /// One with an account, by a cookie or a token.
    pub(crate) fn known(
        by: By,
        account: Uuid,
        who: String,
        address: String,
        rights: Vec<Right>,
        inspector: Option<Uuid>,
        expires_at: Option<OffsetDateTime>,
    ) -> Caller {
        Caller { by, account: Some(account), who, address, rights, inspector, expires_at }
    }

    /// Whether it is among its rights.
    pub(crate) fn may(&self, right: Right) -> bool {
        match right {
            Right::Open => true,
            Right::Known => self.by != By::Nothing,
            right => self.rights.contains(&right),
        }
    }

    /// Refuses who may not: 401 where nobody has signed in, else 403.
    pub(crate) fn needs(&self, right: Right) -> Result<()> {
        if self.may(right) {
            return Ok(());
        }
        if self.by == By::Nothing {
            return Err(not_signed_in());
        }
        Err(Error::http(
            StatusCode::FORBIDDEN,
            "not_allowed",
            format!(
                "expected somebody with the right {:?}, found {:?}, who has {}: ask an administrator for it",
                right.word(),
                self.who,
                words(&self.rights)
            ),
        ))
    }

    /// Refuses who may not write the walks of this inspector.
    pub(crate) fn writes_for(&self, inspector: Uuid) -> Result<()> {
        self.needs(Right::Walk)?;
        if self.inspector == Some(inspector) || (self.inspector.is_none() && self.may(Right::WalkForOthers)) {
            return Ok(());
        }
        Err(Error::http(
            StatusCode::FORBIDDEN,
            "not_your_walk",
            "expected a walk of the inspector that this account or token is for, found another's: ask a dispatcher, or an administrator to tie the account to the inspector",
        ))
    }

    /// For the audit log: what it has done to what, from what to what.
    pub(crate) fn did(
        &self,
        action: &str,
        subject: impl ToString,
        before: Option<serde_json::Value>,
        after: Option<serde_json::Value>,
    ) -> Entry {
        Entry {
            id: 0,
            at: utc::now(),
            account_id: self.account,
            who: self.who.clone(),
            address: self.address.clone(),
            action: action.to_owned(),
            subject: subject.to_string(),
            before,
            after,
        }
    }

    /// The rights, as they are told.
    pub(crate) fn rights(&self) -> &[Right] {
        &self.rights
    }
}

/// Nobody has signed in, and somebody has to.
pub(crate) fn not_signed_in() -> Error {
    Error::http(
        StatusCode::UNAUTHORIZED,
        "not_signed_in",
        "expected somebody who has signed in, or a bearer token, found neither, or one that is no longer good: sign in, or send Authorization: Bearer with a token",
    )
}

fn words(rights: &[Right]) -> String {
    let words: Vec<&str> = rights.iter().map(|right| right.word()).collect();
    if words.is_empty() { "none".to_owned() } else { words.join(", ") }
}

impl<S: Send + Sync> FromRequestParts<S> for Caller {
    type Rejection = Error;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Error> {
        parts.extensions.get::<Caller>().cloned().ok_or_else(|| {
            Error::Internal(anyhow::anyhow!("a handler asks for the caller where no guard has found one"))
        })
    }
}

/// Who asks is found out before: see `guard`.
impl RequestPart for Caller {
    fn describe(_: &mut Describer<'_>) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    fn caller(role: Role, inspector: Option<Uuid>) -> Caller {
        Caller::known(
            By::SignIn(Uuid::nil()),
            Uuid::nil(),
            "li wei".to_owned(),
            String::new(),
            role.rights().to_vec(),
            inspector,
            None,
        )
    }

    #[test]
    fn an_inspector_writes_only_walks_of_their_own() {
        let (own, other) = (Uuid::now_v7(), Uuid::now_v7());
        let inspector = caller(Role::Inspector, Some(own));
        assert!(inspector.writes_for(own).is_ok());
        assert!(inspector.writes_for(other).is_err());
        assert!(caller(Role::Inspector, None).writes_for(own).is_err());
        assert!(caller(Role::Viewer, Some(own)).writes_for(own).is_err());
        assert!(caller(Role::Dispatcher, None).writes_for(other).is_ok());
        // A token that is for one inspector stays so, whatever its owner may do.
        assert!(caller(Role::Admin, Some(own)).writes_for(other).is_err());
    }

    #[test]
    fn who_is_unknown_is_asked_to_sign_in_and_who_is_known_is_told_what_is_missing() {
        let status = |error: Error| error.into_problem().status;
        assert_eq!(status(Caller::unknown(String::new()).needs(Right::Read).unwrap_err()), 401);
        assert_eq!(status(caller(Role::Viewer, None).needs(Right::Survey).unwrap_err()), 403);
    }
}
