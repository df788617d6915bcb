//! A file of markers, step by step: compared, applied, reverted.

use lodestep_tests::server::TestServer;
use serde_json::{Value, json};

async fn send(server: &TestServer, file: impl Into<Vec<u8>>) -> (u16, Value) {
    let request = server.client.post(server.api("/markers/imports?file_name=survey.csv"));
    let answer = request.header("content-type", "text/csv").body(file.into()).send().await.unwrap();
    (answer.status().as_u16(), answer.json().await.unwrap())
}

async fn export(server: &TestServer) -> String {
    server.client.get(server.api("/markers.csv")).send().await.unwrap().text().await.unwrap()
}

/// A server with six markers, and its table as CSV.
async fn scene() -> (TestServer, String) {
    let server = TestServer::start().await;
    let file = "name,e_m,n_m,u_m\nA1,-10,5,1\nA2,0,2,1.5\nA3,10,-3,2\nA4,20,8,2.5\nA5,30,1,3\n'=A6,40,6,\n";
    let request = server.client.post(server.api("/markers/import")).header("content-type", "text/csv");
    assert_eq!(request.body(file).send().await.unwrap().status(), 200);
    let table = export(&server).await;
    (server, table)
}

fn path(import: &Value) -> String {
    format!("/markers/imports/{}", import["id"].as_str().unwrap())
}

fn counts(import: &Value) -> [u64; 4] {
    ["added", "changed", "removed", "unchanged"].map(|kind| import[kind].as_u64().unwrap())
}

fn codes(import: &Value) -> Vec<&str> {
    import["findings"].as_array().unwrap().iter().map(|finding| finding["code"].as_str().unwrap()).collect()
}

#[tokio::test]
async fn what_is_exported_comes_back_unchanged_even_as_the_whole_table() {
    let (server, table) = scene().await;
    assert!(table.contains("'=A6"), "a spreadsheet sees no formula: {table}");
    let (status, import) = send(&server, table).await;
    assert_eq!((status, counts(&import), codes(&import)), (201, [0, 0, 0, 6], vec![]));
    let whole = json!({ "whole_table": true });
    let (_, import) = server.put(&format!("{}/reading", path(&import)), &whole).await;
    assert_eq!((counts(&import), codes(&import)), ([0, 0, 0, 6], vec![]));
}

#[tokio::test]
async fn a_file_is_compared_applied_and_reverted_exactly() {
    let (server, table) = scene().await;
    let file = "Height,Point name,North,East\n1,A1,5,-10\n1.5,A2,2.25,0\n,A3,-3,10.5\n7,A7,9,55\n";
    let (status, import) = send(&server, file).await;
    assert_eq!(status, 201, "{import}");
    let mapping = json!({ "frame": "local", "name": 1, "e_m": 3, "n_m": 2, "u_m": 0 });
    assert_eq!((&import["mapping"], &import["file_name"]), (&mapping, &json!("survey.csv")));
    assert_eq!(counts(&import), [1, 2, 0, 1]);
    let told: Vec<_> = import["differences"]
        .as_array()
        .unwrap()
        .iter()
        .map(|d| {
            (
                d["name"].as_str().unwrap(),
                d["change"].as_str().unwrap(),
                d["line"].as_u64(),
                d["moved_m"].as_f64(),
            )
        })
        .collect();
    let expected = [
        ("A3", "changed", Some(4), Some(0.5)),
        ("A2", "changed", Some(3), Some(0.25)),
        ("A7", "added", Some(5), None),
    ];
    assert_eq!(told, expected);
    assert_eq!(import["differences"][0]["after"]["u_m"], 2.0, "an empty height leaves the height alone");
    assert_eq!(export(&server).await, table, "nothing is applied yet");

    // As the whole table it also removes, which has to be accepted.
    let (_, import) =
        server.put(&format!("{}/reading", path(&import)), &json!({ "whole_table": true })).await;
    assert_eq!((counts(&import), codes(&import)), ([1, 2, 3, 1], vec!["removes"]));
    let apply = format!("{}/apply", path(&import));
    let (status, problem) = server.post(&apply, &json!({ "reason": "spring survey" })).await;
    assert_eq!((status, problem["code"].as_str()), (409, Some("warnings_not_accepted")));
    let go = json!({ "reason": "spring survey", "accept_warnings": true });
    let (status, applied) = server.post(&apply, &go).await;
    assert_eq!(
        (status, &applied["state"], &applied["reason"]),
        (200, &json!("applied"), &json!("spring survey"))
    );
    assert_eq!(server.get("/markers").await.1.as_array().unwrap().len(), 4);
    assert_eq!(server.get("/markers/A2").await.1["n_m"], 2.25);
    assert_eq!(server.post(&apply, &go).await.1["code"], "import_applied");

    let revert = format!("{}/revert", path(&import));
    let (status, reverted) = server.post(&revert, &json!({ "reason": "wrong station" })).await;
    assert_eq!((status, &reverted["state"]), (200, &json!("reverted")));
    assert_eq!(export(&server).await, table, "exactly what it was");
    assert_eq!(server.post(&revert, &json!({})).await.1["code"], "import_reverted");
    let (_, history) = server.get("/markers/A2/history").await;
    assert_eq!((&history[0]["is_revert"], &history[0]["reason"]), (&json!(true), &json!("wrong station")));
    assert_eq!(history[1]["import_id"], import["id"]);
    assert_eq!(server.get("/markers/imports").await.1[0]["state"], "reverted");
}

#[tokio::test]
async fn a_table_that_moved_on_is_compared_again_first() {
    let (server, _) = scene().await;
    let (_, import) = send(&server, "name,e_m,n_m\nA1,-10.5,5\n").await;
    let force = json!({ "e_m": -10.25, "n_m": 5, "u_m": 1, "force": true });
    server.put("/markers/A1", &force).await;
    let apply = format!("{}/apply", path(&import));
    let (status, problem) = server.post(&apply, &json!({})).await;
    assert_eq!((status, problem["code"].as_str()), (409, Some("table_moved_on")));
    assert_eq!(server.get("/markers/A1").await.1["e_m"], -10.25);
    let (_, again) = server.put(&format!("{}/reading", path(&import)), &json!({})).await;
    assert_eq!(again["differences"][0]["before"]["e_m"], -10.25);
    assert_eq!(server.post(&apply, &json!({})).await.0, 200);
}

#[tokio::test]
async fn a_revert_tells_what_was_changed_since_and_leaves_it_when_told_to() {
    let (server, _) = scene().await;
    let (_, import) = send(&server, "name,e_m,n_m\nA1,-10.5,5\nA2,0.5,2\n").await;
    server.post(&format!("{}/apply", path(&import)), &json!({})).await;
    server.put("/markers/A1", &json!({ "e_m": -11, "n_m": 5, "u_m": 1, "force": true })).await;
    let revert = format!("{}/revert", path(&import));
    let (status, problem) = server.post(&revert, &json!({})).await;
    assert_eq!((status, problem["code"].as_str()), (409, Some("changed_since")));
    assert_eq!(problem["current"][0]["name"], "A1");
    assert_eq!(server.get("/markers/A2").await.1["e_m"], 0.5, "nothing is taken back yet");
    assert_eq!(server.post(&revert, &json!({ "skip_changed": true })).await.0, 200);
    assert_eq!(server.get("/markers/A2").await.1["e_m"], 0.0);
    assert_eq!(server.get("/markers/A1").await.1["e_m"], -11.0);
}

#[tokio::test]
async fn what_is_wrong_with_a_file_is_told_before_anything_is_applied() {
    let (server, table) = scene().await;
    // Changed axes: pointed out, with the mapping that puts it right.
    let swapped = "name,e_m,n_m,u_m\nA1,5,-10,1\nA2,2,0,1.5\nA3,-3,10,2\nA4,8,20,2.5\nA5,1,30,3\n";
    let (_, import) = send(&server, swapped).await;
    assert!(codes(&import).contains(&"swapped_axes"), "{import}");
    let finding =
        import["findings"].as_array().unwrap().iter().find(|f| f["code"] == "swapped_axes").unwrap();
    let reading = json!({ "mapping": finding["suggested"] });
    let (_, import) = server.put(&format!("{}/reading", path(&import)), &reading).await;
    assert_eq!((counts(&import), codes(&import)), ([0, 0, 0, 5], vec![]));

    // Errors: told with their lines, and nothing can be applied.
    let (status, import) = send(&server, "name,e_m,n_m\nA1,-10,5\nA1,3,4\n,5,6\nA3,east,7\n").await;
    assert_eq!((status, codes(&import)), (201, vec!["repeated_name", "wrong_name", "not_a_number"]));
    let (status, problem) =
        server.post(&format!("{}/apply", path(&import)), &json!({ "accept_warnings": true })).await;
    assert_eq!((status, problem["code"].as_str()), (409, Some("import_has_errors")));
    let (_, import) = send(&server, "name,e_m,n_m\nA1,106.8566,25.6529\n").await;
    assert_eq!(codes(&import), ["looks_geographic"]);
    let (_, import) = send(&server, "name,e_m,n_m\nA1,36386000,2838000\n").await;
    // A national grid is read by its zone; that it lies elsewhere is told, too.
    assert_eq!(codes(&import), ["national_grid", "far_move", "off_site"]);
    let (_, import) = send(&server, "what,where\nA1,here\n").await;
    assert_eq!((codes(&import), &import["mapping"]), (vec!["columns_unknown"], &Value::Null));

    // A file that is no table is refused as it comes.
    assert_eq!(send(&server, &b"\x89PNG\r\n\x1a\n\0\0"[..]).await.1["code"], "not_text");
    assert_eq!(send(&server, "name,e_m\nA,1,2\n").await.1["code"], "wrong_field_count");
    assert_eq!(export(&server).await, table);
}

#[tokio::test]
async fn a_mapping_that_cannot_be_and_a_file_that_was_given_up_are_refused() {
    let (server, _) = scene().await;
    let (_, import) = send(&server, "a,b,c\nA1,1,2\n").await;
    let reading = format!("{}/reading", path(&import));
    for wrong in [
        json!({ "frame": "local", "name": 0, "e_m": 1, "n_m": 1, "u_m": null }),
        json!({ "frame": "local", "name": 0, "e_m": 1, "n_m": 7, "u_m": null }),
    ] {
        let (status, problem) = server.put(&reading, &json!({ "mapping": wrong })).await;
        assert_eq!((status, problem["code"].as_str()), (422, Some("wrong_mapping")));
    }
    assert_eq!(server.delete(&path(&import)).await.0, 204);
    assert_eq!(server.get(&path(&import)).await.1["code"], "import_not_found");
}

#[tokio::test]
async fn an_import_by_one_request_can_be_reverted_too() {
    let (server, _) = scene().await;
    let (_, imports) = server.get("/markers/imports").await;
    assert_eq!((counts(&imports[0]), &imports[0]["state"]), ([6, 0, 0, 0], &json!("applied")));
    let (status, _) = server.post(&format!("{}/revert", path(&imports[0])), &json!({})).await;
    assert_eq!(status, 200);
    assert_eq!(server.get("/markers").await.1, json!([]));
}
