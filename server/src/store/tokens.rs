//! Bearer tokens of devices and scripts.

use schemars::JsonSchema;
use serde::Serialize;
use sqlx::{FromRow, Row as _};
use time::OffsetDateTime;
use uuid::Uuid;

use super::accounts::{self, Account};
use super::dialect::{Executor, Pool, Row};
use super::{StoreError, columns};
use crate::rights::Right;
use crate::utc;

/// A token, without its secret.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Token {
    /// Its id.
    pub id: Uuid,
    /// Who made it.
    pub account_id: Uuid,
    /// What it is for.
    #[schemars(example = &"gateway 3")]
    pub name: String,
    /// What may be done with it, as far as its owner may.
    pub rights: Vec<Right>,
    /// The one inspector whose walks it may write.
    pub inspector_id: Option<Uuid>,
    /// When it was made.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    pub created_at: OffsetDateTime,
    /// When it ends by itself.
    #[serde(with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<utc::Instant>")]
    pub expires_at: Option<OffsetDateTime>,
    /// When it was used last, to a minute or so.
    #[serde(with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<utc::Instant>")]
    pub used_at: Option<OffsetDateTime>,
    /// When it was taken back.
    #[serde(with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<utc::Instant>")]
    pub revoked_at: Option<OffsetDateTime>,
}

impl FromRow<'_, Row> for Token {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        let rights: &str = row.try_get("rights")?;
        let rights = serde_json::from_str(rights).map_err(|error| sqlx::Error::ColumnDecode {
            index: "rights".to_owned(),
            source: error.into(),
        })?;
        Ok(Token {
            id: columns::id(row, "id")?,
            account_id: columns::id(row, "account_id")?,
            name: row.try_get("name")?,
            rights,
            inspector_id: columns::optional_id(row, "inspector_id")?,
            created_at: columns::instant(row, "created_at")?,
            expires_at: columns::optional_instant(row, "expires_at")?,
            used_at: columns::optional_instant(row, "used_at")?,
            revoked_at: columns::optional_instant(row, "revoked_at")?,
        })
    }
}

/// The one with this secret, and its owner's account.
pub async fn by_secret(db: &Pool, secret_sha256: [u8; 32]) -> Result<Option<(Token, Account)>, StoreError> {
    let query = sqlx::query_as("select * from tokens where secret_sha256 = $1").bind(secret_sha256.to_vec());
    with_its_account(db, query.fetch_optional(db).await?).await
}

/// The one with this id, and its owner's account.
pub async fn with_account(db: &Pool, id: Uuid) -> Result<Option<(Token, Account)>, StoreError> {
    with_its_account(db, get(db, id).await?).await
}

async fn with_its_account(db: &Pool, token: Option<Token>) -> Result<Option<(Token, Account)>, StoreError> {
    let Some(token) = token else { return Ok(None) };
    Ok(accounts::get(db, token.account_id).await?.map(|account| (token, account)))
}

/// The one with this id.
pub async fn get(db: impl Executor<'_>, id: Uuid) -> Result<Option<Token>, StoreError> {
    let query = sqlx::query_as("select * from tokens where id = $1").bind(id.to_string());
    Ok(query.fetch_optional(db).await?)
}

/// Those of an account, or all; the newest first.
pub async fn list(db: impl Executor<'_>, account_id: Option<Uuid>) -> Result<Vec<Token>, StoreError> {
    let query = sqlx::query_as(
        "select * from tokens where $1 is null or account_id = $1 order by created_at desc, id desc",
    )
    .bind(account_id.map(|id| id.to_string()));
    Ok(query.fetch_all(db).await?)
}

/// Adds one.
pub async fn insert(db: impl Executor<'_>, token: &Token, secret_sha256: [u8; 32]) -> Result<(), StoreError> {
    let rights = serde_json::to_string(&token.rights).expect("a list of words is JSON");
    sqlx::query(
        "insert into tokens (id, account_id, name, secret_sha256, rights, inspector_id, created_at, expires_at)
         values ($1, $2, $3, $4, $5, $6, $7, $8)",
    )
    .bind(token.id.to_string())
    .bind(token.account_id.to_string())
    .bind(&token.name)
    .bind(secret_sha256.to_vec())
    .bind(rights)
    .bind(token.inspector_id.map(|id| id.to_string()))
    .bind(utc::to_us(token.created_at))
    .bind(token.expires_at.map(utc::to_us))
    .execute(db)
    .await?;
    Ok(())
}

/// It was used.
pub async fn used(db: impl Executor<'_>, id: Uuid, at: OffsetDateTime) -> Result<(), StoreError> {
    sqlx::query("update tokens set used_at = $2 where id = $1")
        .bind(id.to_string())
        .bind(utc::to_us(at))
        .execute(db)
        .await?;
    Ok(())
}

/// Takes one back; one that was taken back before keeps its time.
pub async fn revoke(db: impl Executor<'_>, id: Uuid, at: OffsetDateTime) -> Result<(), StoreError> {
    sqlx::query("update tokens set revoked_at = $2 where id = $1 and revoked_at is null")
        .bind(id.to_string())
        .bind(utc::to_us(at))
        .execute(db)
        .await?;
    Ok(())
}
