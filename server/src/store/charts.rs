//! What charts are drawn from: series of a processed session on a grid in time.

use sqlx::Row as _;
use uuid::Uuid;

use super::checksum::Checksum;
use super::dialect::{Executor, Row};
use super::{StoreError, columns};

/// Of zstd.
const LEVEL: i32 = 1;

/// More cells than any line of a chart has.
const MOST_CELLS: usize = 1 << 20;

/// One line of a chart: the smallest and the largest value in each cell of a grid in time.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Which chart draws it.
    pub chart: String,
    /// Which line of the chart.
    pub name: String,
    /// Length of a cell, ns.
    pub cell_ns: i64,
    /// Number of the first cell, which begins at this times `cell_ns`.
    pub first_cell: i64,
    /// The smallest value of each cell; NaN where it has none.
    pub low: Vec<f32>,
    /// The largest value of each cell, likewise.
    pub high: Vec<f32>,
}

impl Series {
    /// The largest value of the cell that a time lies in; `None` where it has none.
    pub fn high_at(&self, t_ns: i64) -> Option<f64> {
        let cell = t_ns.div_euclid(self.cell_ns).checked_sub(self.first_cell)?;
        let high = self.high.get(usize::try_from(cell).ok()?)?;
        high.is_finite().then_some(f64::from(*high))
    }
}

/// A series packed for its row.
#[derive(Clone, Debug)]
pub struct Packed {
    chart: String,
    name: String,
    cell_ns: i64,
    first_cell: i64,
    cells: u64,
    body: Vec<u8>,
}

impl Packed {
    /// Packs a series; done by the caller's thread, so that the one writer only writes.
    pub fn new(series: &Series) -> Result<Packed, StoreError> {
        let values = series.low.iter().chain(&series.high);
        let plain: Vec<u8> = values.flat_map(|value| value.to_le_bytes()).collect();
        let body = zstd::bulk::compress(&plain, LEVEL)
            .map_err(|error| StoreError::NotCommitted(format!("a chart could not be packed: {error}")))?;
        Ok(Packed {
            chart: series.chart.clone(),
            name: series.name.clone(),
            cell_ns: series.cell_ns,
            first_cell: series.first_cell,
            cells: series.low.len() as u64,
            body,
        })
    }

    /// The bytes as they go into the table.
    pub fn body(&self) -> &[u8] {
        &self.body
    }
}

/// Puts a series in the place of the former one.
pub async fn set(db: impl Executor<'_>, session_id: Uuid, series: Packed) -> Result<(), StoreError> {
    let session_id = session_id.to_string();
    let names = [&session_id, &series.chart, &series.name].map(String::as_str);
    let grid = [series.cell_ns, series.first_cell, columns::to_column(series.cells)];
    let sum = checksum(names, grid, &series.body).column();
    sqlx::query(
        "insert into session_charts (session_id, chart, series, cell_ns, first_cell, cells, body, checksum)
         values ($1, $2, $3, $4, $5, $6, $7, $8)
         on conflict (session_id, chart, series) do update set
            cell_ns = excluded.cell_ns, first_cell = excluded.first_cell, cells = excluded.cells,
            body = excluded.body, checksum = excluded.checksum",
    )
    .bind(session_id)
    .bind(series.chart)
    .bind(series.name)
    .bind(series.cell_ns)
    .bind(series.first_cell)
    .bind(columns::to_column(series.cells))
    .bind(series.body)
    .bind(sum)
    .execute(db)
    .await?;
    Ok(())
}

/// Removes a session's series: a new computation takes their place.
pub async fn clear(db: impl Executor<'_>, session_id: Uuid) -> Result<(), StoreError> {
    sqlx::query("delete from session_charts where session_id = $1")
        .bind(session_id.to_string())
        .execute(db)
        .await?;
    Ok(())
}

/// A session's series, all of them; none before it was processed.
pub async fn of_session(db: impl Executor<'_>, session_id: Uuid) -> Result<Vec<Series>, StoreError> {
    let query = sqlx::query("select * from session_charts where session_id = $1 order by chart, series")
        .bind(session_id.to_string());
    query.fetch_all(db).await?.iter().map(unpack).collect()
}

/// The lines of one chart of a session.
pub async fn of_chart(
    db: impl Executor<'_>,
    session_id: Uuid,
    chart: &str,
) -> Result<Vec<Series>, StoreError> {
    let query =
        sqlx::query("select * from session_charts where session_id = $1 and chart = $2 order by series")
            .bind(session_id.to_string())
            .bind(chart);
    query.fetch_all(db).await?.iter().map(unpack).collect()
}

fn checksum(names: [&str; 3], grid: [i64; 3], body: &[u8]) -> Checksum {
    let named = names.into_iter().fold(Checksum::default(), Checksum::text);
    grid.into_iter().fold(named, Checksum::integer).bytes(body)
}

/// Whether a row is as it was written.
pub(super) fn check(row: &Row) -> Result<(), StoreError> {
    let names = [row.try_get("session_id")?, row.try_get("chart")?, row.try_get("series")?];
    let grid = [row.try_get("cell_ns")?, row.try_get("first_cell")?, row.try_get("cells")?];
    let [session_id, chart, series]: [&str; 3] = names;
    checksum(names, grid, row.try_get("body")?)
        .agrees(row, || format!("chart {chart} ({series}) of session {session_id}"))
}

fn unpack(row: &Row) -> Result<Series, StoreError> {
    check(row)?;
    let (chart, name): (String, String) = (row.try_get("chart")?, row.try_get("series")?);
    let damaged = |why: String| StoreError::Damaged { what: format!("chart {chart} {name}"), why };
    let (low, high) = unpacked(row.try_get("body")?, columns::count(row, "cells")?).map_err(damaged)?;
    Ok(Series {
        cell_ns: row.try_get("cell_ns")?,
        first_cell: row.try_get("first_cell")?,
        chart,
        name,
        low,
        high,
    })
}

/// The smallest and the largest values of so many cells out of a packed body.
///
/// # Errors
///
/// When the body does not hold them, in a sentence.
pub fn unpacked(body: &[u8], cells: u64) -> Result<(Vec<f32>, Vec<f32>), String> {
    // What a damaged count asks for is never reserved.
    let cells = usize::try_from(cells)
        .ok()
        .filter(|cells| *cells <= MOST_CELLS)
        .ok_or_else(|| format!("expected at most {MOST_CELLS} cells in a line, found {cells}"))?;
    let expected = cells * 8;
    let plain = zstd::bulk::decompress(body, expected).map_err(|error| error.to_string())?;
    if plain.len() != expected {
        return Err(format!("expected {expected} bytes, found {}", plain.len()));
    }
    let mut low: Vec<f32> = plain.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    let high = low.split_off(cells);
    Ok((low, high))
}
