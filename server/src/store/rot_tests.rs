//! What has changed on the disk is named, and never taken for what was measured; all else can be read.

use futures_util::{FutureExt, TryStreamExt};
use lodestep_engine::event::TrackPoint;
use lodestep_engine::stream::Readings;
use lodestep_engine::systems::pedestrian::{LEFT, RIGHT};
use sqlx::AssertSqlSafe;
use uuid::Uuid;

use super::raw_chunks::Samples;
use super::tests::{point, sample, session_of, store};
use super::track::{self, Place, TrackKind};
use super::{Record, Store, StoreError, removal, scrub, sessions, stage, stream_chunks};
use crate::utc;

/// A session with samples of both feet and a track.
async fn walked(store: &Store, name: &str) -> Uuid {
    let id = session_of(store, name).await;
    for (sequence, stream) in [(0, LEFT), (0, RIGHT), (1, LEFT)] {
        let readings = Readings::Imu((0..30).map(sample).collect());
        let raw = vec![Samples { stream, first_sequence: sequence, sequences: 1, readings }];
        let points = (0..20).map(|n| point(n * 100_000_000, n as f64)).collect();
        store.writer().record(Record { session_id: id, raw, points, ..Record::default() }).await.unwrap();
    }
    id
}

async fn change(store: &Store, sql: String) {
    store
        .writer()
        .run(move |db| {
            async move {
                sqlx::query(AssertSqlSafe(sql)).execute(db).await?;
                Ok::<_, StoreError>(())
            }
            .boxed()
        })
        .await
        .unwrap();
}

async fn samples(store: &Store, id: Uuid) -> Result<Vec<Samples>, StoreError> {
    stream_chunks::of_stream(store.read(), id, LEFT).try_collect().await
}

async fn points(store: &Store, id: Uuid) -> Result<Vec<TrackPoint>, StoreError> {
    track::points(store.read(), id, TrackKind::Main).try_collect().await
}

async fn damaged(store: &Store) -> Vec<String> {
    scrub::look_at_all(&mut store.read().acquire().await.unwrap()).await.unwrap()
}

#[tokio::test]
async fn a_chunk_or_a_point_that_has_changed_is_named_and_everything_else_can_be_read() {
    let (_folder, store) = store().await;
    let (hurt, whole) = (walked(&store, "hurt").await, walked(&store, "whole").await);
    assert_eq!(damaged(&store).await, Vec::<String>::new());
    // One bit of a body, that a reader of its layout might well accept.
    change(
        &store,
        format!(
            "update stream_chunks set body = cast(substr(body, 1, length(body) - 1) || case substr(body, -1) when x'01' then x'02' else x'01' end as blob)
             where session_id = '{hurt}' and stream = 'left' and first_sequence = 1"
        ),
    )
    .await;
    let told = samples(&store, hurt).await.unwrap_err().to_string();
    for word in ["samples of session", &hurt.to_string(), "stream left", "chunk 1", "checksum"] {
        assert!(told.contains(word), "{word} is missing: {told}");
    }
    change(
        &store,
        format!("update track_points set n_m = n_m + 1e-9 where session_id = '{hurt}' and t_ns = 0"),
    )
    .await;
    let told = points(&store, hurt).await.unwrap_err().to_string();
    assert!(told.contains("track of session") && told.contains(&hurt.to_string()), "{told}");
    // The same point in another session's track is no point of that.
    change(&store, format!("update track_points set session_id = '{whole}', t_ns = 7 where session_id = '{hurt}' and t_ns = 100000000")).await;
    assert!(points(&store, whole).await.is_err());
    let found = damaged(&store).await;
    assert_eq!(found.len(), 3, "{found:#?}");
    change(&store, "delete from track_points where t_ns = 7".to_owned()).await;
    assert_eq!(samples(&store, whole).await.unwrap().len(), 2);
    assert_eq!(points(&store, whole).await.unwrap().len(), 20);
    // What was written before there were checksums is taken as it is.
    change(&store, "update track_points set checksum = null".to_owned()).await;
    assert_eq!(points(&store, hurt).await.unwrap().len(), 19);
}

#[tokio::test]
async fn a_result_that_is_written_in_pieces_is_seen_only_when_it_is_whole() {
    let (_folder, store) = store().await;
    let id = walked(&store, "walker").await;
    let before = points(&store, id).await.unwrap();
    let new: Vec<TrackPoint> = (0..4_500).map(|n| point(n * 50_000_000, -(n as f64))).collect();
    let place = track::shown(store.read(), id).await.unwrap().other();
    assert_eq!(place, Place::Second);
    // Twice, as after a server that was killed in between: what lay there goes first.
    for runs in [vec![(TrackKind::Main, new[1_000..].to_vec())], vec![(TrackKind::Main, new.clone())]] {
        stage::write(&store, id, place, runs).await.unwrap();
        assert_eq!(points(&store, id).await.unwrap(), before);
    }
    store.writer().run(move |db| async move { track::show(db, id, place).await }.boxed()).await.unwrap();
    assert_eq!(points(&store, id).await.unwrap(), new);
    assert_eq!(track::shown(store.read(), id).await.unwrap(), place);
    stage::clear(&store, id, place.other()).await.unwrap();
    assert_eq!(points(&store, id).await.unwrap(), new);
    let all: i64 =
        sqlx::query_scalar("select count(*) from track_points").fetch_one(store.read()).await.unwrap();
    assert_eq!(all, 4_500);
}

#[tokio::test]
async fn a_removed_session_is_gone_at_once_and_its_rows_by_and_by_those_of_others_stay() {
    let (_folder, store) = store().await;
    let (goes, stays) = (walked(&store, "goes").await, walked(&store, "stays").await);
    assert!(
        store
            .writer()
            .run(move |db| async move { removal::hide(db, goes, utc::now()).await }.boxed())
            .await
            .unwrap()
    );
    assert_eq!(sessions::get(store.read(), goes).await.unwrap(), None);
    let listed = sessions::list(store.read(), sessions::Filter::default()).await.unwrap();
    assert_eq!(listed.iter().map(|session| session.id).collect::<Vec<_>>(), [stays]);
    assert_eq!(removal::hidden(store.read()).await.unwrap(), [goes]);
    let mut pieces = 1;
    while store
        .writer()
        .run(move |db| async move { removal::remove_piece(db, goes).await }.boxed())
        .await
        .unwrap()
    {
        pieces += 1;
    }
    assert!(pieces >= 3, "{pieces}");
    assert_eq!(removal::hidden(store.read()).await.unwrap(), Vec::<Uuid>::new());
    for table in ["sessions", "track_points", "stream_chunks", "streams", "stream_parts"] {
        let column = if table == "sessions" { "id" } else { "session_id" };
        let count = |id: Uuid| format!("select count(*) from {table} where {column} = '{id}'");
        let rows = async |id| {
            let count: i64 =
                sqlx::query_scalar(AssertSqlSafe(count(id))).fetch_one(store.read()).await.unwrap();
            count
        };
        assert_eq!(rows(goes).await, 0, "{table}");
        assert!(rows(stays).await > 0, "{table}");
    }
}
