//! What SQLite and PostgreSQL do differently without saying so, each held to be the same. The tests run on whichever database the
//! program was built for (docs/cluster.md).

use futures_util::FutureExt;
use lodestep_engine::anomaly::{Anomaly, AnomalyKind};
use uuid::Uuid;

use super::anomalies::{self, Gathered};
use super::inspectors::{self, Inspector};
use super::session_search::{self, Sort, Wanted};
use super::tests::{session_of, store};
use super::{Store, StoreError, audit, sessions};
use crate::utc;

async fn walkers(store: &Store, names: &[&str]) {
    for name in names {
        session_of(store, name).await;
    }
}

async fn found(store: &Store, wanted: Wanted) -> Vec<String> {
    let page = session_search::page(store.read(), &Wanted { limit: 100, ..wanted }).await.unwrap();
    page.sessions.into_iter().map(|found| found.inspector).collect()
}

#[tokio::test]
async fn what_is_looked_for_is_found_in_either_case_of_the_letters_a_to_z_and_of_no_others() {
    let (_folder, store) = store().await;
    walkers(&store, &["Li Na", "Ärger"]).await;
    let text = |text: &str| Wanted { text: Some(text.into()), ..Wanted::default() };
    assert_eq!(found(&store, text("li na")).await, ["Li Na"]);
    assert_eq!(found(&store, text("LI")).await, ["Li Na"]);
    assert_eq!(found(&store, text("ÄRG")).await, ["Ärger"]);
    assert_eq!(found(&store, text("ärg")).await, [""; 0]);

    let entry = entry("Zhao Lei", "A17");
    let write = store.writer().run(move |db| async move { audit::insert(db, &entry).await }.boxed());
    write.await.unwrap();
    for who in ["zhao", "LEI"] {
        let wanted = audit::Wanted { who: Some(who.into()), limit: 9, ..audit::Wanted::default() };
        assert_eq!(audit::list(store.read(), &wanted).await.unwrap().len(), 1, "{who}");
    }
}

#[tokio::test]
async fn sums_are_whole_numbers_and_nothing_adds_up_to_nothing() {
    let (_folder, store) = store().await;
    let id = session_of(&store, "walker").await;
    assert_eq!(anomalies::count(store.read(), id).await.unwrap(), 0);
    let found = Anomaly {
        kind: AnomalyKind::GAP,
        stream: None,
        t_start_ns: 0,
        t_end_ns: 1,
        samples: 3,
        detail: "no samples".into(),
        figures: None,
    };
    let gathered = vec![Gathered { found: found.clone(), times: 2 }, Gathered { found, times: 1 << 40 }];
    let write = store.writer().run(move |db| {
        async move {
            anomalies::insert(&mut *db, id, &gathered).await?;
            // The last of its kind, and of no stream: null is equal to null here.
            anomalies::add_to_last(db, id, &gathered[0]).await
        }
        .boxed()
    });
    write.await.unwrap();
    assert_eq!(anomalies::count(store.read(), id).await.unwrap(), (1 << 40) + 4);
}

#[tokio::test]
async fn walks_without_a_value_come_last_whichever_way_they_are_ordered() {
    let (_folder, store) = store().await;
    walkers(&store, &["nothing yet", "closed"]).await;
    let closed = found(&store, Wanted { text: Some("closed".into()), ..Wanted::default() }).await;
    assert_eq!(closed, ["closed"]);
    let write = store.writer().run(|db| {
        async move {
            sqlx::query(
                "insert into session_reports (session_id, report)
                 select sessions.id, $1 from sessions join carriers on carriers.id = carrier_id where name = 'closed'",
            )
            .bind(r#"{"closure":{"end_error_m":25.5,"end_error_percent":1.25}}"#)
            .execute(db)
            .await?;
            Ok::<_, StoreError>(())
        }
        .boxed()
    });
    write.await.unwrap();
    for ascending in [true, false] {
        let wanted = Wanted { sort: Sort::Closure, ascending, ..Wanted::default() };
        assert_eq!(found(&store, wanted).await, ["closed", "nothing yet"], "{ascending}");
    }
    let page = session_search::page(store.read(), &Wanted { limit: 9, ..Wanted::default() }).await.unwrap();
    let large: Vec<_> = page.sessions.iter().map(|found| (found.closure_m, found.closure_is_large)).collect();
    assert!(large.contains(&(Some(25.5), true)) && large.contains(&(None, false)), "{large:?}");
}

#[tokio::test]
async fn a_number_that_is_none_is_refused_where_there_has_to_be_one() {
    let (_folder, store) = store().await;
    let id = session_of(&store, "walker").await;
    let write = store.writer().run(move |db| {
        async move {
            sqlx::query("update sessions set distance_m = $2 where id = $1")
                .bind(id.to_string())
                .bind(f64::NAN)
                .execute(db)
                .await?;
            Ok::<_, StoreError>(())
        }
        .boxed()
    });
    assert!(write.await.is_err());
    let session = sessions::get(store.read(), id).await.unwrap().unwrap();
    assert_eq!(session.distance_m, 0.0);
}

#[tokio::test]
async fn names_are_ordered_by_their_bytes() {
    let (_folder, store) = store().await;
    for name in ["b", "a b", "ab", "B", "Ä", "张伟", "a-c"] {
        let row = Inspector {
            id: Uuid::now_v7(),
            name: name.into(),
            kind: inspectors::person(),
            created_at: utc::now(),
        };
        let write = store.writer().run(move |db| async move { inspectors::insert(db, &row).await }.boxed());
        write.await.unwrap();
    }
    let told = inspectors::list(store.read()).await.unwrap();
    let told: Vec<&str> = told.iter().map(|inspector| inspector.name.as_str()).collect();
    assert_eq!(told, ["B", "a b", "a-c", "ab", "b", "Ä", "张伟"]);
}

#[tokio::test]
async fn numbers_that_a_table_gives_follow_the_order_of_the_writes_one_after_the_other() {
    let (_folder, store) = store().await;
    for subject in 0..20 {
        let (kept, back) = (entry("somebody", &subject.to_string()), entry("nobody", "taken back"));
        let write = store.writer().run(move |db| async move { audit::insert(db, &kept).await }.boxed());
        write.await.unwrap();
        // One that is taken back may leave a number out, and never one behind.
        let back = store.writer().run(move |db| {
            async move {
                audit::insert(db, &back).await?;
                Err::<(), _>(StoreError::NotCommitted("on purpose".into()))
            }
            .boxed()
        });
        assert!(back.await.is_err());
    }
    let told =
        audit::list(store.read(), &audit::Wanted { limit: 99, ..audit::Wanted::default() }).await.unwrap();
    let subjects: Vec<String> = told.iter().map(|entry| entry.subject.clone()).collect();
    assert_eq!(subjects, (0..20).rev().map(|subject| subject.to_string()).collect::<Vec<_>>());
    assert!(told.windows(2).all(|pair| pair[0].id > pair[1].id));
}

fn entry(who: &str, subject: &str) -> audit::Entry {
    audit::Entry {
        id: 0,
        at: utc::now(),
        account_id: None,
        who: who.into(),
        address: String::new(),
        action: "marker.moved".into(),
        subject: subject.into(),
        before: None,
        after: None,
    }
}
