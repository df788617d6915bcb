//! People who can sign in.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{FromRow, Row as _};
use time::OffsetDateTime;
use unicode_security::skeleton;
use uuid::Uuid;

use super::dialect::{Executor, Row};
use super::{StoreError, columns};
use crate::rights::Role;
use crate::utc;

/// One who can sign in.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Account {
    /// Its id.
    pub id: Uuid,
    /// What its owner signs in with.
    #[schemars(example = &"li wei")]
    pub name: String,
    /// What its owner may do.
    pub role: Role,
    /// The argon2id hash of its password; told to nobody.
    #[serde(skip)]
    pub password_hash: String,
    /// Whose walks its owner may write, where the role is inspector.
    pub inspector_id: Option<Uuid>,
    /// Whether its owner is kept out.
    pub disabled: bool,
    /// When it ends by itself.
    #[serde(with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<utc::Instant>")]
    pub expires_at: Option<OffsetDateTime>,
    /// When it was made.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    pub created_at: OffsetDateTime,
    /// When it was changed last.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    pub updated_at: OffsetDateTime,
}

impl FromRow<'_, Row> for Account {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        Ok(Account {
            id: columns::id(row, "id")?,
            name: row.try_get("name")?,
            role: columns::word(row, "role")?,
            password_hash: row.try_get("password_hash")?,
            inspector_id: columns::optional_id(row, "inspector_id")?,
            disabled: row.try_get("disabled")?,
            expires_at: columns::optional_instant(row, "expires_at")?,
            created_at: columns::instant(row, "created_at")?,
            updated_at: columns::instant(row, "updated_at")?,
        })
    }
}

/// Two names that differ by case are one.
pub fn name_key(name: &str) -> String {
    name.trim().to_lowercase()
}

/// What a name looks like to people: letters that cannot be told from each other are one (Unicode TS 39), and so are upper and lower
/// case.
pub fn looks_like(name: &str) -> String {
    // Letters of full width are the same letters.
    let narrow = |c: char| match c {
        '\u{3000}' => ' ',
        '\u{FF01}'..='\u{FF5E}' => char::from_u32(u32::from(c) - 0xFEE0).unwrap_or(c),
        c => c,
    };
    let narrow: String = name.chars().map(narrow).collect();
    let once: String = skeleton(&name_key(&narrow)).collect();
    skeleton(&once.to_lowercase()).collect()
}

/// An account of another name that people would take for this one.
pub async fn look_alike(
    db: impl Executor<'_>,
    name: &str,
    own: Option<Uuid>,
) -> Result<Option<Account>, StoreError> {
    let looks = looks_like(name);
    let is_alike = |account: &Account| Some(account.id) != own && looks_like(&account.name) == looks;
    Ok(list(db).await?.into_iter().find(is_alike))
}

/// All, by name.
pub async fn list(db: impl Executor<'_>) -> Result<Vec<Account>, StoreError> {
    Ok(sqlx::query_as("select * from accounts order by name_key").fetch_all(db).await?)
}

/// The one with this id.
pub async fn get(db: impl Executor<'_>, id: Uuid) -> Result<Option<Account>, StoreError> {
    let query = sqlx::query_as("select * from accounts where id = $1").bind(id.to_string());
    Ok(query.fetch_optional(db).await?)
}

/// The one with this name.
pub async fn by_name(db: impl Executor<'_>, name: &str) -> Result<Option<Account>, StoreError> {
    let query = sqlx::query_as("select * from accounts where name_key = $1").bind(name_key(name));
    Ok(query.fetch_optional(db).await?)
}

/// Whether somebody has signed in to the account of this name from this address before.
pub async fn knows_address(db: impl Executor<'_>, name: &str, address: &str) -> Result<bool, StoreError> {
    let query = sqlx::query_scalar(
        "select exists (select 1 from accounts a join audit on audit.subject = a.id
            where a.name_key = $1 and audit.action = 'account.signed_in' and audit.address = $2)",
    );
    Ok(query.bind(name_key(name)).bind(address).fetch_one(db).await?)
}

/// Whether there is any.
pub async fn any(db: impl Executor<'_>) -> Result<bool, StoreError> {
    let count: i64 = sqlx::query_scalar("select count(*) from accounts").fetch_one(db).await?;
    Ok(count > 0)
}

/// How many administrators can sign in at this moment.
pub async fn administrators(db: impl Executor<'_>) -> Result<u64, StoreError> {
    let count: i64 = sqlx::query_scalar(
        "select count(*) from accounts where role = 'admin' and not disabled and (expires_at is null or expires_at > $1)",
    )
    .bind(utc::to_us(utc::now()))
    .fetch_one(db)
    .await?;
    Ok(u64::try_from(count).unwrap_or(0))
}

/// Adds one.
pub async fn insert(db: impl Executor<'_>, account: &Account) -> Result<(), StoreError> {
    sqlx::query(
        "insert into accounts (id, name, name_key, role, password_hash, inspector_id, disabled, expires_at, created_at, updated_at)
         values ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10)",
    )
    .bind(account.id.to_string())
    .bind(&account.name)
    .bind(name_key(&account.name))
    .bind(columns::to_word(account.role))
    .bind(&account.password_hash)
    .bind(account.inspector_id.map(|id| id.to_string()))
    .bind(account.disabled)
    .bind(account.expires_at.map(utc::to_us))
    .bind(utc::to_us(account.created_at))
    .bind(utc::to_us(account.updated_at))
    .execute(db)
    .await?;
    Ok(())
}

/// Writes one anew; its id and its age stay.
pub async fn update(db: impl Executor<'_>, account: &Account) -> Result<(), StoreError> {
    sqlx::query(
        "update accounts set name = $2, name_key = $3, role = $4, password_hash = $5, inspector_id = $6, disabled = $7,
         expires_at = $8, updated_at = $9 where id = $1",
    )
    .bind(account.id.to_string())
    .bind(&account.name)
    .bind(name_key(&account.name))
    .bind(columns::to_word(account.role))
    .bind(&account.password_hash)
    .bind(account.inspector_id.map(|id| id.to_string()))
    .bind(account.disabled)
    .bind(account.expires_at.map(utc::to_us))
    .bind(utc::to_us(account.updated_at))
    .execute(db)
    .await?;
    Ok(())
}

/// Removes one, with its sign-ins and tokens.
pub async fn delete(db: impl Executor<'_>, id: Uuid) -> Result<(), StoreError> {
    sqlx::query("delete from accounts where id = $1").bind(id.to_string()).execute(db).await?;
    Ok(())
}
