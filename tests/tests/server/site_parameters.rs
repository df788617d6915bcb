//! A set of parameters made the site's: all that is computed from then on uses it, and says so.

use lodestep_tests::server::TestServer;
use lodestep_tests::staff::server_with_staff;
use reqwest::Method;
use serde_json::{Value, json};

use super::lab::{by_command_line, handed_in, run};

async fn digest(server: &TestServer, session_id: &str) -> Value {
    server.look(&format!("/sessions/{session_id}")).await.body["track_sha256"].clone()
}

/// Where the walk's own track comes from.
async fn provenance(server: &TestServer, session_id: &str) -> Value {
    let compared = server.look(&format!("/lab/comparison?session_ids={session_id}")).await.body;
    compared["rows"][0]["provenance"].clone()
}

/// Every epoch, which is computed for the answer.
async fn whole_track(server: &TestServer, session_id: &str) -> Value {
    let told = server.look(&format!("/sessions/{session_id}/track?rate_hz=full")).await;
    assert_eq!(told.status, 200, "{told:?}");
    told.body
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_processed_uses_the_site_s_parameters_as_the_command_line_does_to_the_last_bit() {
    let server = TestServer::start().await;
    let session_id = handed_in(&server).await;
    server.process(&session_id).await;
    let by_default = digest(&server, &session_id).await;
    assert_eq!(provenance(&server, &session_id).await["parameter_set"], Value::Null);
    let whole_by_default = whole_track(&server, &session_id).await;

    let values = json!({ "marker_sigma_m": 0.1, "stance.threshold": 12.5, "imu_noise.height_random_walk_m_sqrt_s": 0.1 });
    let set = server.choose_parameters(&values).await;
    // What stands is told as it was computed, until it is computed again.
    assert_eq!(whole_track(&server, &session_id).await, whole_by_default);
    server.process(&session_id).await;
    let firm = digest(&server, &session_id).await;
    assert_ne!(firm, by_default);
    let from = provenance(&server, &session_id).await;
    assert_eq!(from["parameters"], values);
    assert_eq!(from["parameter_set"], json!({ "id": set["id"], "name": set["name"], "version": 1 }));

    let file = server.client.get(server.api("/lab/site-parameters.json")).send().await.unwrap();
    let (report, track) = by_command_line(&server, &file.bytes().await.unwrap(), &[]).await;
    assert_eq!((&report["track_sha256"], &report["parameters"]), (&firm, &values));
    let stored = server.client.get(server.api(&format!("/sessions/{session_id}/track.csv")));
    assert!(
        stored.send().await.unwrap().text().await.unwrap() == track,
        "the stored track differs from the file"
    );

    // A lab run says itself what it is computed with: nothing means the defaults.
    let plain = run(&server, json!({ "session_ids": [session_id] })).await;
    assert_eq!(plain["provenance"]["track_sha256"], by_default);

    // Another version of the set is not the site's; nor is a removed one lost.
    let path = format!("/lab/parameter-sets/{}", set["id"].as_str().unwrap());
    let changed = json!({ "name": set["name"], "parameters": { "marker_sigma_m": 5.0 }, "version": 1 });
    assert_eq!(server.put(&path, &changed).await.0, 200);
    assert_eq!(server.delete(&path).await.0, 204);
    let server = server.restart().await;
    server.process(&session_id).await;
    assert_eq!(digest(&server, &session_id).await, firm);

    let whole_firm = whole_track(&server, &session_id).await;
    assert_ne!(whole_firm, whole_by_default);
    let (status, held) = server.put("/lab/site-parameters", &json!({ "parameter_set_id": null })).await;
    assert_eq!((status, &held["set"], &held["parameters"]), (200, &Value::Null, &json!({})));
    assert_eq!(whole_track(&server, &session_id).await, whole_firm);
    server.process(&session_id).await;
    assert_eq!(digest(&server, &session_id).await, by_default);
}

#[tokio::test]
async fn engineers_choose_with_the_version_they_saw_and_the_log_says_who() {
    let (server, staff) = server_with_staff().await;
    let person = |name: &str| staff.iter().find(|person| person.name == name).unwrap();
    let (engineer, surveyor, admin) = (person("engineer"), person("surveyor"), person("admin"));
    let path = "/lab/site-parameters";
    let set = json!({ "name": "firm", "parameters": { "marker_sigma_m": 0.1 } });
    let set = engineer.ask(&server, Method::POST, "/lab/parameter-sets", &set).await;
    let choice = |version: Value| json!({ "parameter_set_id": set.id(), "version": version });
    assert_eq!(surveyor.ask(&server, Method::PUT, path, &choice(json!(1))).await.status, 403);
    for seen in [json!(7), Value::Null] {
        let late = engineer.ask(&server, Method::PUT, path, &choice(seen)).await;
        assert_eq!(
            (late.status, late.code(), &late.body["current"]["version"]),
            (409, "set_changed", &json!(1))
        );
    }
    let nobody_s = json!({ "parameter_set_id": uuid::Uuid::nil(), "version": 1 });
    assert_eq!(engineer.ask(&server, Method::PUT, path, &nobody_s).await.status, 404);
    assert_eq!(surveyor.get(&server, path).await.body["set"], Value::Null);

    let chosen = engineer.ask(&server, Method::PUT, path, &choice(json!(1))).await;
    assert_eq!((chosen.status, chosen.body["chosen_by"].as_str()), (200, Some("engineer")));
    // Chosen once more it is the same choice.
    assert_eq!(engineer.ask(&server, Method::PUT, path, &choice(json!(1))).await.body, chosen.body);
    assert_eq!(surveyor.get(&server, path).await.body, chosen.body);
    let log = admin.get(&server, "/audit?action=site_parameters").await.body;
    assert_eq!(log.as_array().unwrap().len(), 1, "{log}");
    assert_eq!((&log[0]["before"]["set"], &log[0]["after"]["set"]["name"]), (&Value::Null, &json!("firm")));
    assert_eq!(log[0]["who"], "engineer");
}
