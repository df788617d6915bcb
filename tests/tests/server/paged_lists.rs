//! Lists that grow for years are answered a page at a time.

use lodestep_tests::server::TestServer;
use serde_json::{Value, json};

/// The rows of all pages, by the links in the headers. After the first page of walks its last one is removed.
async fn follow(server: &TestServer, list: &str, most: usize) -> Vec<Value> {
    let mut rows: Vec<Value> = Vec::new();
    let mut next = format!("{list}limit={most}");
    for page in 0.. {
        let answer = server.client.get(server.api(&next)).send().await.unwrap();
        assert_eq!(answer.status(), 200, "{next}");
        let link = answer.headers().get("Link").map(|link| link.to_str().unwrap().to_owned());
        let read: Vec<Value> = answer.json().await.unwrap();
        assert!(read.len() <= most);
        rows.extend(read);
        let Some(link) = link else { return rows };
        let path = link.strip_prefix("</api/v1").and_then(|rest| rest.strip_suffix(">; rel=\"next\""));
        next = path.unwrap_or_else(|| panic!("{link} names the next page")).to_owned();
        if page == 0 && list.starts_with("/sessions") {
            let last = rows.last().unwrap()["id"].as_str().unwrap();
            let removed =
                server.client.delete(server.api(&format!("/sessions/{last}"))).send().await.unwrap();
            assert_eq!(removed.status(), 204);
        }
    }
    unreachable!()
}

#[tokio::test]
async fn pages_together_are_the_list_each_row_once_and_in_order() {
    let server = TestServer::start().await;
    let (_, li) = server.post("/inspectors", &json!({ "name": "Li Na" })).await;
    let (_, wang) = server.post("/inspectors", &json!({ "name": "Wang Wei" })).await;
    for number in 0..9 {
        // Three of each begin at the same instant: the order is then by their ids.
        let at = format!("2026-07-01T0{}:00:00Z", number / 3);
        let who = if number == 4 { &wang } else { &li };
        let (status, _) =
            server.post("/sessions", &json!({ "inspector_id": who["id"], "started_at": at })).await;
        assert_eq!(status, 201);
        let fault = json!({ "inspector_id": li["id"], "reported_at": at, "kind": "leak", "severity": "low" });
        let (status, fault) = server.post("/faults", &fault).await;
        assert_eq!(status, 201, "{fault}");
        if number % 2 == 0 {
            let path = format!("/faults/{}/close", fault["id"].as_str().unwrap());
            assert_eq!(server.post(&path, &json!({})).await.0, 200);
        }
    }

    let who = li["id"].as_str().unwrap();
    for (list, in_all) in [
        ("/sessions?".to_owned(), 9),
        // Without the other inspector's, and the one that was removed while the pages above were read.
        (format!("/sessions?inspector_id={who}&state=created&"), 7),
        ("/faults?".to_owned(), 9),
        ("/faults?state=standing&".to_owned(), 4),
        ("/faults?state=verified&".to_owned(), 5),
    ] {
        let (_, whole) = server.get(list.trim_end_matches(['?', '&'])).await;
        let whole = whole.as_array().unwrap();
        assert_eq!(whole.len(), in_all, "{list}");
        let paged = follow(&server, &list, 2).await;
        // By their ids: a removed walk is taken out of its faults in the background meanwhile.
        let ids = |rows: &[Value]| rows.iter().map(|row| row["id"].clone()).collect::<Vec<_>>();
        assert_eq!(ids(&paged), ids(whole), "{list}");
    }
}

#[tokio::test]
async fn a_page_has_a_thousand_rows_at_most_and_one_at_least() {
    let server = TestServer::start().await;
    for list in ["/sessions", "/faults"] {
        for limit in ["0", "4000000000"] {
            assert_eq!(server.get(&format!("{list}?limit={limit}")).await, (200, json!([])));
        }
        let (status, problem) = server.get(&format!("{list}?limit=-1")).await;
        assert_eq!((status, problem["code"].as_str()), (400, Some("wrong_query")));
    }
}
