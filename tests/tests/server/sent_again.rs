//! What a page without a link kept, and sends once more because an answer was lost: it makes nothing new, and
//! what was said by mistake is taken back.

use lodestep_tests::hand_in::ask;
use lodestep_tests::server::TestServer;
use serde_json::{Value, json};
use uuid::Uuid;

async fn post(server: &TestServer, path: &str, body: &Value) -> (u16, Value) {
    let answer = ask(server.client.post(server.api(path)).json(body)).await;
    (answer.status, answer.body)
}

#[tokio::test]
async fn a_walk_and_a_fault_that_bring_their_id_are_made_once() {
    let server = TestServer::start().await;
    let inspector_id = server.inspector().await;
    let walk =
        json!({ "id": Uuid::now_v7(), "inspector_id": inspector_id, "started_at": "2026-05-01T01:00:00Z" });
    let (made, first) = post(&server, "/sessions", &walk).await;
    let (again, second) = post(&server, "/sessions", &walk).await;
    assert_eq!((made, again, &first["id"]), (201, 200, &walk["id"]));
    assert_eq!(first, second);
    assert_eq!(server.look("/sessions").await.body.as_array().unwrap().len(), 1);
    let mut other = walk.clone();
    other["inspector_id"] = json!(server.inspector().await);
    let (refused, problem) = post(&server, "/sessions", &other).await;
    assert_eq!((refused, problem["code"].as_str()), (409, Some("id_taken")));

    let fault =
        json!({ "id": Uuid::now_v7(), "inspector_id": inspector_id, "kind": "drainage", "severity": "low" });
    let (made, first) = post(&server, "/faults", &fault).await;
    let (again, second) = post(&server, "/faults", &fault).await;
    assert_eq!((made, again, &first["id"]), (201, 200, &fault["id"]));
    assert_eq!(first, second);
    assert_eq!(server.look("/faults").await.body.as_array().unwrap().len(), 1);
}

#[tokio::test]
async fn a_visit_is_told_once_and_taken_back() {
    let server = TestServer::start().await;
    let marker = json!({ "name": "A17", "e_m": 1.0, "n_m": 2.0, "u_m": 0.0 });
    assert_eq!(post(&server, "/markers", &marker).await.0, 201);
    let session_id = server.session(json!({})).await;
    let path = format!("/sessions/{session_id}/visits");
    let visit = json!({ "marker": "A17", "t_start_s": 56.123, "t_end_s": 60.0 });
    let (made, first) = post(&server, &path, &visit).await;
    let (again, second) = post(&server, &path, &visit).await;
    assert_eq!(
        (made, again, first["added"].as_u64(), second["unchanged"].as_u64()),
        (201, 200, Some(1), Some(1))
    );
    assert_eq!(first["visits"], second["visits"]);

    let visit_path = format!("{path}/{}", first["visits"][0]["id"].as_str().unwrap());
    assert_eq!(ask(server.client.delete(server.api(&visit_path))).await.status, 204);
    assert_eq!(server.look(&path).await.body, json!([]));
    let gone = ask(server.client.delete(server.api(&visit_path))).await;
    assert_eq!((gone.status, gone.code()), (404, "visit_not_found"));
    // It may be said again.
    assert_eq!(post(&server, &path, &visit).await.0, 201);
}
