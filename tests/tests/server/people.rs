//! Accounts, tokens, who is let in, and who changed what.

use std::time::{Duration, Instant};

use futures_util::{SinkExt, StreamExt};
use lodestep_tests::hand_in::ask;
use lodestep_tests::server::TestServer;
use lodestep_tests::staff::{PASSWORD, Person, SETUP_TOKEN, server_with_staff, sign_in};
use reqwest::Method;
use serde_json::{Value, json};
use tokio::time::timeout;
use tokio_tungstenite::connect_async;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::{Error as SocketError, Message};

/// What was revoked is cut within this time, as promised.
const CUT_WITHIN: Duration = Duration::from_secs(5);

#[tokio::test]
async fn until_there_is_an_account_the_machine_s_own_people_do_everything_and_a_proxy_s_nothing() {
    let server = TestServer::start_with(|config| config.setup_token = Some(SETUP_TOKEN.to_owned())).await;
    assert_eq!(server.get("/inspectors").await.0, 200);
    let handed_on =
        ask(server.client.get(server.api("/inspectors")).header("x-forwarded-for", "10.0.0.7")).await;
    assert_eq!((handed_on.status, handed_on.code()), (401, "not_signed_in"));
    let (_, me) = server.get("/account").await;
    assert_eq!((&me["has_accounts"], &me["known"]), (&json!(false), &json!(true)));
}

#[tokio::test]
async fn the_first_account_needs_the_setup_token_and_then_everybody_needs_an_account() {
    let server = TestServer::start_with(|config| config.setup_token = Some(SETUP_TOKEN.to_owned())).await;
    let with = |token: &str| json!({"setup_token": token, "name": "Wang Fang", "password": PASSWORD});
    let (status, problem) = server.post("/account/set-up", &with("another token of the same kind")).await;
    assert_eq!((status, &problem["code"]), (401, &json!("wrong_setup_token")));
    let (status, problem) = server
        .post(
            "/account/set-up",
            &json!({"setup_token": SETUP_TOKEN, "name": "Wang Fang", "password": "short"}),
        )
        .await;
    assert_eq!((status, &problem["code"]), (422, &json!("weak_password")));
    let (status, account) = server.post("/account/set-up", &with(SETUP_TOKEN)).await;
    assert_eq!((status, &account["role"]), (201, &json!("admin")));
    assert!(account.get("password_hash").is_none(), "{account}");
    // Once is enough, and the machine's own people are nobody now.
    assert_eq!(server.post("/account/set-up", &with(SETUP_TOKEN)).await.0, 409);
    assert_eq!(server.get("/inspectors").await.0, 401);
    let server = server.restart().await;
    assert_eq!(server.get("/inspectors").await.0, 401);
    let person = sign_in(&server, "wang FANG").await;
    assert_eq!(person.get(&server, "/inspectors").await.status, 200);
}

#[tokio::test]
async fn wrong_names_and_wrong_passwords_get_the_same_answer_and_guessing_leads_nowhere() {
    let (server, _) = server_with_staff().await;
    let guess = async |name: &str, password: &str| {
        server.post("/account/sign-in", &json!({"name": name, "password": password})).await
    };
    let (status, of_wrong_password) = guess("viewer", "not the password").await;
    let (_, of_unknown_name) = guess("no such name", "not the password").await;
    assert_eq!((status, &of_wrong_password), (401, &of_unknown_name));
    let mut let_through = 0;
    for n in 0..200 {
        let (status, problem) = guess("viewer", &format!("guess number {n}")).await;
        match status {
            401 => let_through += 1,
            429 => assert_eq!(problem["code"], "too_many_guesses"),
            other => panic!("{other}: {problem}"),
        }
    }
    assert!(let_through <= 12, "{let_through} guesses were looked at");
    // The right password has to wait like any other; somebody else need not.
    assert_eq!(guess("viewer", PASSWORD).await.0, 429);
}

#[tokio::test]
async fn forged_expired_and_revoked_credentials_open_nothing() {
    let (server, staff) = server_with_staff().await;
    let admin = &staff[5];
    let bearer = async |token: &str| {
        ask(server.client.get(server.api("/sessions")).header("authorization", format!("Bearer {token}")))
            .await
    };
    let make = async |body: Value| admin.ask(&server, Method::POST, "/tokens", &body).await;
    let made = make(json!({"name": "a script", "rights": ["read"]})).await;
    assert_eq!(made.status, 201, "{made:?}");
    let secret = made.body["secret"].as_str().unwrap().to_owned();
    assert_eq!(bearer(&secret).await.status, 200);
    // Good for what it is for, and for nothing else.
    let marker = json!({"name": "X1", "e_m": 1.0, "n_m": 2.0});
    let write = server.client.post(server.api("/markers")).json(&marker);
    assert_eq!(ask(write.header("authorization", format!("Bearer {secret}"))).await.status, 403);

    let mut forged = secret.clone().into_bytes();
    forged[10] = if forged[10] == b'0' { b'1' } else { b'0' };
    for token in [String::from_utf8(forged).unwrap(), String::new(), "a".repeat(64), secret[..63].to_owned()]
    {
        assert_eq!(bearer(&token).await.status, 401, "{token}");
    }
    let forged_cookie = Person { cookie: format!("__Host-lodestep={}", "a".repeat(64)), ..Person::nobody() };
    assert_eq!(forged_cookie.get(&server, "/sessions").await.status, 401);

    let over = make(json!({"name": "over", "rights": ["read"], "expires_at": "2020-01-01T00:00:00Z"})).await;
    assert_eq!(over.code(), "wrong_expiry");
    let soon = time_from_now(Duration::from_millis(1_200));
    let short = make(json!({"name": "short", "rights": ["read"], "expires_at": soon})).await;
    let short = short.body["secret"].as_str().unwrap().to_owned();
    assert_eq!(bearer(&short).await.status, 200);
    tokio::time::sleep(Duration::from_millis(1_300)).await;
    assert_eq!(bearer(&short).await.status, 401);

    let path = format!("/tokens/{}", made.id());
    assert_eq!(admin.ask(&server, Method::DELETE, &path, &Value::Null).await.status, 204);
    assert_eq!(bearer(&secret).await.status, 401);
}

fn time_from_now(after: Duration) -> String {
    let since_1970 = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap() + after;
    lodestep_server::utc::from_us(since_1970.as_micros() as i64)
        .format(&time::format_description::well_known::Rfc3339)
        .unwrap()
}

#[tokio::test]
async fn a_token_never_does_more_than_its_owner_and_makes_no_tokens() {
    let (server, staff) = server_with_staff().await;
    let (viewer, admin) = (&staff[0], &staff[5]);
    let more = json!({"name": "more", "rights": ["read", "administer"]});
    assert_eq!(viewer.ask(&server, Method::POST, "/tokens", &more).await.status, 403);
    let made = admin.ask(&server, Method::POST, "/tokens", &more).await;
    let secret = made.body["secret"].as_str().unwrap().to_owned();
    let with = |request: reqwest::RequestBuilder| request.header("authorization", format!("Bearer {secret}"));
    assert_eq!(ask(with(server.client.get(server.api("/accounts")))).await.status, 200);
    let again = ask(with(server.client.post(server.api("/tokens")).json(&more))).await;
    assert_eq!((again.status, again.code()), (403, "not_by_token"));
    // Its owner becomes a viewer: so does the token.
    let other = json!({"name": "other", "password": PASSWORD, "role": "admin"});
    assert_eq!(admin.ask(&server, Method::POST, "/accounts", &other).await.status, 201);
    let demoted = json!({"role": "viewer"});
    let path = format!("/accounts/{}", admin.id);
    assert_eq!(admin.ask(&server, Method::PATCH, &path, &demoted).await.status, 200);
    assert_eq!(ask(with(server.client.get(server.api("/accounts")))).await.status, 403);
    assert_eq!(ask(with(server.client.get(server.api("/sessions")))).await.status, 200);
}

#[tokio::test]
async fn the_last_administrator_stays_one() {
    let (server, staff) = server_with_staff().await;
    let admin = &staff[5];
    let path = format!("/accounts/{}", admin.id);
    for change in
        [json!({"role": "viewer"}), json!({"disabled": true}), json!({"expires_at": "2020-01-01T00:00:00Z"})]
    {
        let refused = admin.ask(&server, Method::PATCH, &path, &change).await;
        assert_eq!((refused.status, refused.code()), (409, "last_administrator"), "{change}");
    }
    assert_eq!(admin.ask(&server, Method::DELETE, &path, &Value::Null).await.status, 409);
    assert_eq!(admin.get(&server, "/accounts").await.status, 200);
}

/// An inspector, who has an account and may write the walks of `own`.
async fn inspector_with_a_walk(server: &TestServer, staff: &[Person]) -> (String, String) {
    let admin = &staff[5];
    let mut ids = Vec::new();
    for name in ["own", "other"] {
        let made = admin.ask(server, Method::POST, "/inspectors", &json!({ "name": name })).await;
        ids.push(made.id().to_owned());
    }
    let path = format!("/accounts/{}", staff[1].id);
    let tied = admin.ask(server, Method::PATCH, &path, &json!({"inspector_id": ids[0]})).await;
    assert_eq!(tied.status, 200, "{tied:?}");
    (ids[0].clone(), ids[1].clone())
}

#[tokio::test]
async fn an_inspector_writes_their_own_walks_only() {
    let (server, staff) = server_with_staff().await;
    let (own, other) = inspector_with_a_walk(&server, &staff).await;
    let (inspector, admin) = (&staff[1], &staff[5]);
    let session = |id: &str| json!({"inspector_id": id});
    let mine = inspector.ask(&server, Method::POST, "/sessions", &session(&own)).await;
    assert_eq!(mine.status, 201, "{mine:?}");
    let refused = inspector.ask(&server, Method::POST, "/sessions", &session(&other)).await;
    assert_eq!((refused.status, refused.code()), (403, "not_your_walk"));
    let theirs = admin.ask(&server, Method::POST, "/sessions", &session(&other)).await;
    let log = json!({"foot": "left"});
    let begin = |id: &str| format!("/sessions/{id}/logs");
    assert_eq!(inspector.ask(&server, Method::POST, &begin(mine.id()), &log).await.status, 201);
    assert_eq!(inspector.ask(&server, Method::POST, &begin(theirs.id()), &log).await.status, 403);
    let their_log = admin.ask(&server, Method::POST, &begin(theirs.id()), &log).await;
    let path = format!("/logs/{}", their_log.id());
    assert_eq!(inspector.ask(&server, Method::DELETE, &path, &Value::Null).await.status, 403);
    let fault = json!({"inspector_id": other, "kind": "leak", "severity": "low"});
    assert_eq!(inspector.ask(&server, Method::POST, "/faults", &fault).await.status, 403);
    let path = format!("/sessions/{}", theirs.id());
    assert_eq!(inspector.ask(&server, Method::DELETE, &path, &Value::Null).await.status, 403);
    let path = format!("/sessions/{}", mine.id());
    assert_eq!(inspector.ask(&server, Method::DELETE, &path, &Value::Null).await.status, 204);
}

/// The next JSON that a socket sends; `None` when it is closed.
async fn next<S>(socket: &mut S) -> Option<Value>
where
    S: StreamExt<Item = Result<Message, SocketError>> + Unpin,
{
    loop {
        match socket.next().await? {
            Ok(Message::Text(text)) => return Some(serde_json::from_str(text.as_str()).unwrap()),
            Ok(Message::Close(_)) | Err(_) => return None,
            Ok(_) => {}
        }
    }
}

#[tokio::test]
async fn both_sockets_want_a_cookie_or_a_token_at_the_door_or_in_the_hello() {
    let (server, staff) = server_with_staff().await;
    let (own, other) = inspector_with_a_walk(&server, &staff).await;
    let admin = &staff[5];
    let token = json!({"name": "device", "rights": ["walk"], "inspector_id": own});
    let token = admin.ask(&server, Method::POST, "/tokens", &token).await;
    let secret = token.body["secret"].as_str().unwrap();
    // Nothing shown: the feed tells nothing, a device begins nothing.
    for (path, hello) in [
        ("/feed", json!({"type": "hello"})),
        ("/live", json!({"type": "hello", "inspector_id": own})),
        ("/live", json!({"type": "hello", "inspector_id": own, "token": "a".repeat(64)})),
        ("/feed", json!({"type": "hello", "token": secret})),
    ] {
        let (mut socket, _) = connect_async(server.socket(path)).await.unwrap();
        socket.send(Message::text(hello.to_string())).await.unwrap();
        let answer = next(&mut socket).await.unwrap();
        assert_eq!(answer["type"], "error", "{path}: {answer}");
        assert_eq!(next(&mut socket).await, None, "{path} stayed open");
    }
    // A token in the hello: for its own inspector, and for nobody else's walk.
    for (inspector, answer) in [(&own, "welcome"), (&other, "error")] {
        let (mut socket, _) = connect_async(server.socket("/live")).await.unwrap();
        let hello = json!({"type": "hello", "inspector_id": inspector, "token": secret});
        socket.send(Message::text(hello.to_string())).await.unwrap();
        assert_eq!(next(&mut socket).await.unwrap()["type"], answer);
    }
    // A bad one at the door does not get as far as a hello.
    let mut request = server.socket("/feed").into_client_request().unwrap();
    request.headers_mut().insert("authorization", format!("Bearer {}", "b".repeat(64)).parse().unwrap());
    match connect_async(request).await {
        Err(SocketError::Http(answer)) => assert_eq!(answer.status(), 401),
        other => panic!("{other:?}"),
    }
}

#[tokio::test]
async fn what_is_revoked_is_cut_within_five_seconds_also_on_open_sockets() {
    let (server, staff) = server_with_staff().await;
    let (own, _) = inspector_with_a_walk(&server, &staff).await;
    let (viewer, admin) = (&staff[0], &staff[5]);
    let token = json!({"name": "device", "rights": ["walk"], "inspector_id": own});
    let token = admin.ask(&server, Method::POST, "/tokens", &token).await;
    let mut request = server.socket("/live").into_client_request().unwrap();
    let bearer = format!("Bearer {}", token.body["secret"].as_str().unwrap());
    request.headers_mut().insert("authorization", bearer.parse().unwrap());
    let (mut device, _) = connect_async(request).await.unwrap();
    let hello = json!({"type": "hello", "inspector_id": own});
    device.send(Message::text(hello.to_string())).await.unwrap();
    assert_eq!(next(&mut device).await.unwrap()["type"], "welcome");

    let mut request = server.socket("/feed").into_client_request().unwrap();
    request.headers_mut().insert("cookie", viewer.cookie.parse().unwrap());
    let (mut feed, _) = connect_async(request).await.unwrap();
    feed.send(Message::text(r#"{"type":"hello"}"#)).await.unwrap();
    assert_eq!(next(&mut feed).await.unwrap()["type"], "snapshot");

    let path = format!("/tokens/{}", token.id());
    assert_eq!(admin.ask(&server, Method::DELETE, &path, &Value::Null).await.status, 204);
    let begun = Instant::now();
    let answer = timeout(CUT_WITHIN, next(&mut device)).await.expect("the device is cut in time").unwrap();
    assert_eq!((&answer["type"], &answer["code"]), (&json!("error"), &json!("not_signed_in")));

    let path = format!("/accounts/{}", viewer.id);
    let disabled = admin.ask(&server, Method::PATCH, &path, &json!({"disabled": true})).await;
    assert_eq!(disabled.status, 200);
    let cut = async {
        while let Some(message) = next(&mut feed).await {
            if message["type"] == "error" {
                break;
            }
        }
    };
    timeout(CUT_WITHIN, cut).await.expect("the dashboard is cut in time");
    assert!(begun.elapsed() < 2 * CUT_WITHIN);
    assert_eq!(viewer.get(&server, "/sessions").await.status, 401);
}

#[tokio::test]
async fn the_demo_s_devices_walk_on_when_the_first_account_is_made() {
    let server = TestServer::start_with(|config| {
        config.demo = true;
        config.setup_token = Some(SETUP_TOKEN.to_owned());
    })
    .await;
    let live = async |person: &Person| {
        let sessions = person.get(&server, "/sessions?state=live").await;
        sessions.body.as_array().map_or(0, Vec::len)
    };
    let nobody = Person::nobody();
    let all = async {
        while live(&nobody).await < 4 {
            tokio::time::sleep(Duration::from_millis(100)).await
        }
    };
    timeout(Duration::from_secs(60), all).await.expect("four inspectors set out");
    let body = json!({"setup_token": SETUP_TOKEN, "name": "admin", "password": PASSWORD});
    assert_eq!(server.post("/account/set-up", &body).await.0, 201);
    let admin = sign_in(&server, "admin").await;
    let samples =
        async |id: &str| admin.get(&server, &format!("/sessions/{id}")).await.body["samples"].as_u64();
    let id = admin.get(&server, "/sessions?state=live").await.body[0]["id"].as_str().unwrap().to_owned();
    let before = samples(&id).await;
    let goes_on = async {
        while samples(&id).await <= before {
            tokio::time::sleep(Duration::from_millis(100)).await
        }
    };
    timeout(Duration::from_secs(60), goes_on).await.expect("they walk on");
}

#[tokio::test]
async fn signing_out_and_a_new_password_end_what_was_open() {
    let (server, staff) = server_with_staff().await;
    let viewer = &staff[0];
    let second = sign_in(&server, "viewer").await;
    let listed = viewer.get(&server, "/account/sign-ins").await;
    assert_eq!(listed.body.as_array().unwrap().len(), 2);
    let change = json!({"old": PASSWORD, "new": "another sentence nobody says"});
    assert_eq!(viewer.ask(&server, Method::POST, "/account/password", &change).await.status, 204);
    assert_eq!(second.get(&server, "/sessions").await.status, 401);
    assert_eq!(viewer.get(&server, "/sessions").await.status, 200);
    let out = viewer.request(&server, Method::POST, "/account/sign-out").send().await.unwrap();
    assert_eq!(out.status(), 204);
    assert!(out.headers()["set-cookie"].to_str().unwrap().contains("Max-Age=0"));
    assert_eq!(viewer.get(&server, "/sessions").await.status, 401);
}

#[tokio::test]
async fn the_audit_log_says_who_did_what_from_what_to_what() {
    let (server, staff) = server_with_staff().await;
    let (dispatcher, admin) = (&staff[2], &staff[5]);
    let made = dispatcher.ask(&server, Method::POST, "/inspectors", &json!({"name": "=Li Na"})).await;
    let path = format!("/inspectors/{}", made.id());
    dispatcher.ask(&server, Method::PATCH, &path, &json!({"name": "Li Ma"})).await;
    let log = admin.get(&server, &format!("/audit?subject={}", made.id())).await;
    let entries = log.body.as_array().unwrap();
    assert_eq!(entries.len(), 2, "{log:?}");
    let renamed = &entries[0];
    assert_eq!(renamed["who"], "dispatcher");
    assert_eq!(renamed["action"], "inspector.renamed");
    assert_eq!((&renamed["before"]["name"], &renamed["after"]["name"]), (&json!("=Li Na"), &json!("Li Ma")));
    assert!(renamed["at"].as_str().is_some_and(|at| at.ends_with('Z')));
    let accounts = admin.get(&server, "/audit?action=account").await;
    let text = accounts.body.to_string();
    assert!(text.contains("account.added") && text.contains("account.signed_in"), "{text}");
    assert!(!text.contains("argon2") && !text.contains(PASSWORD), "{text}");
    let file = admin.request(&server, Method::GET, "/audit.csv").send().await.unwrap().text().await.unwrap();
    assert!(file.starts_with("\u{feff}id,at,who,"), "{file}");
}

#[tokio::test]
async fn an_account_whose_name_looks_like_another_is_refused() {
    let (server, staff) = server_with_staff().await;
    let admin = &staff[5];
    let add = async |name: &str| {
        let body = json!({"name": name, "password": PASSWORD, "role": "viewer"});
        admin.ask(&server, Method::POST, "/accounts", &body).await
    };
    assert_eq!(add("Li Na").await.status, 201);
    // Cyrillic а and і, a digit for a letter, letters of full width.
    for alike in ["Li N\u{430}", "L\u{456} Na", "1i Na", "Ｌｉ Ｎａ"] {
        let refused = add(alike).await;
        assert_eq!((refused.status, refused.code()), (409, "name_looks_taken"), "{alike}: {refused:?}");
    }
    assert_eq!(add("li na").await.code(), "name_taken");
    assert_eq!(add("Li Nan").await.status, 201);
}
