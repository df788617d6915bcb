//! Every route that changes what belongs to somebody × every role × own or another's × cookie or token: who may.

use lodestep_tests::hand_in::ask;
use lodestep_tests::server::TestServer;
use lodestep_tests::staff::{Person, ROLES, server_with_staff, sign_in};
use reqwest::{Method, RequestBuilder};
use serde_json::{Value, json};

/// What changes something of somebody's; `{session}`, `{log}`, `{fault}`, `{photo}` and `{mapping}` stand for its ids. Whoever may
/// delete comes after those who may not.
const OWNED: &[(&str, &str)] = &[
    ("PATCH", "/sessions/{session}"),
    ("POST", "/sessions/{session}/logs"),
    ("POST", "/sessions/{session}/visits"),
    ("DELETE", "/sessions/{session}/visits/01900000-0000-7000-8000-000000000000"),
    ("PUT", "/sessions/{session}/stands/1/choice"),
    ("DELETE", "/sessions/{session}/stands/1/choice"),
    ("POST", "/sessions/{session}/process"),
    ("PATCH", "/logs/{log}"),
    ("POST", "/logs/{log}/finish"),
    ("POST", "/logs/{log}/preview"),
    ("PATCH", "/faults/{fault}"),
    ("POST", "/faults/{fault}/photos"),
    ("PUT", "/mappings/{mapping}"),
    ("DELETE", "/logs/{log}"),
    ("DELETE", "/faults/{fault}/photos/{photo}"),
    ("DELETE", "/mappings/{mapping}"),
    ("DELETE", "/sessions/{session}"),
];

/// What changes accounts, sign-ins or tokens: for people who have signed in, whatever a token has.
const OF_ACCOUNTS: &[(&str, &str)] = &[
    ("POST", "/account/password"),
    ("DELETE", "/account/sign-ins/01900000-0000-7000-8000-000000000000"),
    ("POST", "/tokens"),
    ("DELETE", "/tokens/01900000-0000-7000-8000-000000000000"),
    ("POST", "/accounts"),
    ("PATCH", "/accounts/01900000-0000-7000-8000-000000000000"),
    ("DELETE", "/accounts/01900000-0000-7000-8000-000000000000"),
];

/// In this order those who may delete something come after those who may not.
const ORDER: [&str; 6] = ["viewer", "surveyor", "inspector", "dispatcher", "engineer", "admin"];

/// How somebody shows who they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shows {
    Cookie,
    /// A token with every right that its owner has.
    FullToken,
    /// A token that may read.
    ReadToken,
}

/// One of everything that belongs to somebody.
struct Things(Vec<(&'static str, String)>);

impl Things {
    /// Those of an inspector; the mapping is made by this person.
    async fn of(server: &TestServer, admin: &Person, inspector: &str, maker: &Person) -> Things {
        let make = async |path: &str, body: Value| {
            let made = admin.ask(server, Method::POST, path, &body).await;
            assert_eq!(made.status, 201, "{path}: {made:?}");
            made.id().to_owned()
        };
        let session = make("/sessions", json!({"inspector_id": inspector})).await;
        let log = make(&format!("/sessions/{session}/logs"), json!({"foot": "left"})).await;
        let fault =
            make("/faults", json!({"inspector_id": inspector, "kind": "leak", "severity": "low"})).await;
        let photo = admin.request(server, Method::POST, &format!("/faults/{fault}/photos"));
        let photo = ask(photo.body(b"\xff\xd8\xff\xe0 a photo".to_vec())).await;
        let mapping = json!({
            "name": format!("of {inspector}"),
            "mapping": {
                "time": {"column": "t", "unit": "ms"},
                "gyr": {"columns": ["gx", "gy", "gz"], "unit": "deg_s"},
                "acc": {"columns": ["ax", "ay", "az"], "unit": "g"},
            },
        });
        let mapping = maker.ask(server, Method::POST, "/mappings", &mapping).await;
        assert_eq!((photo.status, mapping.status), (201, 201), "{photo:?} {mapping:?}");
        Things(vec![
            ("{session}", session),
            ("{log}", log),
            ("{fault}", fault),
            ("{photo}", photo.id().to_owned()),
            ("{mapping}", mapping.id().to_owned()),
        ])
    }

    fn path(&self, template: &str) -> String {
        self.0.iter().fold(template.to_owned(), |path, (name, id)| path.replace(name, id))
    }
}

/// What this person's credentials of a kind put on a request.
async fn shown(
    server: &TestServer,
    person: &Person,
    shows: Shows,
) -> impl Fn(RequestBuilder) -> RequestBuilder {
    let me = person.get(server, "/account").await.body;
    let rights = if shows == Shows::ReadToken { json!(["read"]) } else { me["rights"].clone() };
    let new = json!({"name": format!("{shows:?}"), "rights": rights});
    let token = person.ask(server, Method::POST, "/tokens", &new).await;
    assert_eq!(token.status, 201, "{token:?}");
    let (cookie, secret) = (person.cookie.clone(), token.body["secret"].as_str().unwrap().to_owned());
    move |request| match shows {
        Shows::Cookie => request.header("cookie", &cookie),
        _ => request.bearer_auth(&secret),
    }
}

async fn matrix(shows: Shows) -> Vec<String> {
    let (server, staff) = server_with_staff().await;
    let admin = &staff[5];
    let mut inspectors = Vec::new();
    for name in ["Li Na", "Wang Wei"] {
        let made = admin.ask(&server, Method::POST, "/inspectors", &json!({"name": name})).await;
        inspectors.push(made.id().to_owned());
    }
    let person = |role: &str| &staff[ROLES.iter().position(|known| *known == role).unwrap()];
    let path = format!("/accounts/{}", person("inspector").id);
    let tied = admin.ask(&server, Method::PATCH, &path, &json!({"inspector_id": inspectors[0]})).await;
    assert_eq!(tied.status, 200, "{tied:?}");
    // What is open looks again; a new sign-in has the inspector from the start.
    let inspector = sign_in(&server, "inspector").await;
    let own = Things::of(&server, admin, &inspectors[0], &inspector).await;
    let others = Things::of(&server, admin, &inspectors[1], admin).await;
    let mut wrong = Vec::new();
    for (method, template) in OWNED {
        for (whose, things) in [("another's", &others), ("own", &own)] {
            for role in ORDER {
                let person = if role == "inspector" { &inspector } else { person(role) };
                let show = shown(&server, person, shows).await;
                let request =
                    server.client.request(method.parse().unwrap(), server.api(&things.path(template)));
                let status = show(request).json(&json!(["nothing"])).send().await.unwrap().status().as_u16();
                let may = match role {
                    _ if shows == Shows::ReadToken => false,
                    "dispatcher" | "engineer" | "admin" => true,
                    "inspector" => whose == "own",
                    _ => false,
                };
                if may == matches!(status, 401 | 403) || status >= 500 {
                    wrong.push(format!("{method} {template} ({whose}) for {role} by {shows:?}: {status}"));
                }
            }
        }
    }
    for (method, path) in OF_ACCOUNTS {
        let show = shown(&server, admin, shows).await;
        let request = server.client.request(method.parse().unwrap(), server.api(path));
        let status = show(request).json(&json!(["nothing"])).send().await.unwrap().status().as_u16();
        if (shows == Shows::Cookie) == matches!(status, 401 | 403) {
            wrong.push(format!("{method} {path} for an administrator by {shows:?}: {status}"));
        }
    }
    wrong
}

#[tokio::test]
async fn whoever_has_signed_in_changes_their_own_and_others_only_with_the_right_to() {
    assert_eq!(matrix(Shows::Cookie).await, Vec::<String>::new());
}

#[tokio::test]
async fn a_token_may_what_its_owner_may_but_for_accounts_sign_ins_and_tokens() {
    assert_eq!(matrix(Shows::FullToken).await, Vec::<String>::new());
}

#[tokio::test]
async fn a_token_that_may_read_changes_nothing() {
    assert_eq!(matrix(Shows::ReadToken).await, Vec::<String>::new());
}
