//! Trouble with sensors or their data.

use serde::{Deserialize, Serialize};
use sqlx::sqlite::SqliteRow;
use sqlx::{FromRow, Row, SqliteExecutor};
use uuid::Uuid;

use lodestep_engine::anomaly;

use super::{StoreError, columns};

/// An anomaly of a session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Anomaly {
    /// The walk.
    pub session_id: Uuid,
    /// What was found. Its kind stands as `anomaly`, for `kind` names the change that carries it.
    #[serde(flatten, with = "found")]
    pub found: anomaly::Anomaly,
}

/// The wire's shape of an anomaly.
mod found {
    use lodestep_engine::anomaly::{Anomaly, AnomalyKind};
    use lodestep_engine::figures::Figures;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use crate::stream_field::OptionalStreamField;

    #[derive(Serialize, Deserialize)]
    struct Shape {
        anomaly: AnomalyKind,
        #[serde(flatten)]
        stream: OptionalStreamField,
        t_start_ns: i64,
        t_end_ns: i64,
        samples: u64,
        detail: String,
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

impl FromRow<'_, SqliteRow> for Anomaly {
    fn from_row(row: &SqliteRow) -> sqlx::Result<Self> {
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
        })
    }
}

/// Those of a session, by time.
pub async fn of_session(db: impl SqliteExecutor<'_>, session_id: Uuid) -> Result<Vec<Anomaly>, StoreError> {
    let query = sqlx::query_as("select * from anomalies where session_id = ?1 order by t_start_ns, id")
        .bind(session_id.to_string());
    Ok(query.fetch_all(db).await?)
}

/// How many a session has.
pub async fn count(db: impl SqliteExecutor<'_>, session_id: Uuid) -> Result<u64, StoreError> {
    let query = sqlx::query("select count(*) as anomalies from anomalies where session_id = ?1")
        .bind(session_id.to_string());
    Ok(columns::count(&query.fetch_one(db).await?, "anomalies")?)
}

/// Adds one.
pub async fn insert(
    db: impl SqliteExecutor<'_>,
    session_id: Uuid,
    found: &anomaly::Anomaly,
) -> Result<(), StoreError> {
    sqlx::query(
        "insert into anomalies (session_id, kind, stream, t_start_ns, t_end_ns, samples, detail, figures)
         values (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
    )
    .bind(session_id.to_string())
    .bind(found.kind.as_str().to_owned())
    .bind(found.stream.map(|stream| stream.name().to_owned()))
    .bind(found.t_start_ns)
    .bind(found.t_end_ns)
    .bind(columns::to_column(found.samples))
    .bind(&found.detail)
    .bind(found.figures.as_ref().map(columns::to_json).transpose()?)
    .execute(db)
    .await?;
    Ok(())
}

/// Removes those of a session: a new run finds its own.
pub async fn clear(db: impl SqliteExecutor<'_>, session_id: Uuid) -> Result<(), StoreError> {
    sqlx::query("delete from anomalies where session_id = ?1")
        .bind(session_id.to_string())
        .execute(db)
        .await?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use lodestep_engine::figures::Figures;
    use lodestep_engine::systems::catalogue::SYSTEMS;

    use crate::page_words::assert_words;

    #[test]
    fn the_page_has_words_for_every_anomaly_in_both_languages() {
        for anomaly in SYSTEMS.iter().flat_map(|system| (system.anomalies)()) {
            let kind = anomaly.kind.as_str();
            assert_words("anomaly.told", kind, &anomaly.figures.unwrap_or_default());
            for general in ["anomaly", "anomaly.about"] {
                assert_words(general, kind, &Figures::new());
            }
        }
    }
}
