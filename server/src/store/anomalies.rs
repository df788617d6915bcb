//! Trouble with sensors or their data.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{FromRow, Row as _};
use uuid::Uuid;

use lodestep_engine::anomaly::{self, AnomalyKind};
use lodestep_engine::parse::remark::KINDS;
use lodestep_engine::stream::StreamId;

use super::dialect::{Connection, Executor, Row};
use super::many_rows::{placeholders, shaped, shapes};
use super::{StoreError, columns};

/// An anomaly of a session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Anomaly {
    /// The walk.
    pub session_id: Uuid,
    /// What was found. Its kind stands as `anomaly`, for `kind` names the change that carries it.
    #[serde(flatten, with = "found")]
    #[schemars(with = "found::Shape")]
    pub found: anomaly::Anomaly,
    /// How many of the kind are told by this one: it is the first of them, with the time and the samples of all.
    #[serde(default = "once")]
    pub times: u64,
}

fn once() -> u64 {
    1
}

/// One that is to be stored: see [`Anomaly`].
#[derive(Clone, Debug, PartialEq)]
pub struct Gathered {
    /// The first of them, with the time and the samples of all.
    pub found: anomaly::Anomaly,
    /// How many.
    pub times: u64,
}

impl Gathered {
    /// As one of a session's.
    pub fn of(self, session_id: Uuid) -> Anomaly {
        Anomaly { session_id, found: self.found, times: self.times }
    }
}

/// The wire's shape of an anomaly.
mod found {
    use lodestep_engine::anomaly::{Anomaly, AnomalyKind};
    use lodestep_engine::figures::Figures;
    use schemars::JsonSchema;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use crate::stream_field::OptionalStreamField;

    #[derive(Serialize, Deserialize, JsonSchema)]
    pub(super) struct Shape {
        /// Which kind of anomaly.
        #[schemars(with = "String", example = &"gap")]
        anomaly: AnomalyKind,
        /// Whose readings; null where it is not one stream's.
        #[serde(flatten)]
        stream: OptionalStreamField,
        /// From when, ns since the session's start.
        t_start_ns: i64,
        /// Until when, ns.
        t_end_ns: i64,
        /// How many samples it concerns.
        samples: u64,
        /// In a sentence.
        #[schemars(example = &"no samples for 1.2 s")]
        detail: String,
        /// The figures of the sentence by their names; null in findings of earlier versions.
        figures: Option<Figures>,
    }

    pub(super) fn serialize<S: Serializer>(found: &Anomaly, to: S) -> Result<S::Ok, S::Error> {
        let Anomaly { kind, stream, t_start_ns, t_end_ns, samples, detail, figures } = found.clone();
        let stream = OptionalStreamField(stream);
        Shape { anomaly: kind, stream, t_start_ns, t_end_ns, samples, detail, figures }.serialize(to)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Anomaly, D::Error> {
        let Shape { anomaly: kind, stream, t_start_ns, t_end_ns, samples, detail, figures } =
            Shape::deserialize(from)?;
        Ok(Anomaly { kind, stream: stream.0, t_start_ns, t_end_ns, samples, detail, figures })
    }
}

impl FromRow<'_, Row> for Anomaly {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        Ok(Anomaly {
            session_id: columns::id(row, "session_id")?,
            found: anomaly::Anomaly {
                kind: columns::word(row, "kind")?,
                stream: columns::optional_stream(row, "stream")?,
                t_start_ns: row.try_get("t_start_ns")?,
                t_end_ns: row.try_get("t_end_ns")?,
                samples: columns::count(row, "samples")?,
                detail: row.try_get("detail")?,
                figures: columns::optional_json(row, "figures")?,
            },
            times: columns::count(row, "times")?,
        })
    }
}

/// Those of a session, by time.
pub async fn of_session(db: impl Executor<'_>, session_id: Uuid) -> Result<Vec<Anomaly>, StoreError> {
    let query = sqlx::query_as("select * from anomalies where session_id = $1 order by t_start_ns, id")
        .bind(session_id.to_string());
    Ok(query.fetch_all(db).await?)
}

/// How many a session has.
pub async fn count(db: impl Executor<'_>, session_id: Uuid) -> Result<u64, StoreError> {
    let query = sqlx::query(
        "select cast(coalesce(sum(times), 0) as bigint) as anomalies from anomalies where session_id = $1",
    )
    .bind(session_id.to_string());
    Ok(columns::count(&query.fetch_one(db).await?, "anomalies")?)
}

/// Adds some.
pub async fn insert(db: &mut Connection, session_id: Uuid, gathered: &[Gathered]) -> Result<(), StoreError> {
    for rows in shapes(gathered, 64) {
        let sql = format!(
            "insert into anomalies (session_id, kind, stream, t_start_ns, t_end_ns, samples, detail, figures, times) values {}",
            placeholders(rows.len(), 9)
        );
        let mut query = shaped(sql);
        for Gathered { found, times } in rows {
            query = query
                .bind(session_id.to_string())
                .bind(found.kind.as_str().to_owned())
                .bind(found.stream.map(|stream| stream.name().to_owned()))
                .bind(found.t_start_ns)
                .bind(found.t_end_ns)
                .bind(columns::to_column(found.samples))
                .bind(found.detail.clone())
                .bind(found.figures.as_ref().map(columns::to_json).transpose()?)
                .bind(columns::to_column(*times));
        }
        query.execute(&mut *db).await?;
    }
    Ok(())
}

/// Gathers more into the last row of their kind and stream.
pub async fn add_to_last(
    db: impl Executor<'_>,
    session_id: Uuid,
    Gathered { found, times }: &Gathered,
) -> Result<(), StoreError> {
    sqlx::query(
        "update anomalies set t_end_ns = case when t_end_ns > $4 then t_end_ns else $4 end, samples = samples + $5, times = times + $6
         where id = (select max(id) from anomalies where session_id = $1 and kind = $2 and stream is not distinct from $3)",
    )
    .bind(session_id.to_string())
    .bind(found.kind.as_str().to_owned())
    .bind(found.stream.map(|stream| stream.name().to_owned()))
    .bind(found.t_end_ns)
    .bind(columns::to_column(found.samples))
    .bind(columns::to_column(*times))
    .execute(db)
    .await?;
    Ok(())
}

/// How many rows of each kind and stream a session has.
pub async fn rows(
    db: impl Executor<'_>,
    session_id: Uuid,
) -> Result<Vec<(AnomalyKind, Option<StreamId>, u64)>, StoreError> {
    let query = sqlx::query(
        "select kind, stream, count(*) as anomalies from anomalies where session_id = $1 group by kind, stream",
    )
    .bind(session_id.to_string());
    let rows = query.fetch_all(db).await?;
    let read = |row: &Row| {
        let (kind, stream) = (columns::word(row, "kind")?, columns::optional_stream(row, "stream")?);
        Ok((kind, stream, columns::count(row, "anomalies")?))
    };
    Ok(rows.iter().map(read).collect::<sqlx::Result<_>>()?)
}

/// Removes so many of those that come after the first `kept`; whether there were any.
pub async fn clear_some(
    db: impl Executor<'_>,
    session_id: Uuid,
    kept: u32,
    at_most: u32,
) -> Result<bool, StoreError> {
    let query = sqlx::query(
        "delete from anomalies where id in (
            select id from anomalies where session_id = $1 order by t_start_ns, id limit $3 offset $2)",
    )
    .bind(session_id.to_string())
    .bind(i64::from(kept))
    .bind(i64::from(at_most));
    Ok(query.execute(db).await?.rows_affected() > 0)
}

/// Puts what was done to read a stream's log in place of what was done to read one before it.
pub async fn put_of_log(
    db: &mut Connection,
    session_id: Uuid,
    stream: StreamId,
    found: &[anomaly::Anomaly],
) -> Result<(), StoreError> {
    for kind in KINDS {
        sqlx::query("delete from anomalies where session_id = $1 and stream = $2 and kind = $3")
            .bind(session_id.to_string())
            .bind(stream.name().to_owned())
            .bind(kind.as_str().to_owned())
            .execute(&mut *db)
            .await?;
    }
    let gathered: Vec<Gathered> =
        found.iter().map(|found| Gathered { found: found.clone(), times: 1 }).collect();
    insert(db, session_id, &gathered).await
}

/// Removes those of a session: a new run finds its own.
pub async fn clear(db: impl Executor<'_>, session_id: Uuid) -> Result<(), StoreError> {
    sqlx::query("delete from anomalies where session_id = $1")
        .bind(session_id.to_string())
        .execute(db)
        .await?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use lodestep_engine::anomaly::Cause as _;
    use lodestep_engine::figures::Figures;
    use lodestep_engine::parse::remark::LogCause;
    use lodestep_engine::systems::catalogue::SYSTEMS;

    use crate::page_words::assert_words;

    #[test]
    fn the_page_has_words_for_every_anomaly_in_both_languages() {
        let of_logs = LogCause::examples().into_iter().map(|cause| ("", cause.anomaly(None, [0; 2], 1)));
        let of_systems = SYSTEMS
            .iter()
            .flat_map(|system| (system.anomalies)().into_iter().map(|anomaly| (system.name, anomaly)));
        for (system, anomaly) in of_systems.chain(of_logs) {
            let kind = anomaly.kind.as_str();
            assert_words(system, "anomaly.told", kind, &anomaly.figures.unwrap_or_default());
            for general in ["anomaly", "anomaly.about"] {
                assert_words(system, general, kind, &Figures::new());
            }
        }
    }
}
