//! Browsers in which somebody has signed in.

use schemars::JsonSchema;
use serde::Serialize;
use sqlx::{FromRow, Row as _};
use time::OffsetDateTime;
use uuid::Uuid;

use super::accounts::{self, Account};
use super::dialect::{Connection, Executor, Pool, Row};
use super::{StoreError, columns};
use crate::utc;

/// A browser in which somebody has signed in.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct SignIn {
    /// Its id.
    pub id: Uuid,
    /// Who has signed in.
    pub account_id: Uuid,
    /// From where.
    #[schemars(example = &"10.1.2.3")]
    pub address: String,
    /// What the browser calls itself.
    #[schemars(example = &"Mozilla/5.0")]
    pub agent: String,
    /// When.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    pub created_at: OffsetDateTime,
    /// When it was used last, to a minute or so.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    pub seen_at: OffsetDateTime,
    /// When it ends by itself.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    pub expires_at: OffsetDateTime,
}

impl FromRow<'_, Row> for SignIn {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        Ok(SignIn {
            id: columns::id(row, "id")?,
            account_id: columns::id(row, "account_id")?,
            address: row.try_get("address")?,
            agent: row.try_get("agent")?,
            created_at: columns::instant(row, "created_at")?,
            seen_at: columns::instant(row, "seen_at")?,
            expires_at: columns::instant(row, "expires_at")?,
        })
    }
}

/// The one with this secret, and its account.
pub async fn by_secret(db: &Pool, secret_sha256: [u8; 32]) -> Result<Option<(SignIn, Account)>, StoreError> {
    let query =
        sqlx::query_as("select * from sign_ins where secret_sha256 = $1").bind(secret_sha256.to_vec());
    with_its_account(db, query.fetch_optional(db).await?).await
}

/// The one with this id, and its account.
pub async fn get(db: &Pool, id: Uuid) -> Result<Option<(SignIn, Account)>, StoreError> {
    let query = sqlx::query_as("select * from sign_ins where id = $1").bind(id.to_string());
    with_its_account(db, query.fetch_optional(db).await?).await
}

async fn with_its_account(
    db: &Pool,
    sign_in: Option<SignIn>,
) -> Result<Option<(SignIn, Account)>, StoreError> {
    let Some(sign_in) = sign_in else { return Ok(None) };
    Ok(accounts::get(db, sign_in.account_id).await?.map(|account| (sign_in, account)))
}

/// Those of one account, the one used last first.
pub async fn of_account(db: impl Executor<'_>, account_id: Uuid) -> Result<Vec<SignIn>, StoreError> {
    let query = sqlx::query_as("select * from sign_ins where account_id = $1 order by seen_at desc")
        .bind(account_id.to_string());
    Ok(query.fetch_all(db).await?)
}

/// Adds one, and clears away those that have ended.
pub async fn insert(
    db: &mut Connection,
    sign_in: &SignIn,
    secret_sha256: [u8; 32],
) -> Result<(), StoreError> {
    sqlx::query("delete from sign_ins where expires_at <= $1")
        .bind(utc::to_us(sign_in.created_at))
        .execute(&mut *db)
        .await?;
    sqlx::query(
        "insert into sign_ins (id, account_id, secret_sha256, address, agent, created_at, seen_at, expires_at)
         values ($1, $2, $3, $4, $5, $6, $7, $8)",
    )
    .bind(sign_in.id.to_string())
    .bind(sign_in.account_id.to_string())
    .bind(secret_sha256.to_vec())
    .bind(&sign_in.address)
    .bind(&sign_in.agent)
    .bind(utc::to_us(sign_in.created_at))
    .bind(utc::to_us(sign_in.seen_at))
    .bind(utc::to_us(sign_in.expires_at))
    .execute(db)
    .await?;
    Ok(())
}

/// It was used.
pub async fn seen(db: impl Executor<'_>, id: Uuid, at: OffsetDateTime) -> Result<(), StoreError> {
    sqlx::query("update sign_ins set seen_at = $2 where id = $1")
        .bind(id.to_string())
        .bind(utc::to_us(at))
        .execute(db)
        .await?;
    Ok(())
}

/// Ends one.
pub async fn delete(db: impl Executor<'_>, id: Uuid) -> Result<(), StoreError> {
    sqlx::query("delete from sign_ins where id = $1").bind(id.to_string()).execute(db).await?;
    Ok(())
}

/// Ends all of an account but one.
pub async fn delete_others(
    db: impl Executor<'_>,
    account_id: Uuid,
    but: Option<Uuid>,
) -> Result<(), StoreError> {
    sqlx::query("delete from sign_ins where account_id = $1 and id <> $2")
        .bind(account_id.to_string())
        .bind(but.map(|id| id.to_string()).unwrap_or_default())
        .execute(db)
        .await?;
    Ok(())
}
