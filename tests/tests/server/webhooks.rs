//! Other programs are told of faults and anomalies, signed, over failures and restarts.

use std::process::{Command, Stdio};
use std::time::Duration;

use lodestep_engine::geo::Site;
use lodestep_engine::sim::pedestrian::{SensorModel, WalkKind, simulate};
use lodestep_tests::hand_in::{Answer, ask, log};
use lodestep_tests::receiver::TestReceiver;
use lodestep_tests::server::TestServer;
use serde_json::{Value, json};

/// A server that does not wait long between two tries.
async fn server() -> TestServer {
    TestServer::start_with(|config| config.webhook_retry_s = 0.02).await
}

async fn register(server: &TestServer, url: &str, events: &[&str]) -> Answer {
    let body = json!({ "name": "tickets", "url": url, "events": events });
    let made = ask(server.client.post(server.api("/webhooks")).json(&body)).await;
    assert_eq!(made.status, 201, "{made:?}");
    made
}

async fn report(server: &TestServer, text: &str) -> String {
    let inspector_id = server.inspector().await;
    let fault =
        json!({ "inspector_id": inspector_id, "kind": "hydraulic_leak", "severity": "high", "text": text });
    let made = ask(server.client.post(server.api("/faults")).json(&fault)).await;
    assert_eq!(made.status, 201, "{made:?}");
    made.id().to_owned()
}

/// The deliveries, once none of them waits.
async fn settled(server: &TestServer, hook_id: &str) -> Vec<Value> {
    loop {
        let all = server.look(&format!("/webhooks/{hook_id}/deliveries")).await.body;
        let all = all.as_array().unwrap().clone();
        if all.iter().all(|delivery| delivery["state"] != "waiting") {
            return all;
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

#[tokio::test]
async fn a_fault_is_told_signed_as_the_page_of_webhooks_checks_it() {
    let (server, receiver) = (server().await, TestReceiver::start().await);
    let hook = register(&server, &receiver.url, &["fault.reported", "fault.changed"]).await;
    let secret = hook.body["secret"].as_str().unwrap().to_owned();
    let fault_id = report(&server, "drips ‘much’").await;
    let patch = json!({ "state": "acknowledged", "comment": "seen" });
    let patched = ask(server.client.patch(server.api(&format!("/faults/{fault_id}"))).json(&patch)).await;
    assert_eq!(patched.status, 200, "{patched:?}");

    let posted = receiver.wait_for(2).await;
    let bodies: Vec<Value> =
        posted.iter().map(|posted| serde_json::from_str(&posted.body).unwrap()).collect();
    assert_eq!(
        (bodies[0]["event"].as_str(), bodies[1]["event"].as_str()),
        (Some("fault.reported"), Some("fault.changed"))
    );
    assert_eq!(bodies[0]["data"]["id"], fault_id);
    assert_eq!(bodies[0]["data"]["text"], "drips ‘much’");
    assert_eq!(bodies[1]["data"]["fault"]["state"], "acknowledged");
    assert_eq!(bodies[1]["data"]["changed"]["before"]["state"], "open");
    assert_eq!(posted[0].header("lodestep-event"), Some("fault.reported"));
    assert_eq!(posted[0].header("lodestep-event-id"), bodies[0]["id"].as_str());
    assert_eq!(posted[0].header("content-type"), Some("application/json"));

    // By the very lines that the documentation gives, where there is a Python to run them.
    let page = include_str!("../../../docs/webhooks.md");
    let code = page.split("```python\n").nth(1).unwrap().split("```").next().unwrap();
    for (key, good) in [(&secret[..], "True"), ("another secret", "False")] {
        let signature = posted[0].header("lodestep-signature").unwrap();
        let script =
            format!("{code}\nimport sys\nprint(is_ours({key:?}, {signature:?}, sys.stdin.buffer.read()))");
        let python = Command::new("python3")
            .args(["-c", &script])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn();
        let Ok(mut python) = python else { break };
        std::io::Write::write_all(&mut python.stdin.take().unwrap(), posted[0].body.as_bytes()).unwrap();
        let output = python.wait_with_output().unwrap();
        assert_eq!(String::from_utf8_lossy(&output.stdout).trim(), good);
    }
    assert!(settled(&server, hook.id()).await.iter().all(|delivery| delivery["status"] == 204));
    // The secret was shown once.
    let shown =
        server.look("/webhooks").await.body.to_string() + &server.look("/audit").await.body.to_string();
    assert!(!shown.contains(&secret), "{shown}");
}

#[tokio::test]
async fn what_is_refused_is_sent_again_until_it_arrives_and_a_redirect_is_not_followed() {
    let (server, receiver, elsewhere) =
        (server().await, TestReceiver::start().await, TestReceiver::start().await);
    receiver.answer_with(&["503 Service Unavailable", &format!("302 Found\r\nLocation: {}", elsewhere.url)]);
    let hook = register(&server, &receiver.url, &["fault.reported"]).await;
    report(&server, "once").await;
    let deliveries = settled(&server, hook.id()).await;
    assert_eq!((deliveries.len(), deliveries[0]["tries"].as_u64()), (1, Some(3)));
    let posted = receiver.posted();
    assert!(posted.iter().all(|again| again.body == posted[0].body), "{posted:?}");
    assert_eq!(elsewhere.posted().len(), 0);
    let hook = server.look(&format!("/webhooks/{}", hook.id())).await.body;
    assert_eq!((hook["enabled"].as_bool(), hook["failing_since"].is_null()), (Some(true), true));
}

#[tokio::test]
async fn what_waits_is_delivered_after_a_restart() {
    let server = server().await;
    // Nobody listens there.
    let gone = TestReceiver::start().await;
    let url = gone.url.clone();
    drop(gone);
    let hook = register(&server, &url, &["fault.reported"]).await;
    report(&server, "first").await;
    loop {
        let waiting = server.look(&format!("/webhooks/{}/deliveries", hook.id())).await.body;
        if waiting[0]["tries"].as_u64() > Some(0) {
            assert!(waiting[0]["status"].is_null(), "{waiting}");
            assert!(waiting[0]["answer"].as_str().unwrap().len() > 5, "{waiting}");
            break;
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    let failing = server.look(&format!("/webhooks/{}", hook.id())).await.body;
    assert!(!failing["failing_since"].is_null(), "{failing}");
    let server = server.restart().await;
    let receiver = TestReceiver::start().await;
    let change = json!({ "url": receiver.url, "version": failing["version"] });
    let changed =
        ask(server.client.patch(server.api(&format!("/webhooks/{}", hook.id()))).json(&change)).await;
    assert_eq!(changed.status, 200, "{changed:?}");
    // After a restart the pauses are those of every day: by hand it goes at once.
    let number = server.look(&format!("/webhooks/{}/deliveries", hook.id())).await.body[0]["id"].clone();
    let again = format!("/webhooks/{}/deliveries/{number}/again", hook.id());
    assert_eq!(ask(server.client.post(server.api(&again))).await.status, 202);
    let posted = receiver.wait_for(1).await;
    assert!(posted[0].body.contains("first"), "{posted:?}");
    assert_eq!(settled(&server, hook.id()).await[0]["state"], "delivered");
}

#[tokio::test]
async fn who_never_answers_is_switched_off_and_what_waits_is_kept() {
    let server = TestServer::start_with(|config| {
        config.webhook_retry_s = 0.01;
        config.webhook_give_up_s = 0.05;
    })
    .await;
    let receiver = TestReceiver::start().await;
    receiver.answer_with(&["500 Internal Server Error"; 40]);
    let made = register(&server, &receiver.url, &["fault.reported"]).await;
    report(&server, "one").await;
    let path = format!("/webhooks/{}", made.id());
    let hook = loop {
        let hook = server.look(&path).await.body;
        if hook["enabled"] == false {
            break hook;
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    };
    assert!(hook["disabled_why"].as_str().unwrap().contains("the last answer was 500"), "{hook}");
    let log = server.look("/audit?action=webhook.disabled").await.body;
    assert_eq!((log[0]["who"].as_str(), log[0]["subject"].as_str()), (Some("webhooks"), Some(made.id())));
    let refused = ask(server.client.post(server.api(&format!("{path}/test")))).await;
    assert_eq!((refused.status, refused.code()), (409, "webhook_disabled"));
    let late = json!({ "enabled": true, "version": 1 });
    assert_eq!(ask(server.client.patch(server.api(&path)).json(&late)).await.code(), "webhook_changed");
    let on = json!({ "enabled": true, "version": hook["version"] });
    let on = ask(server.client.patch(server.api(&path)).json(&on)).await.body;
    assert_eq!((on["enabled"].as_bool(), on["disabled_why"].is_null()), (Some(true), true));
}

#[tokio::test]
async fn what_alone_is_refused_is_given_up_and_the_others_arrive() {
    let server = TestServer::start_with(|config| {
        config.webhook_retry_s = 0.001;
        // Long enough for the other one to arrive meanwhile, on whatever machine.
        config.webhook_give_up_s = 5.0;
    })
    .await;
    let receiver = TestReceiver::start().await;
    receiver.refuse("unwanted");
    let hook = register(&server, &receiver.url, &["fault.reported"]).await;
    report(&server, "unwanted").await;
    report(&server, "welcome").await;
    let deliveries = settled(&server, hook.id()).await;
    let states: Vec<_> = deliveries.iter().map(|delivery| delivery["state"].as_str().unwrap()).collect();
    assert_eq!(states, ["delivered", "failed"]);
    assert_eq!(deliveries[1]["status"], 422);
    let hook = server.look(&format!("/webhooks/{}", hook.id())).await.body;
    assert_eq!((hook["enabled"].as_bool(), hook["failing_since"].is_null()), (Some(true), true));
}

#[tokio::test]
async fn anomalies_are_told_once_however_often_the_walk_is_worked_out() {
    let (server, receiver) = (server().await, TestReceiver::start().await);
    let hook = register(&server, &receiver.url, &["anomalies.found"]).await;
    let walk = simulate(&WalkKind::Line { metres: 20.0 }, 8, &Site::fast(), &SensorModel::cmp10a());
    let session_id = server.session(json!({})).await;
    assert_eq!(server.hand_in(&session_id, "left", log(&walk.left)).await.body["state"], "accepted");
    assert_eq!(server.process(&session_id).await["state"], "finished");
    let posted = receiver.wait_for(1).await;
    let told: Value = serde_json::from_str(&posted[0].body).unwrap();
    assert_eq!(told["data"]["session_id"], session_id);
    let found = server.look(&format!("/sessions/{session_id}/anomalies")).await.body;
    assert_eq!(told["data"]["count"].as_u64(), Some(found.as_array().unwrap().len() as u64));
    let named = told["data"]["anomalies"].as_array().unwrap();
    assert!(named.iter().all(|named| found.as_array().unwrap().contains(named)), "{named:?} {found}");
    assert!(found.as_array().unwrap().iter().any(|found| found["anomaly"] == "foot_missing"), "{found}");

    server.process(&session_id).await;
    // What follows is told after what came before.
    let test = ask(server.client.post(server.api(&format!("/webhooks/{}/test", hook.id())))).await;
    assert_eq!(test.status, 202);
    let posted = receiver.wait_for(2).await;
    assert!(posted[1].body.contains("\"event\":\"test\""), "{posted:?}");
}

#[tokio::test]
async fn a_webhook_that_cannot_be_is_refused_in_a_sentence() {
    let server = server().await;
    let refused = async |url: &str, events: Value| {
        let body = json!({ "name": "x", "url": url, "events": events });
        ask(server.client.post(server.api("/webhooks")).json(&body)).await
    };
    assert_eq!(refused("ftp://a/b", json!(["fault.reported"])).await.code(), "wrong_url");
    assert_eq!(refused("http://me:secret@a/b", json!(["fault.reported"])).await.code(), "wrong_url");
    assert_eq!(refused("http://a/b", json!([])).await.code(), "wrong_events");
    assert_eq!(refused("http://a/b", json!(["test"])).await.code(), "wrong_events");
    assert_eq!(refused("http://a/b", json!(["everything"])).await.code(), "wrong_field");
}
