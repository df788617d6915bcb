//! Who changed what, when, from what to what. Rows are only ever added, in the transaction of the change.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use sqlx::{FromRow, Row as _};
use time::OffsetDateTime;
use uuid::Uuid;

use super::dialect::{Executor, Row, like};
use super::{StoreError, columns};
use crate::utc;

/// One change.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "AuditEntry")]
pub struct Entry {
    /// Counts up.
    pub id: i64,
    /// When.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    pub at: OffsetDateTime,
    /// The account behind it, where there is one.
    pub account_id: Option<Uuid>,
    /// Who, in words of then.
    #[schemars(example = &"li wei")]
    pub who: String,
    /// From where.
    #[schemars(example = &"10.1.2.3")]
    pub address: String,
    /// What was done, such as `marker.moved`.
    #[schemars(example = &"marker.changed")]
    pub action: String,
    /// The id or name of what was changed.
    #[schemars(example = &"A17")]
    pub subject: String,
    /// What was there.
    #[schemars(example = serde_json::json!({"e_m": 1.0}))]
    pub before: Option<Value>,
    /// What is there now.
    #[schemars(example = serde_json::json!({"e_m": 1.02}))]
    pub after: Option<Value>,
}

impl FromRow<'_, Row> for Entry {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        let json = |column: &str| -> sqlx::Result<Option<Value>> {
            let text: Option<&str> = row.try_get(column)?;
            let value = text.map(serde_json::from_str).transpose();
            value
                .map_err(|error| sqlx::Error::ColumnDecode { index: column.to_owned(), source: error.into() })
        };
        Ok(Entry {
            id: row.try_get("id")?,
            at: columns::instant(row, "at")?,
            account_id: columns::optional_id(row, "account_id")?,
            who: row.try_get("who")?,
            address: row.try_get("address")?,
            action: row.try_get("action")?,
            subject: row.try_get("subject")?,
            before: json("before")?,
            after: json("after")?,
        })
    }
}

/// Which entries are wanted; what is `None` does not narrow them.
#[derive(Clone, Debug, Default)]
pub struct Wanted {
    /// Whose.
    pub who: Option<String>,
    /// An action, or the noun before its dot.
    pub action: Option<String>,
    /// Of what.
    pub subject: Option<String>,
    /// Older than the entry with this id.
    pub before_id: Option<i64>,
    /// At most so many.
    pub limit: u32,
}

/// Those that are wanted, the newest first.
pub async fn list(db: impl Executor<'_>, wanted: &Wanted) -> Result<Vec<Entry>, StoreError> {
    let query = sqlx::query_as(concat!(
        "select * from audit where ($1 is null or who ",
        like!(),
        " '%' || $1 || '%') and ($2 is null or action = $2 or action ",
        like!(),
        " $2 || '.%') and ($3 is null or subject = $3) and ($4 is null or id < $4) order by id desc limit $5"
    ))
    .bind(&wanted.who)
    .bind(&wanted.action)
    .bind(&wanted.subject)
    .bind(wanted.before_id)
    .bind(i64::from(wanted.limit));
    Ok(query.fetch_all(db).await?)
}

/// Adds one; its `id` is given by the table.
pub async fn insert(db: impl Executor<'_>, entry: &Entry) -> Result<(), StoreError> {
    sqlx::query(
        "insert into audit (at, account_id, who, address, action, subject, before, after) values ($1, $2, $3, $4, $5, $6, $7, $8)",
    )
    .bind(utc::to_us(entry.at))
    .bind(entry.account_id.map(|id| id.to_string()))
    .bind(&entry.who)
    .bind(&entry.address)
    .bind(&entry.action)
    .bind(&entry.subject)
    .bind(entry.before.as_ref().map(Value::to_string))
    .bind(entry.after.as_ref().map(Value::to_string))
    .execute(db)
    .await?;
    Ok(())
}
