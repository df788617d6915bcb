//! The pages of other sites in the same browser: they change nothing, and open no socket.

use lodestep_tests::staff::server_with_staff;
use reqwest::Method;
use serde_json::{Value, json};
use tokio_tungstenite::connect_async;
use tokio_tungstenite::tungstenite::Error as SocketError;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;

/// Where a page may come from that is not ours; `{host}` is our own host and port.
const FOREIGN: [&str; 10] = [
    "http://evil.example",
    "https://evil.example",
    "null",
    "",
    "file://",
    "http://{host}.evil.example",
    "http://evil.example/{host}",
    "http://evil.example#{host}",
    "http://{host}:80",
    "ftp://{host}",
];

#[tokio::test]
async fn a_foreign_page_changes_nothing_by_any_route_though_the_browser_has_signed_in() {
    let (server, staff) = server_with_staff().await;
    let admin = &staff[5];
    let host = server.address.to_string();
    let changes = admin.get(&server, "/audit?limit=1000").await.body.as_array().unwrap().len();
    let mut wrong = Vec::new();
    for route in server.every_route().await.iter().filter(|route| route.method != Method::GET) {
        for origin in FOREIGN {
            let origin = origin.replace("{host}", &host);
            let request = server
                .client
                .request(route.method.clone(), server.url(&route.path))
                .header("cookie", &admin.cookie)
                .header("origin", &origin)
                .json(&json!({}));
            let answer = request.send().await.unwrap();
            let status = answer.status().as_u16();
            let problem: Value = answer.json().await.unwrap_or_default();
            if (status, problem["code"].as_str()) != (403, Some("foreign_origin")) {
                wrong.push(format!("{} {} from {origin:?}: {status}", route.method, route.template));
            }
        }
        // What a bare form can send without being asked first, from a browser that tells no origin.
        for kind in ["application/x-www-form-urlencoded", "multipart/form-data; boundary=x", "Text/Plain"] {
            let request = server
                .client
                .request(route.method.clone(), server.url(&route.path))
                .header("cookie", &admin.cookie)
                .header("content-type", kind)
                .body("{}");
            let status = request.send().await.unwrap().status().as_u16();
            if status != 403 {
                wrong.push(format!("{} {} as {kind}: {status}", route.method, route.template));
            }
        }
    }
    assert!(wrong.is_empty(), "{} got through:\n{}", wrong.len(), wrong.join("\n"));
    let after = admin.get(&server, "/audit?limit=1000").await.body.as_array().unwrap().len();
    assert_eq!(after, changes, "something was changed");
}

#[tokio::test]
async fn our_own_page_changes_what_a_foreign_one_may_not() {
    let (server, staff) = server_with_staff().await;
    for origin in [format!("http://{}", server.address), format!("https://{}", server.address)] {
        let post = staff[5].request(&server, Method::POST, "/inspectors").header("origin", &origin);
        assert_eq!(post.json(&json!({ "name": origin })).send().await.unwrap().status(), 201, "{origin}");
    }
}

#[tokio::test]
async fn nothing_is_changed_by_looking() {
    let (server, staff) = server_with_staff().await;
    let admin = &staff[5];
    let state = async || {
        let mut all = Vec::new();
        for path in
            ["/audit?limit=1000", "/inspectors", "/sessions", "/faults", "/markers", "/accounts", "/tokens"]
        {
            all.push(admin.get(&server, path).await.body);
        }
        // When somebody was here last is no change that they asked for.
        let text = serde_json::to_string(&all).unwrap();
        text.split("\"seen_at\"")
            .map(|part| part.split_once(',').map_or(part, |(_, rest)| rest).to_owned())
            .collect::<String>()
    };
    let before = state().await;
    for route in server.every_route().await.iter().filter(|route| route.method == Method::GET) {
        for method in [Method::GET, Method::HEAD] {
            let request =
                server.client.request(method, server.url(&route.path)).header("cookie", &admin.cookie);
            let _ = request.header("origin", "http://evil.example").send().await.unwrap().bytes().await;
        }
    }
    assert_eq!(state().await, before);
}

#[tokio::test]
async fn a_foreign_page_opens_no_socket_and_ours_does() {
    let (server, staff) = server_with_staff().await;
    let host = server.address.to_string();
    for path in ["/feed", "/live"] {
        for origin in FOREIGN {
            let origin = origin.replace("{host}", &host);
            let mut request = server.socket(path).into_client_request().unwrap();
            request.headers_mut().insert("cookie", staff[5].cookie.parse().unwrap());
            request.headers_mut().insert("origin", origin.parse().unwrap());
            match connect_async(request).await {
                Err(SocketError::Http(answer)) => assert_eq!(answer.status(), 403, "{path} from {origin:?}"),
                other => panic!("{path} from {origin:?}: {other:?}"),
            }
        }
        let mut request = server.socket(path).into_client_request().unwrap();
        request.headers_mut().insert("cookie", staff[5].cookie.parse().unwrap());
        request.headers_mut().insert("origin", format!("http://{host}").parse().unwrap());
        assert!(connect_async(request).await.is_ok(), "{path} from our own page");
    }
}
