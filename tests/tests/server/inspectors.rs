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

#[tokio::test]
async fn an_instrument_is_a_carrier_of_its_own_kind_and_does_not_walk() {
    let server = TestServer::start().await;
    let (status, cabin) = server.post("/inspectors", &json!({"name": "Feed cabin", "kind": "cabin"})).await;
    assert_eq!((status, &cabin["kind"]), (201, &json!("cabin")));
    let (_, person) = server.post("/inspectors", &json!({"name": "Li Na"})).await;
    assert_eq!(person["kind"], "person", "clients of earlier releases name no kind");
    let (status, problem) = server.post("/inspectors", &json!({"name": "Drone", "kind": "drone"})).await;
    assert_eq!((status, &problem["code"]), (422, &json!("wrong_kind")));
    assert!(problem["detail"].as_str().unwrap().contains("person, instrument, cabin"), "{problem}");

    let walk = json!({"inspector_id": cabin["id"]});
    let (status, problem) = server.post("/sessions", &walk).await;
    assert_eq!((status, &problem["code"]), (409, &json!("carrier_of_another_kind")));
    let of_fixes = |carrier: &Value| json!({"inspector_id": carrier["id"], "system": "fixes"});
    assert_eq!(server.post("/sessions", &of_fixes(&cabin)).await.0, 409);
    let (status, session) = server.post("/sessions", &of_fixes(&person)).await;
    assert_eq!(status, 201, "a person may carry the instrument: {session}");

    // Nor is a walk given to it afterwards.
    let path = format!("/sessions/{}", session["id"].as_str().unwrap());
    let answer = server.client.patch(server.api(&path)).json(&walk).send().await.unwrap();
    assert_eq!(answer.status(), 409);
    assert_eq!(answer.json::<Value>().await.unwrap()["code"], "carrier_of_another_kind");
    let server = server.restart().await;
    let (_, all) = server.get("/inspectors").await;
    assert_eq!(all, json!([cabin, person]));
}
