//! Staff with an account each, as they ask a server that has been set up.

use reqwest::{Method, RequestBuilder};
use serde_json::{Value, json};

use crate::hand_in::{Answer, ask};
use crate::server::TestServer;

/// Long enough for everybody.
pub const PASSWORD: &str = "a sentence nobody says";
/// What a test server is set up with.
pub const SETUP_TOKEN: &str = "the setup token of a test";
/// The roles, the least first.
pub const ROLES: [&str; 6] = ["viewer", "inspector", "dispatcher", "surveyor", "engineer", "admin"];

/// One who may sign in, and has.
#[derive(Clone, Debug)]
pub struct Person {
    /// Name and role in one.
    pub name: String,
    /// The cookie, as a browser sends it.
    pub cookie: String,
    /// The account's id.
    pub id: String,
}

impl Person {
    /// Somebody who shows nothing.
    pub fn nobody() -> Person {
        Person { name: "nobody".to_owned(), cookie: String::new(), id: String::new() }
    }

    /// A request of this person, below `/api/v1`.
    pub fn request(&self, server: &TestServer, method: Method, path: &str) -> RequestBuilder {
        let request = server.client.request(method, server.api(path));
        if self.cookie.is_empty() { request } else { request.header("cookie", &self.cookie) }
    }

    /// What the server answers this person.
    pub async fn ask(&self, server: &TestServer, method: Method, path: &str, body: &Value) -> Answer {
        ask(self.request(server, method, path).json(body)).await
    }

    /// What the server shows this person.
    pub async fn get(&self, server: &TestServer, path: &str) -> Answer {
        ask(self.request(server, Method::GET, path)).await
    }
}

/// Starts a server, makes the first account, and one of each other role.
pub async fn server_with_staff() -> (TestServer, Vec<Person>) {
    let server = TestServer::start_with(|config| config.setup_token = Some(SETUP_TOKEN.to_owned())).await;
    let body = json!({"setup_token": SETUP_TOKEN, "name": "admin", "password": PASSWORD});
    let answer = server.client.post(server.api("/account/set-up")).json(&body).send().await;
    let answer = answer.expect("the server answers");
    assert_eq!(answer.status(), 201);
    let cookie = cookie_of(&answer);
    let id = answer.json::<Value>().await.expect("JSON")["id"].as_str().expect("an id").to_owned();
    let admin = Person { name: "admin".to_owned(), cookie, id };
    let mut staff = Vec::new();
    for role in &ROLES[..5] {
        let body = json!({"name": role, "password": PASSWORD, "role": role});
        let made = admin.ask(&server, Method::POST, "/accounts", &body).await;
        assert_eq!(made.status, 201, "{made:?}");
        staff.push(sign_in(&server, role).await);
    }
    staff.push(admin);
    (server, staff)
}

/// Signs one in.
pub async fn sign_in(server: &TestServer, name: &str) -> Person {
    let body = json!({"name": name, "password": PASSWORD});
    let answer = server.client.post(server.api("/account/sign-in")).json(&body).send().await;
    let answer = answer.expect("the server answers");
    assert_eq!(answer.status(), 200);
    let cookie = cookie_of(&answer);
    let id = answer.json::<Value>().await.expect("JSON")["id"].as_str().expect("an id").to_owned();
    Person { name: name.to_owned(), cookie, id }
}

fn cookie_of(answer: &reqwest::Response) -> String {
    let set = answer.headers()["set-cookie"].to_str().expect("a cookie is plain text");
    for part in ["__Host-lodestep=", "; Path=/", "; Secure", "; HttpOnly", "; SameSite=Strict"] {
        assert!(set.contains(part), "{part} is missing in {set}");
    }
    set.split(';').next().expect("a cookie has a value").to_owned()
}
