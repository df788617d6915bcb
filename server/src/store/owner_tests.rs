//! A server whose database another has taken over writes nothing any more.

use futures_util::FutureExt;
use uuid::Uuid;

use super::health::Health;
use super::inspectors::{self, Inspector};
use super::tests::store;
use super::{Record, Store, StoreError};
use crate::utc;

async fn add(store: &Store, name: &str) -> Result<(), StoreError> {
    let row = Inspector {
        id: Uuid::now_v7(),
        name: name.into(),
        kind: inspectors::person(),
        created_at: utc::now(),
    };
    store.writer().run(move |db| async move { inspectors::insert(db, &row).await }.boxed()).await
}

#[tokio::test]
async fn the_last_server_to_take_a_database_over_writes_and_the_one_before_is_refused() {
    let (folder, before) = store().await;
    let after = Store::open(&folder.path().join("test.db"), 1).await.unwrap();
    before.take_over().await.unwrap();
    add(&before, "kept").await.unwrap();
    // Who only looks, or makes an account, takes nothing over.
    add(&after, "beside").await.unwrap();
    add(&before, "kept too").await.unwrap();

    after.take_over().await.unwrap();
    let refused = add(&before, "stale").await.unwrap_err();
    assert!(refused.is_passing() && refused.to_string().contains("taken this database over"), "{refused}");
    assert!(before.writer().record(Record::default()).await.is_err());
    assert_eq!(before.health(), Health::NotStored);
    add(&after, "new").await.unwrap();
    let names = inspectors::list(after.read()).await.unwrap();
    let names: Vec<&str> = names.iter().map(|inspector| inspector.name.as_str()).collect();
    assert_eq!(names, ["beside", "kept", "kept too", "new"]);
}
