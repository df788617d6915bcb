//! Every answer of a test server, held against the description of the API: an operation answers only with the statuses,
//! media types, shapes and problems that are told of it.

use std::collections::HashMap;
use std::path::Path;
use std::sync::{Arc, LazyLock, Mutex};

use bytes::Bytes;
use jsonschema::Validator;
use lodestep_server::api;
use lodestep_server::config::Config;
use reqwest::header::{CONTENT_TYPE, HeaderMap};
use reqwest::{Method, RequestBuilder, StatusCode};
use serde_json::{Value, json};

/// What was answered to what.
#[derive(Clone, Copy, Debug)]
pub struct Answered<'a> {
    /// The method that was asked with.
    pub method: &'a Method,
    /// The path without its query.
    pub path: &'a str,
    /// The status.
    pub status: u16,
    /// The header `Content-Type`; empty where there was none.
    pub content_type: &'a str,
    /// The body.
    pub body: &'a [u8],
}

/// The description, ready to be held against.
struct Description {
    document: Value,
    /// By operation and status, what its JSON has to be.
    validators: Mutex<HashMap<String, Arc<Validator>>>,
}

static DESCRIPTION: LazyLock<Description> = LazyLock::new(|| {
    let routes = api::routes(&Config::for_testing(Path::new(".")));
    let mut document = api::description(&routes);
    let schemas = document["components"]["schemas"].as_object_mut().expect("there are schemas");
    schemas.values_mut().for_each(|schema| close(schema, false));
    Description { document, validators: Mutex::default() }
});

/// Sends a request and holds the answer against the description: its status, its headers, its body.
pub async fn send(request: RequestBuilder) -> (StatusCode, HeaderMap, Bytes) {
    let (client, request) = request.build_split();
    let request = request.expect("a request that can be sent");
    let (method, path) = (request.method().clone(), request.url().path().to_owned());
    let response = client.execute(request).await.expect("the server answers");
    let (status, headers) = (response.status(), response.headers().clone());
    let body = response.bytes().await.expect("the body arrives");
    let content_type = headers.get(CONTENT_TYPE).and_then(|kind| kind.to_str().ok()).unwrap_or_default();
    check(Answered { method: &method, path: &path, status: status.as_u16(), content_type, body: &body });
    (status, headers, body)
}

/// Panics unless the answer is one of those that are described; what is no path of the API is left alone.
pub fn check(answered: Answered<'_>) {
    if let Err(wrong) = DESCRIPTION.check(answered) {
        let Answered { method, path, status, body, .. } = answered;
        panic!("{method} {path}: {status} is not as described: {wrong}\n{}", String::from_utf8_lossy(body));
    }
}

impl Description {
    fn check(&self, answered: Answered<'_>) -> Result<(), String> {
        let Answered { method, path, status, content_type, body } = answered;
        let asked = if method == Method::HEAD { "get".to_owned() } else { method.as_str().to_lowercase() };
        let Some(operation) = self.methods_of(path).and_then(|methods| methods.get(&asked)) else {
            return Ok(());
        };
        let answer = &operation["responses"][status.to_string()];
        let answer = match answer["$ref"].as_str().and_then(|to| to.strip_prefix('#')) {
            Some(pointer) => self.document.pointer(pointer).ok_or("a reference leads nowhere")?,
            None => answer,
        };
        if answer.is_null() {
            return Err("no answer of this status is described".to_owned());
        }
        // An answer to HEAD has no body.
        if method == Method::HEAD {
            return Ok(());
        }
        let Some(content) = answer["content"].as_object() else {
            return if body.is_empty() { Ok(()) } else { Err("no body is described".to_owned()) };
        };
        let media_type = content_type.split(';').next().unwrap_or_default().trim();
        let content = content.get(media_type).ok_or_else(|| {
            format!("expected one of {:?}, found {content_type:?}", content.keys().collect::<Vec<_>>())
        })?;
        if !media_type.ends_with("json") {
            return Ok(());
        }
        let value = serde_json::from_slice(body).map_err(|error| format!("no JSON: {error}"))?;
        let key = format!("{} {status} {media_type}", operation["operationId"]);
        let errors: Vec<String> = self
            .validator(key, &content["schema"])
            .iter_errors(&value)
            .map(|error| format!("{}: {error}", error.instance_path()))
            .collect();
        if errors.is_empty() { Ok(()) } else { Err(errors.join("\n")) }
    }

    /// The methods of the template that a path is of: words are closer than variable parts.
    fn methods_of(&self, path: &str) -> Option<&Value> {
        let parts: Vec<&str> = path.split('/').collect();
        let paths = self.document["paths"].as_object().expect("there are paths");
        let fits = |template: &str| {
            let names: Vec<&str> = template.split('/').collect();
            names.len() == parts.len()
                && names.iter().zip(&parts).all(|(name, part)| name == part || name.starts_with('{'))
        };
        let fitting = paths.iter().filter(|(template, _)| fits(template));
        fitting.min_by_key(|(template, _)| template.matches('{').count()).map(|(_, methods)| methods)
    }

    fn validator(&self, key: String, schema: &Value) -> Arc<Validator> {
        let mut validators = self.validators.lock().expect("nobody panics while looking up");
        let validator = validators.entry(key).or_insert_with_key(|key| {
            let mut whole = json!({"components": self.document["components"]});
            if let (Some(whole), Some(schema)) = (whole.as_object_mut(), schema.as_object()) {
                whole.extend(schema.clone());
            }
            let made = jsonschema::options().should_validate_formats(true).build(&whole);
            Arc::new(made.unwrap_or_else(|error| panic!("{key}: {error}")))
        });
        Arc::clone(validator)
    }
}

/// Lets objects have only the fields that are described: clients may meet others in time, this version sends none.
fn close(schema: &mut Value, is_alternative: bool) {
    let Some(fields) = schema.as_object_mut() else { return };
    let has_own = fields.contains_key("properties");
    if has_own && !is_alternative && !fields.contains_key("additionalProperties") {
        fields.insert("unevaluatedProperties".to_owned(), Value::Bool(false));
    }
    for (key, value) in fields {
        match (key.as_str(), value) {
            ("properties", Value::Object(properties)) => {
                properties.values_mut().for_each(|property| close(property, false));
            }
            ("oneOf" | "anyOf" | "allOf", Value::Array(alternatives)) => {
                // The fields beside an alternative belong to the same object.
                alternatives.iter_mut().for_each(|one| close(one, is_alternative || has_own));
            }
            ("prefixItems", Value::Array(items)) => items.iter_mut().for_each(|item| close(item, false)),
            ("items" | "additionalProperties", inner) => close(inner, false),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(path: &str, status: u16, body: &Value) -> Result<(), String> {
        let kind = if status < 400 { "application/json" } else { "application/problem+json" };
        let body = body.to_string();
        DESCRIPTION.check(Answered {
            method: &Method::GET,
            path,
            status,
            content_type: kind,
            body: body.as_bytes(),
        })
    }

    #[test]
    fn what_is_not_as_described_is_seen() {
        let id = "01900000-0000-7000-8000-000000000000";
        let inspector =
            json!({"id": id, "name": "Li Na", "kind": "person", "created_at": "2026-11-28T08:15:00Z"});
        assert_eq!(told("/api/v1/inspectors", 200, &json!([inspector])), Ok(()));
        let path = format!("/api/v1/inspectors/{id}");
        for (field, value) in [("id", json!("7")), ("name", json!(7)), ("nickname", json!("Na"))] {
            let mut wrong = inspector.clone();
            wrong[field] = value;
            assert!(told(&path, 200, &wrong).is_err(), "{wrong}");
        }
        assert!(told(&path, 200, &json!({"id": id})).is_err(), "fields are missing");
        assert!(told(&path, 201, &inspector).is_err(), "nothing is made here");
        let problem = |code: &str| json!({"type": "about:blank", "title": "Not Found", "status": 404, "code": code, "detail": "there is none"});
        assert_eq!(told(&path, 404, &problem("inspector_not_found")), Ok(()));
        assert!(told(&path, 404, &problem("fault_not_found")).is_err(), "that is of another operation");
    }

    #[test]
    fn a_word_is_closer_than_a_variable_part() {
        let operation =
            |path: &str| DESCRIPTION.methods_of(path).map(|methods| methods["get"]["operationId"].clone());
        assert_eq!(operation("/api/v1/markers/residuals"), Some(json!("get_marker_residuals")));
        assert_eq!(operation("/api/v1/markers/A17"), Some(json!("get_marker")));
        assert_eq!(operation("/index.html"), None);
    }
}
