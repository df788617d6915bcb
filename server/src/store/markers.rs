//! Surveyed actuator anchors.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{FromRow, Row as _};
use time::OffsetDateTime;
use uuid::Uuid;

use super::dialect::{Connection, Executor, Row};
use super::{StoreError, columns};
use crate::utc;

/// A fixed point that walks are tied to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Marker {
    /// Its name, such as A17; case matters.
    #[schemars(example = &"A17")]
    pub name: String,
    /// East, m.
    pub e_m: f64,
    /// North, m.
    pub n_m: f64,
    /// Up, m; `None` when its height was never surveyed.
    pub u_m: Option<f64>,
    /// The table's revision at which it last changed: who changes it names the one that was seen.
    pub version: i64,
    /// When it was added.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "crate::utc::Instant")]
    pub created_at: OffsetDateTime,
    /// When a coordinate last changed.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "crate::utc::Instant")]
    pub updated_at: OffsetDateTime,
}

/// Where a marker stands, in the site's frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "MarkerPlace")]
pub struct Place {
    /// East, m.
    pub e_m: f64,
    /// North, m.
    pub n_m: f64,
    /// Up, m; `None` when its height was never surveyed.
    pub u_m: Option<f64>,
}

impl Place {
    /// How far in plan it is from here to there, m.
    pub fn plan_distance_m(&self, other: &Place) -> f64 {
        (other.e_m - self.e_m).hypot(other.n_m - self.n_m)
    }
}

impl Marker {
    /// Where it stands.
    pub fn place(&self) -> Place {
        Place { e_m: self.e_m, n_m: self.n_m, u_m: self.u_m }
    }
}

impl FromRow<'_, Row> for Marker {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        Ok(Marker {
            name: row.try_get("name")?,
            e_m: row.try_get("e_m")?,
            n_m: row.try_get("n_m")?,
            u_m: row.try_get("u_m")?,
            version: row.try_get("version")?,
            created_at: columns::instant(row, "created_at")?,
            updated_at: columns::instant(row, "updated_at")?,
        })
    }
}

/// All, by name.
pub async fn list(db: impl Executor<'_>) -> Result<Vec<Marker>, StoreError> {
    Ok(sqlx::query_as("select * from markers order by name").fetch_all(db).await?)
}

/// The one with this name.
pub async fn get(db: impl Executor<'_>, name: &str) -> Result<Option<Marker>, StoreError> {
    Ok(sqlx::query_as("select * from markers where name = $1").bind(name).fetch_optional(db).await?)
}

/// Adds one.
pub async fn insert(db: impl Executor<'_>, marker: &Marker) -> Result<(), StoreError> {
    sqlx::query(
        "insert into markers (name, e_m, n_m, u_m, version, created_at, updated_at)
         values ($1, $2, $3, $4, $5, $6, $7)",
    )
    .bind(&marker.name)
    .bind(marker.e_m)
    .bind(marker.n_m)
    .bind(marker.u_m)
    .bind(marker.version)
    .bind(utc::to_us(marker.created_at))
    .bind(utc::to_us(marker.updated_at))
    .execute(db)
    .await?;
    Ok(())
}

/// Moves one; its name and when it was added stay. `false` when there is none with this name.
pub async fn update(
    db: impl Executor<'_>,
    name: &str,
    place: &Place,
    version: i64,
    at: OffsetDateTime,
) -> Result<bool, StoreError> {
    let query = sqlx::query(
        "update markers set e_m = $2, n_m = $3, u_m = $4, version = $5, updated_at = $6 where name = $1",
    )
    .bind(name)
    .bind(place.e_m)
    .bind(place.n_m)
    .bind(place.u_m)
    .bind(version)
    .bind(utc::to_us(at));
    Ok(query.execute(db).await?.rows_affected() > 0)
}

/// Removes one; `false` when there is none with this name.
pub async fn delete(db: impl Executor<'_>, name: &str) -> Result<bool, StoreError> {
    Ok(sqlx::query("delete from markers where name = $1").bind(name).execute(db).await?.rows_affected() > 0)
}

/// Makes the changes that were written for a file, in two statements.
pub async fn make_staged(
    db: &mut Connection,
    import_id: Uuid,
    is_revert: bool,
    revision: i64,
) -> Result<(), StoreError> {
    let id = import_id.to_string();
    sqlx::query(
        "delete from markers where name in (
            select marker from marker_changes where import_id = $1 and is_revert = $2 and after_e_m is null)",
    )
    .bind(&id)
    .bind(is_revert)
    .execute(&mut *db)
    .await?;
    sqlx::query(
        "insert into markers (name, e_m, n_m, u_m, version, created_at, updated_at)
         select marker, after_e_m, after_n_m, after_u_m, $3, changed_at, changed_at from marker_changes
         where import_id = $1 and is_revert = $2 and after_e_m is not null order by marker
         on conflict (name) do update set e_m = excluded.e_m, n_m = excluded.n_m, u_m = excluded.u_m,
            version = excluded.version, updated_at = excluded.updated_at",
    )
    .bind(&id)
    .bind(is_revert)
    .bind(revision)
    .execute(&mut *db)
    .await?;
    Ok(())
}

/// How often the table has changed.
pub async fn revision(db: impl Executor<'_>) -> Result<i64, StoreError> {
    let row = sqlx::query("select revision from marker_revision where \"only\" = 1").fetch_one(db).await?;
    Ok(row.try_get("revision")?)
}

/// Counts one more change of the table; belongs in the transaction of that change.
pub async fn bump_revision(db: impl Executor<'_>) -> Result<i64, StoreError> {
    let row = sqlx::query(
        "update marker_revision set revision = revision + 1 where \"only\" = 1 returning revision",
    )
    .fetch_one(db)
    .await?;
    Ok(row.try_get("revision")?)
}
