//! How values are written into columns and read back.

use sqlx::Row as _;
use time::OffsetDateTime;
use uuid::Uuid;

use lodestep_engine::stream::StreamId;

use super::dialect::Row;
use crate::utc;

/// Reads a column's value and says which column it was when it cannot be.
fn parse<T>(column: &str, text: &str, value: Option<T>) -> sqlx::Result<T> {
    value.ok_or_else(|| sqlx::Error::ColumnDecode {
        index: column.to_owned(),
        source: format!("unexpected {text:?}").into(),
    })
}

/// An id.
pub(super) fn id(row: &Row, column: &str) -> sqlx::Result<Uuid> {
    let text: &str = row.try_get(column)?;
    parse(column, text, Uuid::parse_str(text).ok())
}

/// An id that may be null.
pub(super) fn optional_id(row: &Row, column: &str) -> sqlx::Result<Option<Uuid>> {
    let text: Option<&str> = row.try_get(column)?;
    text.map(|text| parse(column, text, Uuid::parse_str(text).ok())).transpose()
}

/// An instant.
pub(super) fn instant(row: &Row, column: &str) -> sqlx::Result<OffsetDateTime> {
    Ok(utc::from_us(row.try_get(column)?))
}

/// An instant that may be null.
pub(super) fn optional_instant(row: &Row, column: &str) -> sqlx::Result<Option<OffsetDateTime>> {
    let us: Option<i64> = row.try_get(column)?;
    Ok(us.map(utc::from_us))
}

/// A count, which the tables hold as a signed integer.
pub(super) fn count(row: &Row, column: &str) -> sqlx::Result<u64> {
    let value: i64 = row.try_get(column)?;
    parse(column, &value.to_string(), u64::try_from(value).ok())
}

/// A whole number that its type holds.
pub(super) fn small<T: TryFrom<i64>>(row: &Row, column: &str) -> sqlx::Result<T> {
    let value: i64 = row.try_get(column)?;
    parse(column, &value.to_string(), T::try_from(value).ok())
}

/// A count that may be null.
pub(super) fn optional_count(row: &Row, column: &str) -> sqlx::Result<Option<u64>> {
    let value: Option<i64> = row.try_get(column)?;
    value.map(|value| parse(column, &value.to_string(), u64::try_from(value).ok())).transpose()
}

/// A count for a column; no count here comes near 2⁶³.
pub(super) fn to_column(count: u64) -> i64 {
    i64::try_from(count).unwrap_or(i64::MAX)
}

/// East, north, up from the columns `{prefix}e_m`, `{prefix}n_m`, `{prefix}u_m`; `None` where the
/// first is null.
pub(super) fn optional_enu(row: &Row, columns: [&str; 3]) -> sqlx::Result<Option<[f64; 3]>> {
    let east: Option<f64> = row.try_get(columns[0])?;
    let Some(east) = east else { return Ok(None) };
    Ok(Some([east, row.try_get(columns[1])?, row.try_get(columns[2])?]))
}

/// East, north, up.
pub(super) fn enu(row: &Row, columns: [&str; 3]) -> sqlx::Result<[f64; 3]> {
    Ok([row.try_get(columns[0])?, row.try_get(columns[1])?, row.try_get(columns[2])?])
}

/// The name of a stream.
pub(super) fn stream(row: &Row, column: &str) -> sqlx::Result<StreamId> {
    let name: &str = row.try_get(column)?;
    parse(column, name, StreamId::read(name))
}

/// The name of a stream that may be null.
pub(super) fn optional_stream(row: &Row, column: &str) -> sqlx::Result<Option<StreamId>> {
    let name: Option<&str> = row.try_get(column)?;
    name.map(|name| parse(column, name, StreamId::read(name))).transpose()
}

/// A value that has a word of its own (an enum with `serde` names).
pub(super) fn word<T: serde::de::DeserializeOwned>(row: &Row, column: &str) -> sqlx::Result<T> {
    let text: &str = row.try_get(column)?;
    parse(column, text, serde_json::from_value(serde_json::Value::from(text)).ok())
}

/// The word of a value, as `serde` names it.
pub(crate) fn to_word<T: serde::Serialize>(value: T) -> String {
    match serde_json::to_value(value) {
        Ok(serde_json::Value::String(word)) => word,
        other => unreachable!("enums of the store are written as one word, not as {other:?}"),
    }
}

/// A value that is written as JSON.
pub(super) fn json<T: serde::de::DeserializeOwned>(row: &Row, column: &str) -> sqlx::Result<T> {
    let text: &str = row.try_get(column)?;
    parse(column, text, serde_json::from_str(text).ok())
}

/// A value that is written as JSON and may be null.
pub(super) fn optional_json<T: serde::de::DeserializeOwned>(
    row: &Row,
    column: &str,
) -> sqlx::Result<Option<T>> {
    let text: Option<&str> = row.try_get(column)?;
    text.map(|text| parse(column, text, serde_json::from_str(text).ok())).transpose()
}

/// The JSON of a value.
pub(super) fn to_json<T: serde::Serialize>(value: &T) -> Result<String, super::StoreError> {
    serde_json::to_string(value).map_err(|error| super::StoreError::Damaged {
        what: std::any::type_name::<T>().to_owned(),
        why: error.to_string(),
    })
}
