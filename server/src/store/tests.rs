//! What the store promises, on a real file.

use std::collections::BTreeMap;

use futures_util::{FutureExt, TryStreamExt};
use lodestep_engine::event::{Part, Tilt, TrackPoint};
use lodestep_engine::sample::ImuSample;
use lodestep_engine::stream::Readings;
use lodestep_engine::systems::pedestrian::{BOTH, LEFT, RIGHT};
use tempfile::TempDir;
use uuid::Uuid;

#[cfg(not(feature = "cluster"))]
use super::health::Disk;
#[cfg(not(feature = "cluster"))]
use super::health::Health;
use super::inspectors::{self, Inspector};
use super::live_states::LiveState;
use super::raw_chunks::{self, Origin, Samples};
use super::sessions::{self, Session, SessionState, Start};
use super::stream_visits::{self, StreamVisit};
use super::track::{self, TrackKind};
use super::visits::{self, Visit};
use super::{Record, Store, StoreError, live_states, stream_chunks, webhook_deliveries};
use crate::utc;

pub(super) async fn store() -> (TempDir, Store) {
    let folder = TempDir::new().unwrap();
    let store = Store::open(&folder.path().join("test.db"), 2).await.unwrap();
    (folder, store)
}

fn inspector(name: &str) -> Inspector {
    Inspector { id: Uuid::now_v7(), name: name.into(), kind: inspectors::person(), created_at: utc::now() }
}

async fn add(store: &Store, inspector: &Inspector) -> Result<(), StoreError> {
    let row = inspector.clone();
    store.writer().run(move |db| Box::pin(async move { inspectors::insert(db, &row).await })).await
}

async fn session(store: &Store) -> Uuid {
    session_of(store, "walker").await
}

pub(super) async fn session_of(store: &Store, name: &str) -> Uuid {
    let walker = inspector(name);
    add(store, &walker).await.unwrap();
    let session = Session {
        id: Uuid::now_v7(),
        inspector_id: walker.id,
        title: "a walk".into(),
        state: SessionState::Live,
        started_at: utc::now(),
        ended_at: None,
        system: "pedestrian".into(),
        streams: vec![LEFT, RIGHT],
        former: BTreeMap::new(),
        start: Start { marker: Some("A17".into()), position_m: [1.0, -2.0, 3.5], known: true },
        instrument: None,
        initial_heading_deg: Some(12.5),
        automatic_visits: true,
        site_parameters_id: None,
        excluded: false,
        samples: 0,
        epochs: 0,
        duration_s: 0.0,
        distance_m: 0.0,
        since_marker_s: 0.0,
        since_marker_m: 0.0,
        track_sha256: None,
        error: None,
        created_at: utc::now(),
    }
    .with_former_keys();
    let row = session.clone();
    store.writer().run(move |db| Box::pin(async move { sessions::insert(db, &row).await })).await.unwrap();
    assert_eq!(sessions::get(store.read(), session.id).await.unwrap(), Some(session.clone()));
    session.id
}

pub(super) fn point(t_ns: i64, e_m: f64) -> TrackPoint {
    TrackPoint {
        t_ns,
        position_n_m: [e_m, 2.0, 3.0],
        heading_rad: 0.5,
        sigma_heading_rad: 0.01,
        sigma_n_m: [0.1, 0.2, 0.3],
        covariance_en_m2: -0.001,
        tilt: Some(Tilt { roll_rad: 0.1, pitch_rad: e_m, sigma_roll_rad: 0.25, sigma_pitch_rad: 0.5 }),
        parts: [Some(Part { position_n_m: [e_m, 2.1, 3.0], stance: true }), None],
    }
}

pub(super) fn sample(t_ns: i64) -> ImuSample {
    ImuSample {
        t_ns,
        w_ib_b_rad_s: [0.1, -0.2, f64::MIN_POSITIVE],
        f_b_m_s2: [0.0, -0.0, 9.787],
        mag_b_ut: (t_ns % 2 == 0).then_some([30.0, 2.0, -30.0]),
        pressure_hpa: (t_ns % 3 == 0).then_some(890.5),
    }
}

fn samples(chunk: &Samples) -> &[ImuSample] {
    let Readings::Imu(samples) = &chunk.readings else { panic!("samples of an inertial sensor") };
    samples
}

async fn stored(store: &Store, session: Uuid) -> Vec<TrackPoint> {
    track::points(store.read(), session, TrackKind::Main).try_collect().await.unwrap()
}

#[tokio::test]
async fn a_record_comes_back_to_the_last_bit() {
    let (_folder, store) = store().await;
    let id = session(&store).await;
    let raw = Samples {
        stream: RIGHT,
        first_sequence: 0,
        sequences: 3,
        readings: Readings::Imu((0..30).map(sample).collect()),
    };
    // More points than one statement takes.
    let points: Vec<TrackPoint> = (0..1_203).map(|i| point(i * 100_000_000, i as f64 * 0.1)).collect();
    let record =
        Record { session_id: id, raw: vec![raw.clone()], points: points.clone(), ..Record::default() };
    store.writer().record(record).await.unwrap();

    assert_eq!(stored(&store, id).await, points);
    let back: Vec<Samples> = stream_chunks::of_stream(store.read(), id, RIGHT).try_collect().await.unwrap();
    assert_eq!(back, [raw]);
    assert!(samples(&back[0])[0].f_b_m_s2[1].is_sign_negative(), "even the sign of a zero");
    assert_eq!(stream_chunks::next_sequence(store.read(), id, RIGHT).await.unwrap(), 3);
    assert_eq!(stream_chunks::next_sequence(store.read(), id, LEFT).await.unwrap(), 0);
}

#[tokio::test]
async fn a_walk_has_its_last_states_and_a_newer_one_takes_the_place_of_what_a_visit_went_back_over() {
    let (_folder, store) = store().await;
    let (one, other) = (session(&store).await, session_of(&store, "another").await);
    let state = |minute: i64, fits: &str| LiveState {
        t_ns: minute * 60_000_000_000,
        fits: fits.to_owned(),
        samples: minute as u64 * 12_000,
        next_sequences: [(LEFT, minute as u64 * 300), (RIGHT, minute as u64 * 300 + 1)].into(),
        body: vec![minute as u8; 10],
    };
    let save = async |session_id, state| {
        let record = Record { session_id, state: Some(state), ..Record::default() };
        store.writer().record(record).await.unwrap();
    };
    let before = async |session_id, fits, minutes: i64| {
        let before_ns = minutes * 60_000_000_000;
        live_states::from_before_the_newest(store.read(), session_id, fits, before_ns).await.unwrap()
    };
    for minute in (2..=20).step_by(2) {
        save(one, state(minute, "this program")).await;
        save(other, state(minute, "another program")).await;
    }
    let minutes = [14, 12, 10].map(|minute| state(minute, "this program"));
    assert_eq!(before(one, "this program", 5).await, minutes, "those of the last ten minutes, newest first");
    assert_eq!(before(other, "this program", 5).await, []);
    // A visit went back to before the last two.
    save(one, state(17, "this program")).await;
    assert_eq!(before(one, "this program", 0).await[0], state(16, "this program"));
    assert_eq!(before(one, "this program", 5).await[0], state(10, "this program"));
    store.writer().run(move |db| live_states::clear(db, one).boxed()).await.unwrap();
    assert_eq!(before(one, "this program", 0).await, []);
    assert_eq!(before(other, "another program", 5).await.len(), 3);
    // A visit that is taken back, by any caller and whether or not the walk is on this server now: it is in the states.
    let visit = Visit {
        id: Uuid::now_v7(),
        session_id: other,
        marker: "A1".into(),
        t_start_ns: 0,
        t_end_ns: 0,
        origin: visits::Origin::Keyed,
        keyed_shift_ns: 0,
        created_at: utc::now(),
        outcome: None,
    };
    let id = visit.id;
    let told = StreamVisit { visit, after_samples: 7, marker_position_m: (1.0, 2.0, None) };
    let tell = store.writer().run(move |db| {
        async move {
            visits::insert(&mut *db, &told.visit).await?;
            stream_visits::insert(&mut *db, &told).await
        }
        .boxed()
    });
    tell.await.unwrap();
    assert_eq!(before(other, "another program", 5).await.len(), 3);
    store.writer().run(move |db| async move { visits::delete(db, id).await }.boxed()).await.unwrap();
    assert_eq!(before(other, "another program", 0).await, []);
}

#[tokio::test]
async fn a_stream_is_found_over_stretches_and_parts_and_goes_with_its_session() {
    let (_folder, store) = store().await;
    let (one, other) = (session(&store).await, session_of(&store, "another").await);
    let record = |session_id, first_sequence: u64| {
        let of_stream = |stream, offset: u64| Samples {
            stream,
            first_sequence,
            sequences: 1,
            readings: Readings::Imu(vec![sample((2 * first_sequence + offset) as i64)]),
        };
        let raw = vec![of_stream(LEFT, 0), of_stream(RIGHT, 1)];
        Record { session_id, raw, ..Record::default() }
    };
    // As if others had written: the first records lie at the end of a stretch, the next at the end of a part.
    let others = [4_090, 4_096 * 3 - 3, (1 << 20) - 6, (1 << 21) + 5];
    for sequence in 0..16 {
        if sequence % 4 == 0 && cfg!(not(feature = "cluster")) {
            let last = others[sequence as usize / 4];
            let moved = store.writer().run(move |db| {
                Box::pin(async move {
                    let of_nobody =
                        "insert into stream_chunks values ($1, 'nobody', 'left', 0, 1, 0, 0, 2, x'', null)";
                    sqlx::query("delete from stream_chunks where session_id = 'nobody'")
                        .execute(&mut *db)
                        .await?;
                    sqlx::query(of_nobody).bind(last).execute(db).await?;
                    Ok::<_, StoreError>(())
                })
            });
            moved.await.unwrap();
        }
        store.writer().record(record(one, sequence)).await.unwrap();
        store.writer().record(record(other, sequence)).await.unwrap();
    }

    let db = store.read();
    for id in [one, other] {
        let both: Vec<Samples> = stream_chunks::as_received(db, id).try_collect().await.unwrap();
        let expected: Vec<Samples> = (0..16).flat_map(|sequence| record(id, sequence).raw).collect();
        assert_eq!(both, expected);
        for stream in BOTH {
            let of_stream: Vec<Samples> =
                expected.iter().filter(|chunk| chunk.stream == stream).cloned().collect();
            let read: Vec<Samples> = stream_chunks::of_stream(db, id, stream).try_collect().await.unwrap();
            assert_eq!(read, of_stream);
            assert_eq!(stream_chunks::next_sequence(db, id, stream).await.unwrap(), 16);
            let origin = Origin::Stream { session_id: id, stream };
            assert_eq!(raw_chunks::samples(db, origin).await.unwrap(), 16);
            assert_eq!(raw_chunks::next(db, origin, 5, 7).await.unwrap(), of_stream[5..12]);
            let (from_ns, to_ns) = (samples(&of_stream[3])[0].t_ns + 1, samples(&of_stream[13])[0].t_ns);
            let between = raw_chunks::sequences_between(db, origin, from_ns, to_ns).await.unwrap();
            assert_eq!(between, Some((3, 12)));
        }
    }

    let removed = store.writer().run(move |db| Box::pin(async move { sessions::delete(db, one).await }));
    assert!(removed.await.unwrap());
    let left: Vec<Samples> = stream_chunks::as_received(db, other).try_collect().await.unwrap();
    assert_eq!(left.len(), 32);
    let of_one = sqlx::query_scalar("select count(*) from stream_chunks where session_id = $1");
    let of_one: i64 = of_one.bind(one.to_string()).fetch_one(db).await.unwrap();
    assert_eq!(of_one, 0);
}

#[tokio::test]
async fn a_revision_corrects_what_is_stored_and_adds_nothing() {
    let (_folder, store) = store().await;
    let id = session(&store).await;
    let points = vec![point(0, 0.0), point(100, 1.0), point(200, 2.0)];
    let record = Record { session_id: id, points, ..Record::default() };
    store.writer().record(record).await.unwrap();
    let revised = vec![point(100, 1.5), point(150, 1.6), point(200, 2.5)];
    let record = Record { session_id: id, revised, ..Record::default() };
    store.writer().record(record).await.unwrap();
    assert_eq!(stored(&store, id).await, [point(0, 0.0), point(100, 1.5), point(200, 2.5)]);
}

#[tokio::test]
async fn a_batch_that_is_on_disk_already_is_refused_and_nothing_beside_it_is_kept() {
    let (_folder, store) = store().await;
    let id = session(&store).await;
    let raw =
        Samples { stream: LEFT, first_sequence: 4, sequences: 1, readings: Readings::Imu(vec![sample(0)]) };
    let first = Record { session_id: id, raw: vec![raw.clone()], ..Record::default() };
    store.writer().record(first).await.unwrap();
    let again = Record { session_id: id, raw: vec![raw], points: vec![point(0, 0.0)], ..Record::default() };
    assert!(store.writer().record(again).await.unwrap_err().is_duplicate());
    assert_eq!(stored(&store, id).await, []);
}

#[tokio::test]
async fn writes_that_fail_or_panic_take_nothing_else_with_them() {
    let (_folder, store) = store().await;
    let (first, second) = (inspector("first"), inspector("second"));
    let (half, writer) = (inspector("half"), store.writer());
    let (one, taken, panicked, two) = tokio::join!(
        add(&store, &first),
        add(&store, &first),
        writer.run(move |db| Box::pin(async move {
            inspectors::insert(db, &half).await?;
            if half.name == "half" {
                panic!("on purpose");
            }
            Ok::<_, StoreError>(())
        })),
        add(&store, &second),
    );
    one.unwrap();
    two.unwrap();
    assert!(taken.unwrap_err().is_duplicate());
    assert!(matches!(panicked, Err(StoreError::NotCommitted(_))), "{panicked:?}");
    assert_eq!(inspectors::list(store.read()).await.unwrap(), [first, second]);
}

#[tokio::test]
#[cfg(not(feature = "cluster"))]
async fn a_commit_that_fails_is_told_to_all_who_wait_and_the_next_one_works() {
    let (_folder, store) = store().await;
    let (lost, kept) = (inspector("lost"), inspector("kept"));
    let writer = store.writer();
    // A foreign key that is checked only at the commit makes the commit itself fail.
    let poison = writer.run(move |db| {
        Box::pin(async move {
            sqlx::query("pragma defer_foreign_keys = on").execute(&mut *db).await?;
            sqlx::query(
                "insert into faults (id, inspector_id, reported_at, kind, severity, created_at, updated_at)
                 values ('f', 'nobody', 0, 'x', 'low', 0, 0)",
            )
            .execute(db)
            .await?;
            Ok::<_, StoreError>(())
        })
    });
    // Both wait in the queue before the writer wakes: one group.
    let (poisoned, lost) = tokio::join!(biased; poison, add(&store, &lost));
    assert!(matches!(poisoned, Err(StoreError::NotCommitted(_))), "{poisoned:?}");
    assert!(matches!(lost, Err(StoreError::NotCommitted(_))), "{lost:?}");
    assert_eq!(writer.health(), Health::NotStored);
    add(&store, &kept).await.unwrap();
    assert_eq!(writer.health(), Health::Good);
    assert_eq!(inspectors::list(store.read()).await.unwrap(), [kept]);
}

#[tokio::test]
#[cfg(not(feature = "cluster"))]
async fn a_full_disk_is_told_to_all_who_wait_and_writing_goes_on_when_there_is_room() {
    let (_folder, store) = store().await;
    let (lost, kept) = (inspector("lost"), inspector("kept"));
    // As many pages as there are now. SQLite says of the next one what it says of a full disk.
    let large = Inspector { name: "x".repeat(1 << 20), ..inspector("large") };
    let writer = store.writer();
    let fill = writer.run(move |db| {
        Box::pin(async move {
            sqlx::query("pragma max_page_count = 1").execute(&mut *db).await?;
            inspectors::insert(db, &large).await
        })
    });
    let (filled, lost) = tokio::join!(biased; fill, add(&store, &lost));
    assert_eq!(filled.unwrap_err().disk(), Some(Disk::Full));
    assert!(matches!(lost, Err(StoreError::DiskFull)), "{lost:?}");
    assert_eq!(store.health(), Health::DiskFull);
    // The limit was that of the connection, which was given up. Room is found without anybody's asking.
    let mut health = writer.watch();
    health.wait_for(|health| *health == Health::Good).await.unwrap();
    add(&store, &kept).await.unwrap();
    assert_eq!(inspectors::list(store.read()).await.unwrap(), [kept]);
}

#[tokio::test]
async fn after_the_disk_has_failed_nothing_is_stored_until_the_next_start() {
    let (folder, store) = store().await;
    let (before, lost, late) = (inspector("before"), inspector("lost"), inspector("late"));
    add(&store, &before).await.unwrap();
    let fail =
        store.writer().run(|_| Box::pin(async { Err::<(), _>(StoreError::DiskFailed("on purpose".into())) }));
    let (failed, lost) = tokio::join!(biased; fail, add(&store, &lost));
    assert!(matches!(failed, Err(StoreError::DiskFailed(_))), "{failed:?}");
    assert!(matches!(lost, Err(StoreError::DiskFailed(_))), "{lost:?}");
    store.disk_failed().await;
    assert!(matches!(add(&store, &late).await, Err(StoreError::DiskFailed(_))));
    store.close().await;

    // The next start, on the files as they were left: the log is still there, and is read.
    let next = if cfg!(feature = "cluster") { folder } else { copied(&folder) };
    let again = Store::open(&next.path().join("test.db"), 1).await.unwrap();
    assert_eq!(inspectors::list(again.read()).await.unwrap(), [before]);
}

fn copied(folder: &TempDir) -> TempDir {
    let next = TempDir::new().unwrap();
    for file in ["test.db", "test.db-wal"] {
        std::fs::copy(folder.path().join(file), next.path().join(file)).unwrap();
    }
    next
}

#[tokio::test]
async fn what_waits_is_written_before_the_store_closes_and_later_writes_are_refused() {
    let (folder, store) = store().await;
    let (early, late) = (inspector("early"), inspector("late"));
    let (added, ()) = tokio::join!(biased; add(&store, &early), store.close());
    added.unwrap();
    assert!(matches!(add(&store, &late).await, Err(StoreError::Stopped)));
    let again = Store::open(&folder.path().join("test.db"), 1).await.unwrap();
    assert_eq!(inspectors::list(again.read()).await.unwrap(), [early]);
}

#[tokio::test]
async fn readers_cannot_write() {
    let (_folder, store) = store().await;
    assert!(inspectors::insert(store.read(), &inspector("x")).await.is_err());
}

#[tokio::test]
async fn a_newer_database_is_refused_with_a_sentence() {
    let (folder, store) = store().await;
    store
        .writer()
        .run(|db| {
            Box::pin(async move {
                sqlx::query(
                    "insert into _sqlx_migrations (version, description, success, checksum, execution_time)
                     values (999, 'from the future', true, $1, 0)",
                )
                .bind(vec![0_u8])
                .execute(db)
                .await?;
                Ok::<_, StoreError>(())
            })
        })
        .await
        .unwrap();
    store.close().await;
    let refused = Store::open(&folder.path().join("test.db"), 1).await.unwrap_err().to_string();
    assert!(refused.contains("newer Lodestep") && refused.contains("step 999"), "{refused}");
}

#[tokio::test]
async fn a_damaged_chunk_is_named_and_never_taken_for_samples() {
    let (_folder, store) = store().await;
    let id = session(&store).await;
    let raw =
        Samples { stream: LEFT, first_sequence: 0, sequences: 1, readings: Readings::Imu(vec![sample(0)]) };
    store.writer().record(Record { session_id: id, raw: vec![raw], ..Record::default() }).await.unwrap();
    store
        .writer()
        .run(|db| {
            Box::pin(async move {
                sqlx::query("update stream_chunks set body = $1")
                    .bind(vec![0x28_u8, 0xb5, 0x2f, 0xfd, 0])
                    .execute(db)
                    .await?;
                Ok::<_, StoreError>(())
            })
        })
        .await
        .unwrap();
    let read: Result<Vec<Samples>, _> = stream_chunks::of_stream(store.read(), id, LEFT).try_collect().await;
    assert!(matches!(read, Err(StoreError::Damaged { .. })), "{read:?}");
}

#[tokio::test]
async fn a_delivery_waits_no_longer_than_the_longest_pause_though_the_clock_was_ahead() {
    let (_folder, store) = store().await;
    let (now, far) = (utc::now(), utc::now() + time::Duration::days(3_650));
    let sql = format!(
        "insert into webhooks (id, name, url, secret, events, enabled, version, created_at, updated_at)
            values ('{id}', 'pager', 'http://127.0.0.1:9/', 'a secret', '[\"fault.reported\"]', true, 1, 0, 0);
         insert into webhook_deliveries (webhook_id, event_id, event, body, state, tries, next_at, created_at)
            values ('{id}', '{id}', 'fault.reported', '{{}}', 'waiting', 1, {far}, 0)",
        id = Uuid::nil(),
        far = utc::to_us(far),
    );
    let insert = store.writer().run(move |db| {
        async move {
            sqlx::raw_sql(sqlx::AssertSqlSafe(sql)).execute(db).await?;
            Ok::<_, StoreError>(())
        }
        .boxed()
    });
    insert.await.unwrap();
    let latest = now + time::Duration::hours(4);
    let moved = store
        .writer()
        .run(move |db| async move { webhook_deliveries::wait_until_at_most(db, latest).await }.boxed());
    assert_eq!(moved.await.unwrap(), 1);
    assert_eq!(webhook_deliveries::due(store.read(), latest).await.unwrap(), [Uuid::nil()]);
}
