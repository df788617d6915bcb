//! The points of lab runs, packed: they are read whole and never searched.

use lodestep_engine::event::{Part, Tilt, TrackPoint};
use sqlx::Row as _;
use uuid::Uuid;

use super::checksum::Checksum;
use super::dialect::{Executor, Row};
use super::{StoreError, columns};

/// Of zstd.
const LEVEL: i32 = 1;
/// The layout of the points: as the migration tells it, and roll, pitch and their sigmas after it.
const ENCODING: i64 = 2;
/// The layout before there was roll and pitch.
const WITHOUT_TILT: i64 = 1;
/// Values of a point beside its time.
const VALUES: usize = 21;
/// The same in the layout before.
const VALUES_WITHOUT_TILT: usize = 17;

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
    let [first, second] = point.parts.map(|part| part.map_or([f64::NAN; 3], |part| part.position_n_m));
    let stances = point.parts.map(|part| part.map_or(f64::NAN, |part| f64::from(part.stance)));
    let tilt = point.tilt.map_or([f64::NAN; 4], |tilt| {
        [tilt.roll_rad, tilt.pitch_rad, tilt.sigma_roll_rad.into(), tilt.sigma_pitch_rad.into()]
    });
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
        first[0],
        first[1],
        first[2],
        second[0],
        second[1],
        second[2],
        stances[0],
        stances[1],
        tilt[0],
        tilt[1],
        tilt[2],
        tilt[3],
    ]
}

fn point_of(t_ns: i64, values: [f64; VALUES]) -> TrackPoint {
    let [e, n, u, heading_rad, sigma_heading_rad, sigma_e, sigma_n, sigma_u, covariance_en_m2, rest @ ..] =
        values;
    let [e_0, n_0, u_0, e_1, n_1, u_1, stance_0, stance_1, roll_rad, pitch_rad, sigma_roll, sigma_pitch] =
        rest;
    let part = |position_n_m, stance: f64| {
        (!stance.is_nan()).then_some(Part { position_n_m, stance: stance != 0.0 })
    };
    TrackPoint {
        t_ns,
        position_n_m: [e, n, u],
        heading_rad,
        sigma_heading_rad,
        sigma_n_m: [sigma_e, sigma_n, sigma_u],
        covariance_en_m2,
        tilt: (!roll_rad.is_nan()).then_some(Tilt {
            roll_rad,
            pitch_rad,
            sigma_roll_rad: sigma_roll as f32,
            sigma_pitch_rad: sigma_pitch as f32,
        }),
        parts: [part([e_0, n_0, u_0], stance_0), part([e_1, n_1, u_1], stance_1)],
    }
}

/// Puts a run's points in the place of the former ones.
pub async fn set(db: impl Executor<'_>, run_id: Uuid, packed: &Packed) -> Result<(), StoreError> {
    sqlx::query(
        "insert into lab_tracks (run_id, points, encoding, body, checksum) values ($1, $2, $3, $4, $5)
         on conflict (run_id) do update set points = excluded.points, encoding = excluded.encoding, body = excluded.body,
            checksum = excluded.checksum",
    )
    .bind(run_id.to_string())
    .bind(columns::to_column(packed.points))
    .bind(ENCODING)
    .bind(&packed.body)
    .bind(checksum(&run_id.to_string(), columns::to_column(packed.points), ENCODING, &packed.body).column())
    .execute(db)
    .await?;
    Ok(())
}

fn checksum(run_id: &str, points: i64, encoding: i64, body: &[u8]) -> Checksum {
    Checksum::default().text(run_id).integer(points).integer(encoding).bytes(body)
}

/// Whether a row is as it was written.
pub(super) fn check(row: &Row) -> Result<(), StoreError> {
    let run_id: &str = row.try_get("run_id")?;
    checksum(run_id, row.try_get("points")?, row.try_get("encoding")?, row.try_get("body")?)
        .agrees(row, || format!("track of lab run {run_id}"))
}

/// A run's points by time; none of a run that has not been computed.
pub async fn get(db: impl Executor<'_>, run_id: Uuid) -> Result<Vec<TrackPoint>, StoreError> {
    let query = sqlx::query("select * from lab_tracks where run_id = $1").bind(run_id.to_string());
    let Some(row) = query.fetch_optional(db).await? else { return Ok(Vec::new()) };
    check(&row)?;
    let damaged = |why: String| StoreError::Damaged { what: format!("track of lab run {run_id}"), why };
    let (points, encoding): (u64, i64) = (columns::count(&row, "points")?, row.try_get("encoding")?);
    let stored = match encoding {
        ENCODING => VALUES,
        WITHOUT_TILT => VALUES_WITHOUT_TILT,
        _ => {
            return Err(damaged(format!("expected encoding {WITHOUT_TILT} or {ENCODING}, found {encoding}")));
        }
    };
    let points = usize::try_from(points).map_err(|error| damaged(error.to_string()))?;
    let bytes = points.saturating_mul(8 * (1 + stored));
    let body: &[u8] = row.try_get("body")?;
    let plain = zstd::bulk::decompress(body, bytes).map_err(|error| damaged(error.to_string()))?;
    if plain.len() != bytes {
        return Err(damaged(format!("expected {bytes} bytes, found {}", plain.len())));
    }
    let (words, _) = plain.as_chunks::<8>();
    let point = |i: usize| {
        let value = |column: usize| match words.get((1 + column) * points + i) {
            Some(word) if column < stored => f64::from_le_bytes(*word),
            _ => f64::NAN,
        };
        point_of(i64::from_le_bytes(words[i]), std::array::from_fn(value))
    };
    Ok((0..points).map(point).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_survives_packing_bit_by_bit() {
        let stream = Part { position_n_m: [1.0, f64::MIN_POSITIVE, -0.0], stance: true };
        let point = TrackPoint {
            t_ns: -7,
            position_n_m: [0.1, 0.2, 0.3],
            heading_rad: -1.0,
            sigma_heading_rad: 0.5,
            sigma_n_m: [1.0, 2.0, 3.0],
            covariance_en_m2: -0.25,
            tilt: Some(Tilt { roll_rad: 0.1, pitch_rad: -0.2, sigma_roll_rad: 0.25, sigma_pitch_rad: 0.5 }),
            parts: [None, Some(stream)],
        };
        assert_eq!(point_of(point.t_ns, values_of(&point)), point);
    }
}
