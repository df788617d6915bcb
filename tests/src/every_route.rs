//! Every route that a server describes in its OpenAPI file, ready to be asked.

use reqwest::Method;
use serde_json::Value;

use crate::server::TestServer;

/// A route of the OpenAPI file.
#[derive(Clone, Debug)]
pub struct Route {
    /// The method.
    pub method: Method,
    /// The path with its variable parts, such as `/api/v1/markers/{name}`.
    pub template: String,
    /// The same with ids and names of nothing: a caller that is let in finds nothing to break.
    pub path: String,
    /// Whether nobody in particular may ask for it.
    pub is_open: bool,
    /// Whether it is the door of a websocket, which may also be shown a token after it.
    pub is_socket: bool,
}

impl TestServer {
    /// Every route, as the server describes itself.
    pub async fn every_route(&self) -> Vec<Route> {
        let (_, document) = self.get("/openapi.json").await;
        let mut routes = Vec::new();
        for (template, operations) in document["paths"].as_object().expect("the file has paths") {
            for (method, operation) in operations.as_object().expect("a path has operations") {
                let method = method.to_uppercase().parse().expect("a method of HTTP");
                routes.push(Route {
                    method,
                    template: template.clone(),
                    path: filled(template),
                    is_open: operation["security"] == Value::Null,
                    is_socket: template.ends_with("/live") || template.ends_with("/feed"),
                });
            }
        }
        assert!(routes.len() > 80, "{} routes: has the description moved?", routes.len());
        routes
    }
}

/// The path with something in each variable part.
fn filled(template: &str) -> String {
    let parts = template.split('/').map(|part| match part {
        "{number}" => "1",
        "{name}" => "nothing",
        part if part.starts_with('{') => "01900000-0000-7000-8000-000000000000",
        part => part,
    });
    parts.collect::<Vec<_>>().join("/")
}
