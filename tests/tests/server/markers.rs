//! Surveyed anchors: one by one and by file.

use lodestep_tests::server::TestServer;
use serde_json::{Value, json};

async fn import(server: &TestServer, file: impl Into<Vec<u8>>) -> (u16, Value) {
    let request = server.client.post(server.api("/markers/import")).header("content-type", "text/csv");
    let answer = request.body(file.into()).send().await.unwrap();
    (answer.status().as_u16(), answer.json().await.unwrap())
}

async fn export(server: &TestServer) -> String {
    server.client.get(server.api("/markers.csv")).send().await.unwrap().text().await.unwrap()
}

#[tokio::test]
async fn a_marker_is_added_moved_and_removed() {
    let server = TestServer::start().await;
    let (status, made) = server.post("/markers", &json!({ "name": "A17", "e_m": 1.0, "n_m": 2.0 })).await;
    assert_eq!((status, &made["u_m"]), (201, &Value::Null));
    let again = server.post("/markers", &json!({ "name": "A17", "e_m": 9.0, "n_m": 9.0 })).await;
    assert_eq!((again.0, again.1["code"].as_str()), (409, Some("marker_exists")));

    let body = json!({ "e_m": 1.5, "n_m": 2.0, "u_m": 0.25, "version": made["version"] });
    let (status, moved) = server.put("/markers/A17", &body).await;
    assert_eq!((status, &moved["e_m"], &moved["u_m"]), (200, &json!(1.5), &json!(0.25)));
    assert_eq!(moved["created_at"], made["created_at"]);
    assert_eq!(server.put("/markers/甲 2", &json!({ "e_m": 0, "n_m": 0 })).await.0, 201);
    assert_eq!(server.get("/markers/甲 2").await.1["name"], "甲 2");

    assert_eq!(server.delete("/markers/A17").await.0, 204);
    assert_eq!(server.get("/markers/A17").await.1["code"], "marker_not_found");
    assert_eq!(server.get("/markers").await.1.as_array().unwrap().len(), 1);
}

#[tokio::test]
async fn two_who_edit_the_same_marker_do_not_overwrite_each_other() {
    let server = TestServer::start().await;
    let (_, seen) = server.post("/markers", &json!({ "name": "A17", "e_m": 1.0, "n_m": 2.0 })).await;
    let mine = json!({ "e_m": 1.5, "n_m": 2.0, "version": seen["version"], "reason": "surveyed again" });
    assert_eq!(server.put("/markers/A17", &mine).await.0, 200);

    // The second has seen what is no more: by version in the body, and by the header.
    let theirs = json!({ "e_m": 9.0, "n_m": 2.0, "version": seen["version"] });
    let (status, problem) = server.put("/markers/A17", &theirs).await;
    assert_eq!((status, problem["code"].as_str()), (409, Some("marker_changed")));
    assert_eq!(problem["current"]["e_m"], 1.5);
    let put = server.client.put(server.api("/markers/A17")).json(&json!({ "e_m": 9.0, "n_m": 2.0 }));
    let answer = put.header("if-match", format!("\"{}\"", seen["version"])).send().await.unwrap();
    assert_eq!(answer.status(), 412);
    let answer =
        server.client.delete(server.api("/markers/A17")).header("if-match", "\"0\"").send().await.unwrap();
    assert_eq!(answer.status(), 412);
    assert_eq!(server.get("/markers/A17").await.1["e_m"], 1.5);

    // With no version at all nothing that stands is overwritten, but the same place again is no change.
    let (status, problem) = server.put("/markers/A17", &json!({ "e_m": 9.0, "n_m": 2.0 })).await;
    assert_eq!((status, problem["code"].as_str()), (428, Some("version_missing")));
    assert_eq!(problem["current"]["e_m"], 1.5);
    assert_eq!(server.put("/markers/A17", &json!({ "e_m": 1.5, "n_m": 2.0 })).await.0, 200);

    // Having looked at it, by its tag; or by force.
    let answer = server.client.get(server.api("/markers/A17")).send().await.unwrap();
    let tag = answer.headers()["etag"].clone();
    let put = server.client.put(server.api("/markers/A17")).json(&json!({ "e_m": 9.0, "n_m": 2.0 }));
    assert_eq!(put.header("if-match", tag).send().await.unwrap().status(), 200);
    let forced = json!({ "e_m": 3.0, "n_m": 2.0, "force": true });
    assert_eq!(server.put("/markers/A17", &forced).await.0, 200);

    // One that was removed and added anew is not the one that was seen.
    let (_, old) = server.get("/markers/A17").await;
    server.delete("/markers/A17?reason=demolished").await;
    server.post("/markers", &json!({ "name": "A17", "e_m": 3.0, "n_m": 2.0 })).await;
    let late = json!({ "e_m": 4.0, "n_m": 2.0, "version": old["version"] });
    assert_eq!(server.put("/markers/A17", &late).await.0, 409);
}

#[tokio::test]
async fn the_history_of_a_marker_says_what_it_was_and_why_it_changed() {
    let server = TestServer::start().await;
    server
        .post("/markers", &json!({ "name": "A17", "e_m": 1.0, "n_m": 2.0, "reason": "first survey" }))
        .await;
    server
        .put(
            "/markers/A17",
            &json!({ "e_m": 1.5, "n_m": 2.0, "u_m": 7.0, "force": true, "reason": "=HYPERLINK()" }),
        )
        .await;
    import(&server, "name,e_m,n_m,u_m\nA17,1.25,2,\n").await;
    server.delete("/markers/A17?reason=demolished").await;
    let (status, history) = server.get("/markers/A17/history").await;
    assert_eq!(status, 200);
    let told: Vec<_> = history
        .as_array()
        .unwrap()
        .iter()
        .map(|change| {
            (
                change["before"]["e_m"].as_f64(),
                change["after"]["e_m"].as_f64(),
                change["reason"].as_str().unwrap(),
            )
        })
        .collect();
    let expected = [
        (Some(1.25), None, "demolished"),
        (Some(1.5), Some(1.25), ""),
        (Some(1.0), Some(1.5), "=HYPERLINK()"),
        (None, Some(1.0), "first survey"),
    ];
    assert_eq!(told, expected);
    assert_eq!(history[1]["after"]["u_m"], 7.0, "the file left the height alone");
    assert!(history[1]["import_id"].is_string() && history[0]["import_id"].is_null());
    assert_eq!(server.get("/markers/B1/history").await.1["code"], "marker_not_found");
}

#[tokio::test]
async fn a_marker_may_be_given_on_the_ellipsoid() {
    let server = TestServer::start().await;
    let (_, site) = server.get("/site").await;
    let body = json!({
        "name": "origin", "latitude_deg": site["latitude_deg"], "longitude_deg": site["longitude_deg"],
        "height_m": site["height_m"].as_f64().unwrap() + 10.0,
    });
    let (status, made) = server.post("/markers", &body).await;
    assert_eq!(status, 201, "{made}");
    for (axis, expected) in [("e_m", 0.0), ("n_m", 0.0), ("u_m", 10.0)] {
        assert!((made[axis].as_f64().unwrap() - expected).abs() < 1e-6, "{made}");
    }
    for wrong in [
        json!({ "name": "both", "latitude_deg": 25.0, "longitude_deg": 106.0, "e_m": 1.0, "n_m": 1.0 }),
        json!({ "name": "swapped", "latitude_deg": 106.8, "longitude_deg": 25.6 }),
        json!({ "name": "elsewhere", "latitude_deg": 52.0, "longitude_deg": 13.0 }),
        json!({ "name": "half", "e_m": 1.0 }),
    ] {
        let (status, problem) = server.post("/markers", &wrong).await;
        assert_eq!((status, problem["code"].as_str()), (422, Some("wrong_place")), "{wrong}");
    }
}

#[tokio::test]
async fn a_file_is_taken_whole_and_its_export_changes_nothing() {
    let server = TestServer::start().await;
    let file = "\u{feff}name,e_m,n_m,u_m\r\nA1,0.1,0.2,0.3\r\n\"B, \"\"2\"\"\",-1e-3,2,\r\n'=1+1,3,4,5\r\n";
    let counts = json!({ "added": 3, "changed": 0, "unchanged": 0 });
    assert_eq!(import(&server, file).await, (200, counts));

    let exported = export(&server).await;
    assert!(exported.contains("\n'=1+1,3,4,5\n"), "a spreadsheet sees no formula: {exported}");
    let counts = json!({ "added": 0, "changed": 0, "unchanged": 3 });
    assert_eq!(import(&server, exported.clone()).await, (200, counts));
    assert_eq!(export(&server).await, exported);
    assert_eq!(server.get("/markers/=1+1").await.0, 200);

    // An empty height leaves the height alone; a moved marker is told as changed.
    let counts = json!({ "added": 0, "changed": 1, "unchanged": 1 });
    assert_eq!(
        import(&server, "name,e_m,n_m,u_m\nA1,0.1,0.2,\n\"B, \"\"2\"\"\",0,2,\n").await,
        (200, counts)
    );
    assert_eq!(server.get("/markers/A1").await.1["u_m"], 0.3);
}

#[tokio::test]
async fn a_spreadsheet_saved_in_gbk_is_read() {
    let server = TestServer::start().await;
    // "促动器1" in GBK.
    let mut file = b"name,e_m,n_m,u_m\n".to_vec();
    file.extend_from_slice(&[0xB4, 0xD9, 0xB6, 0xAF, 0xC6, 0xF7]);
    file.extend_from_slice(b"1,1,2,3\n");
    assert_eq!(import(&server, file).await.0, 200);
    assert_eq!(server.get("/markers").await.1[0]["name"], "促动器1");
}

#[tokio::test]
async fn one_wrong_line_and_nothing_of_the_file_is_stored() {
    let server = TestServer::start().await;
    let (status, problem) = import(&server, "name,e_m,n_m,u_m\nA1,1,2,3\nA2,1,east,3\n").await;
    assert_eq!((status, problem["code"].as_str()), (422, Some("not_a_number")));
    assert_eq!(problem["where"], json!({ "line": 3, "column": "n_m" }));
    assert_eq!(server.get("/markers").await.1, json!([]));

    let request =
        server.client.post(server.api("/markers/import")).header("content-type", "application/json");
    let answer = request.body("name,e_m,n_m\nA,1,2\n").send().await.unwrap();
    assert_eq!(answer.status(), 415);
    assert_eq!(import(&server, &b"\x89PNG\r\n\x1a\n\0\0"[..]).await.1["code"], "not_text");
    assert_eq!(import(&server, "").await.1["code"], "empty_file");
}
