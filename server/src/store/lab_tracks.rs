//! The points of lab runs, packed: they are read whole and never searched.

use lodestep_engine::event::{FootPoint, TrackPoint};
use sqlx::{Row, SqliteExecutor};
use uuid::Uuid;

use super::{StoreError, columns};

/// Of zstd.
const LEVEL: i32 = 1;
/// The layout of the points, as the migration tells it.
const ENCODING: i64 = 1;
/// Values of a point beside its time.
const VALUES: usize = 17;

/// Points packed for their row.
#[derive(Clone, Debug)]
pub struct Packed {
    points: u64,
    body: Vec<u8>,
}

impl Packed {
    /// Packs points; done by the caller's thread, so that the one writer only writes.
    pub fn new(points: &[TrackPoint]) -> Result<Packed, StoreError> {
        let mut plain = Vec::with_capacity(points.len() * 8 * (1 + VALUES));
        plain.extend(points.iter().flat_map(|point| point.t_ns.to_le_bytes()));
        let values: Vec<[f64; VALUES]> = points.iter().map(values_of).collect();
        for column in 0..VALUES {
            plain.extend(values.iter().flat_map(|values| values[column].to_le_bytes()));
        }
        let body = zstd::bulk::compress(&plain, LEVEL)
            .map_err(|error| StoreError::NotCommitted(format!("a track could not be packed: {error}")))?;
        Ok(Packed { points: points.len() as u64, body })
    }
}

fn values_of(point: &TrackPoint) -> [f64; VALUES] {
    let [e, n, u] = point.position_n_m;
    let [sigma_e, sigma_n, sigma_u] = point.sigma_n_m;
    let feet = [point.left, point.right];
    let [left, right] = feet.map(|foot| foot.map_or([f64::NAN; 3], |foot| foot.position_n_m));
    let [left_stands, right_stands] = feet.map(|foot| foot.map_or(f64::NAN, |foot| f64::from(foot.stance)));
    [
        e,
        n,
        u,
        point.heading_rad,
        point.sigma_heading_rad,
        sigma_e,
        sigma_n,
        sigma_u,
        point.covariance_en_m2,
        left[0],
        left[1],
        left[2],
        right[0],
        right[1],
        right[2],
        left_stands,
        right_stands,
    ]
}

fn point_of(t_ns: i64, values: [f64; VALUES]) -> TrackPoint {
    let [e, n, u, heading_rad, sigma_heading_rad, sigma_e, sigma_n, sigma_u, covariance_en_m2, rest @ ..] =
        values;
    let [left_e, left_n, left_u, right_e, right_n, right_u, left_stands, right_stands] = rest;
    let foot = |position_n_m, stands: f64| {
        (!stands.is_nan()).then_some(FootPoint { position_n_m, stance: stands != 0.0 })
    };
    TrackPoint {
        t_ns,
        position_n_m: [e, n, u],
        heading_rad,
        sigma_heading_rad,
        sigma_n_m: [sigma_e, sigma_n, sigma_u],
        covariance_en_m2,
        left: foot([left_e, left_n, left_u], left_stands),
        right: foot([right_e, right_n, right_u], right_stands),
    }
}

/// Puts a run's points in the place of the former ones.
pub async fn set(db: impl SqliteExecutor<'_>, run_id: Uuid, packed: &Packed) -> Result<(), StoreError> {
    sqlx::query(
        "insert into lab_tracks (run_id, points, encoding, body) values (?1, ?2, ?3, ?4)
         on conflict (run_id) do update set points = excluded.points, encoding = excluded.encoding, body = excluded.body",
    )
    .bind(run_id.to_string())
    .bind(columns::to_column(packed.points))
    .bind(ENCODING)
    .bind(&packed.body)
    .execute(db)
    .await?;
    Ok(())
}

/// A run's points by time; none of a run that has not been computed.
pub async fn get(db: impl SqliteExecutor<'_>, run_id: Uuid) -> Result<Vec<TrackPoint>, StoreError> {
    let query = sqlx::query("select points, encoding, body from lab_tracks where run_id = ?1")
        .bind(run_id.to_string());
    let Some(row) = query.fetch_optional(db).await? else { return Ok(Vec::new()) };
    let damaged = |why: String| StoreError::Damaged { what: format!("track of lab run {run_id}"), why };
    let (points, encoding): (u64, i64) = (columns::count(&row, "points")?, row.try_get("encoding")?);
    if encoding != ENCODING {
        return Err(damaged(format!("expected encoding {ENCODING}, found {encoding}")));
    }
    let points = usize::try_from(points).map_err(|error| damaged(error.to_string()))?;
    let bytes = points.saturating_mul(8 * (1 + VALUES));
    let body: &[u8] = row.try_get("body")?;
    let plain = zstd::bulk::decompress(body, bytes).map_err(|error| damaged(error.to_string()))?;
    if plain.len() != bytes {
        return Err(damaged(format!("expected {bytes} bytes, found {}", plain.len())));
    }
    let (words, _) = plain.as_chunks::<8>();
    let point = |i: usize| {
        let value = |column: usize| f64::from_le_bytes(words[(1 + column) * points + i]);
        point_of(i64::from_le_bytes(words[i]), std::array::from_fn(value))
    };
    Ok((0..points).map(point).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_survives_packing_bit_by_bit() {
        let foot = FootPoint { position_n_m: [1.0, f64::MIN_POSITIVE, -0.0], stance: true };
        let point = TrackPoint {
            t_ns: -7,
            position_n_m: [0.1, 0.2, 0.3],
            heading_rad: -1.0,
            sigma_heading_rad: 0.5,
            sigma_n_m: [1.0, 2.0, 3.0],
            covariance_en_m2: -0.25,
            left: None,
            right: Some(foot),
        };
        assert_eq!(point_of(point.t_ns, values_of(&point)), point);
    }
}
