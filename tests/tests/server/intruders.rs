//! Those who have no business here: forged, expired and revoked credentials on every route, and ten thousand guesses.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use futures_util::{StreamExt, stream};
use lodestep_tests::every_route::Route;
use lodestep_tests::server::TestServer;
use lodestep_tests::staff::{PASSWORD, Person, SETUP_TOKEN, server_with_staff, sign_in};
use reqwest::{Method, RequestBuilder};
use serde_json::{Value, json};

/// What is shown, and what it is.
type Shown = (&'static str, &'static str, String);

/// Credentials of every kind that is good for nothing, made with those that once were good.
async fn good_for_nothing(server: &TestServer, staff: &[Person]) -> Vec<Shown> {
    let admin = &staff[5];
    let token = async |owner: &Person, name: &str, more: Value| {
        let mut body = json!({"name": name, "rights": ["read"]});
        if let (Some(body), Value::Object(more)) = (body.as_object_mut(), more) {
            body.extend(more);
        }
        let made = owner.ask(server, Method::POST, "/tokens", &body).await;
        assert_eq!(made.status, 201, "{made:?}");
        (made.id().to_owned(), made.body["secret"].as_str().unwrap().to_owned())
    };
    let bearer = |secret: &str| format!("Bearer {secret}");

    let (_, good) = token(admin, "good", json!({})).await;
    let mut forged = good.clone().into_bytes();
    forged[7] = if forged[7] == b'0' { b'1' } else { b'0' };
    let forged = String::from_utf8(forged).unwrap();
    let (revoked_id, revoked) = token(admin, "revoked", json!({})).await;
    admin.ask(server, Method::DELETE, &format!("/tokens/{revoked_id}"), &Value::Null).await;
    let soon = lodestep_server::utc::now() + Duration::from_secs(4);
    let soon = soon.format(&time::format_description::well_known::Rfc3339).unwrap();
    let (_, expired) = token(admin, "expired", json!({ "expires_at": soon })).await;
    let (_, of_disabled) = token(&staff[0], "of one who is disabled", json!({})).await;
    let (_, of_removed) = token(&staff[1], "of one who is removed", json!({})).await;
    let path = |person: &Person| format!("/accounts/{}", person.id);
    let disabled = admin.ask(server, Method::PATCH, &path(&staff[0]), &json!({"disabled": true})).await;
    assert_eq!(disabled.status, 200, "{disabled:?}");
    let removed = admin.ask(server, Method::DELETE, &path(&staff[1]), &Value::Null).await;
    assert_eq!(removed.status, 204, "{removed:?}");
    let signed_out = sign_in(server, "dispatcher").await;
    signed_out.request(server, Method::POST, "/account/sign-out").send().await.unwrap();
    // Until its time has come, however slowly all of this went.
    while lodestep_tests::hand_in::ask(
        server.client.get(server.api("/sessions")).header("authorization", bearer(&expired)),
    )
    .await
    .status
        != 401
    {
        tokio::time::sleep(Duration::from_millis(50)).await;
    }

    let cookie_value = staff[5].cookie.split_once('=').unwrap().1.to_owned();
    vec![
        ("a forged token", "authorization", bearer(&forged)),
        ("no token", "authorization", bearer("")),
        ("half a token", "authorization", bearer(&good[..32])),
        ("a token and more", "authorization", bearer(&format!("{good}0"))),
        ("no hex", "authorization", bearer(&"z".repeat(64))),
        ("SQL", "authorization", bearer("' or '1'='1")),
        ("another scheme", "authorization", format!("Basic {good}")),
        ("no scheme", "authorization", good.clone()),
        ("the setup token", "authorization", bearer(SETUP_TOKEN)),
        ("a cookie's secret as a token", "authorization", bearer(&cookie_value)),
        ("an expired token", "authorization", bearer(&expired)),
        ("a revoked token", "authorization", bearer(&revoked)),
        ("a token of a disabled account", "authorization", bearer(&of_disabled)),
        ("a token of a removed account", "authorization", bearer(&of_removed)),
        ("no cookie of ours", "cookie", "session=admin; lodestep=1".to_owned()),
        ("a forged cookie", "cookie", format!("__Host-lodestep={}", "a".repeat(64))),
        ("a token as a cookie", "cookie", format!("__Host-lodestep={good}")),
        ("a cookie that signed out", "cookie", signed_out.cookie.clone()),
        ("the cookie of a disabled account", "cookie", staff[0].cookie.clone()),
        ("the cookie of a removed account", "cookie", staff[1].cookie.clone()),
    ]
}

fn request(server: &TestServer, route: &Route, (_, header, value): &Shown) -> RequestBuilder {
    let request = server.client.request(route.method.clone(), server.url(&route.path));
    request.header(*header, value).json(&json!(["nothing"]))
}

#[tokio::test]
async fn what_is_forged_expired_or_revoked_opens_no_route_and_no_socket() {
    let (server, staff) = server_with_staff().await;
    let shown = good_for_nothing(&server, &staff).await;
    let routes = server.every_route().await;
    let closed: Vec<_> = routes.iter().filter(|route| !route.is_open).collect();
    assert!(closed.len() > 75, "{} routes ask who it is", closed.len());
    let mut let_in = Vec::new();
    for shown in &shown {
        for route in &closed {
            let mut request = request(&server, route, shown);
            if route.is_socket {
                request = request
                    .header("upgrade", "websocket")
                    .header("connection", "upgrade")
                    .header("sec-websocket-version", "13")
                    .header("sec-websocket-key", "dGhlIHNhbXBsZSBub25jZQ==");
            }
            let status = request.send().await.unwrap().status().as_u16();
            // A socket opens without a token at its door; the hello has to show a token.
            let nothing_shown = shown.1 == "cookie" && route.is_socket && status == 101;
            if status != 401 && !nothing_shown {
                let_in.push(format!("{} {} with {}: {status}", route.method, route.template, shown.0));
            }
        }
    }
    assert!(let_in.is_empty(), "{} were let in:\n{}", let_in.len(), let_in.join("\n"));
    // The one that is good still is: the refusals above mean something.
    assert_eq!(staff[5].get(&server, "/sessions").await.status, 200);
}

/// Guesses that are sent at once: more would only wait for each other.
const AT_ONCE: usize = 16;

/// Sends guesses and counts: let in, looked at (401), made to wait (429).
async fn guess(requests: impl Iterator<Item = RequestBuilder>) -> [usize; 3] {
    let counts = [const { AtomicUsize::new(0) }; 3];
    stream::iter(requests)
        .for_each_concurrent(AT_ONCE, async |request| {
            let answer = request.send().await.unwrap();
            let outcome = match answer.status().as_u16() {
                401 => 1,
                429 => {
                    assert!(answer.headers().contains_key("retry-after"), "{answer:?}");
                    2
                }
                200..300 => 0,
                other => panic!("{other}"),
            };
            counts[outcome].fetch_add(1, Ordering::Relaxed);
        })
        .await;
    counts.map(AtomicUsize::into_inner)
}

#[tokio::test]
async fn of_ten_thousand_guesses_none_is_let_in_and_hardly_one_is_looked_at() {
    let (server, _) = server_with_staff().await;
    let sign_in = |name: String, address: String, n: usize| {
        let body = json!({"name": name, "password": format!("guess number {n}")});
        server.client.post(server.api("/account/sign-in")).header("x-forwarded-for", address).json(&body)
    };
    // One account from many addresses: the account waits.
    let address = |n: usize| format!("10.{}.{}.{}", n >> 16 & 255, n >> 8 & 255, n & 255);
    let [let_in, looked_at, waits] =
        guess((0..3_000).map(|n| sign_in("admin".to_owned(), address(n), n))).await;
    assert_eq!((let_in, looked_at + waits), (0, 3_000));
    assert!(looked_at <= 12, "{looked_at} guesses at one account were looked at");
    // Many names from one address: the address waits.
    let [let_in, looked_at, waits] =
        guess((0..3_000).map(|n| sign_in(format!("name {n}"), "10.200.0.1".to_owned(), n))).await;
    assert_eq!((let_in, looked_at + waits), (0, 3_000));
    assert!(looked_at <= 30, "{looked_at} guesses from one address were looked at");
    // Tokens: there are as many as grains of sand on 10⁵⁰ beaches, so nobody has to wait.
    let tokens = (0..4_000_usize).map(|n| {
        let token = format!("{:064x}", n.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        server.client.get(server.api("/sessions")).header("authorization", format!("Bearer {token}"))
    });
    assert_eq!(guess(tokens).await, [0, 4_000, 0]);
    // An account that the guesses were not about signs in meanwhile.
    let body = json!({"name": "viewer", "password": PASSWORD});
    let other = server.client.post(server.api("/account/sign-in")).header("x-forwarded-for", "10.201.0.1");
    assert_eq!(other.json(&body).send().await.unwrap().status(), 200);
}

#[tokio::test]
async fn the_setup_token_is_not_to_be_guessed_and_good_once() {
    let server = TestServer::start_with(|config| config.setup_token = Some(SETUP_TOKEN.to_owned())).await;
    let attempt = |token: &str| {
        let body = json!({"setup_token": token, "name": "intruder", "password": PASSWORD});
        server.client.post(server.api("/account/set-up")).header("x-forwarded-for", "10.0.0.9").json(&body)
    };
    let guesses = (0..300).map(|n| attempt(&format!("{SETUP_TOKEN}{n}")));
    let [let_in, looked_at, waits] = guess(guesses).await;
    assert_eq!((let_in, looked_at + waits), (0, 300));
    assert!(looked_at <= 30, "{looked_at} guesses at the setup token were looked at");
}
