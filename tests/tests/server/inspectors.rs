//! The people who walk.

use lodestep_tests::server::TestServer;
use serde_json::{Value, json};

async fn create(server: &TestServer, name: &str) -> (u16, Value) {
    let answer =
        server.client.post(server.api("/inspectors")).json(&json!({ "name": name })).send().await.unwrap();
    (answer.status().as_u16(), answer.json().await.unwrap())
}

#[tokio::test]
async fn an_inspector_is_added_renamed_and_removed() {
    let server = TestServer::start().await;
    let (status, added) = create(&server, " 王芳 ").await;
    assert_eq!((status, added["name"].as_str()), (201, Some("王芳")));
    let path = server.api(&format!("/inspectors/{}", added["id"].as_str().unwrap()));

    let renamed = server.client.patch(&path).json(&json!({ "name": "王方" })).send().await.unwrap();
    assert_eq!(renamed.json::<Value>().await.unwrap()["name"], "王方");

    let all: Value = server.client.get(server.api("/inspectors")).send().await.unwrap().json().await.unwrap();
    assert_eq!(all.as_array().unwrap().len(), 1);

    assert_eq!(server.client.delete(&path).send().await.unwrap().status(), 204);
    let gone = server.client.get(&path).send().await.unwrap();
    assert_eq!(gone.status(), 404);
    assert_eq!(gone.headers()["content-type"], "application/problem+json");
    assert_eq!(gone.json::<Value>().await.unwrap()["code"], "inspector_not_found");
}

#[tokio::test]
async fn a_name_that_another_has_is_a_conflict() {
    let server = TestServer::start().await;
    create(&server, "Li Na").await;
    let (status, problem) = create(&server, "Li Na").await;
    assert_eq!((status, problem["code"].as_str()), (409, Some("name_taken")));
}

#[tokio::test]
async fn what_was_acknowledged_is_there_after_a_restart() {
    let server = TestServer::start().await;
    let (_, added) = create(&server, "Chen Wei").await;
    let server = server.restart().await;
    let all: Value = server.client.get(server.api("/inspectors")).send().await.unwrap().json().await.unwrap();
    assert_eq!(all, json!([added]));
}
