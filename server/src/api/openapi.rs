//! The description of the API, made from the declarations of the routes and the types of their bodies.

use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use schemars::SchemaGenerator;
use schemars::generate::SchemaSettings;
use serde_json::{Map, Value, json};

use super::Routes;
use super::routes::{Content, Declared, Needs};
use crate::error::Problem;
use crate::rights::Right;
use crate::state::App;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/openapi.json", Right::Open, show)
        .about("This description")
        .gives_bytes("application/json")
}

async fn show(State(app): State<App>) -> Response {
    ([(header::CONTENT_TYPE, "application/json")], app.openapi.clone()).into_response()
}

/// The OpenAPI 3.1 document of these routes.
pub fn document(declared: &[Declared]) -> Value {
    let settings = SchemaSettings::draft2020_12().with(|s| s.definitions_path = "/components/schemas".into());
    let mut schemas = SchemaGenerator::new(settings);
    let mut paths = Map::new();
    for route in declared {
        let operation = operation(route, &mut schemas);
        let path = paths.entry(route.path.clone()).or_insert_with(|| json!({}));
        path[route.method.as_str().to_lowercase()] = operation;
    }
    let problem = schemas.subschema_for::<Problem>();
    json!({
        "openapi": "3.1.0",
        "info": {
            "title": "Lodestep",
            "version": env!("CARGO_PKG_VERSION"),
            "description": "Positions of people under a roof that hides the sky. Times are RFC 3339 UTC, or seconds or nanoseconds since a session's start; positions are east, north, up in metres from the site's origin. An error is a problem document (RFC 9457). Both websockets are described in docs/wire.md.",
        },
        "servers": [{"url": "/"}],
        "paths": paths,
        "components": {
            "schemas": schemas.take_definitions(true),
            "responses": {"Problem": {
                "description": "It was not done: what was expected, what was found, what to do.",
                "content": {"application/problem+json": {"schema": problem}},
            }},
            "securitySchemes": {
                "token": {"type": "http", "scheme": "bearer"},
                "cookie": {"type": "apiKey", "in": "cookie", "name": crate::auth::COOKIE},
            },
        },
    })
}

fn operation(route: &Declared, schemas: &mut SchemaGenerator) -> Value {
    let mut operation = json!({
        "summary": route.about,
        "tags": [tag(&route.path)],
        "parameters": parameters(route, schemas),
        "responses": {"2XX": good(route, schemas), "default": {"$ref": "#/components/responses/Problem"}},
    });
    if route.needs != Needs::Right(Right::Open) {
        operation["security"] = json!([{"token": []}, {"cookie": []}]);
        operation["x-right"] = json!(right(route.needs));
    }
    if let Some(takes) = route.takes {
        operation["requestBody"] = json!({"required": true, "content": content(takes, schemas)});
    }
    operation
}

/// The noun after `/api/v1`.
fn tag(path: &str) -> &str {
    let path = path.strip_prefix("/api/v1").unwrap_or(path);
    path.split(['/', '.']).nth(1).unwrap_or_default()
}

fn right(needs: Needs) -> &'static str {
    match needs {
        Needs::Right(right) | Needs::Socket(right) | Needs::SignedIn(right) => right.word(),
        Needs::OwnSession | Needs::OwnLog | Needs::OwnFault | Needs::ReportedFault | Needs::OwnMapping => {
            Right::Walk.word()
        }
    }
}

fn parameters(route: &Declared, schemas: &mut SchemaGenerator) -> Vec<Value> {
    let in_path = route.path.split('{').skip(1).filter_map(|rest| rest.split_once('}')).map(|(name, _)| {
        let schema = match name {
            "id" => json!({"type": "string", "format": "uuid"}),
            "number" => json!({"type": "integer", "minimum": 0}),
            _ => json!({"type": "string", "minLength": 1}),
        };
        json!({"name": name, "in": "path", "required": true, "schema": schema})
    });
    let mut parameters: Vec<Value> = in_path.collect();
    if let Some(query) = route.query {
        let shape = (query.shape)(schemas).to_value();
        let required: Vec<&str> =
            shape["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
        for (name, schema) in shape["properties"].as_object().into_iter().flatten() {
            let required = required.contains(&name.as_str());
            let mut schema = schema.clone();
            let description = schema.as_object_mut().and_then(|schema| schema.remove("description"));
            let mut parameter = json!({"name": name, "in": "query", "required": required, "schema": schema});
            if let Some(description) = description {
                parameter["description"] = description;
            }
            parameters.push(parameter);
        }
    }
    parameters
}

fn good(route: &Declared, schemas: &mut SchemaGenerator) -> Value {
    match route.gives {
        Some(gives) => json!({"description": "Done.", "content": content(gives, schemas)}),
        None => json!({"description": "Done; there is nothing to tell."}),
    }
}

fn content(content: Content, schemas: &mut SchemaGenerator) -> Value {
    match content {
        Content::Json(shape) => json!({"application/json": {"schema": shape(schemas)}}),
        // JSON of a shape that others have laid down, such as GeoJSON.
        Content::Bytes(kind) if kind.ends_with("json") => json!({kind: {"schema": {"type": "object"}}}),
        Content::Bytes(kind) => json!({kind: {"schema": {"type": "string", "format": "binary"}}}),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;

    fn told() -> (Vec<Declared>, Value) {
        let routes = crate::api::routes(&Config::for_testing(std::path::Path::new(".")));
        let document = document(routes.declared());
        (routes.declared().to_vec(), document)
    }

    #[test]
    fn every_route_is_described_with_what_it_is_about() {
        let (declared, document) = told();
        for route in declared {
            let operation = &document["paths"][&route.path][route.method.as_str().to_lowercase()];
            assert!(
                operation["summary"].as_str().is_some_and(|about| about.len() > 5),
                "{} {}: say what it is about()",
                route.method,
                route.path
            );
        }
    }

    #[test]
    fn every_reference_leads_somewhere() {
        let (_, document) = told();
        let text = document.to_string();
        for reference in text.split("\"$ref\":\"#").skip(1).filter_map(|rest| rest.split('"').next()) {
            assert!(document.pointer(reference).is_some(), "{reference}");
        }
        assert!(document["components"]["schemas"].as_object().is_some_and(|all| all.len() > 10));
    }
}
