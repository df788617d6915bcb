//! The description of the API, made from the declarations of the routes and the types of their handlers.

use std::collections::BTreeSet;

use axum::http::StatusCode;
use serde_json::{Map, Value, json};

use super::example::Examples;
use super::operation::{Answered, Content, Header, Signature};
use super::operation_list::OperationList;
use super::routes::{Declared, Needs};
use super::schemas::{Named, Schemas};
use crate::error::Problem;
use crate::rights::Right;

/// What an answer of each status says.
const ANSWERS: [(StatusCode, &str); 5] = [
    (StatusCode::SWITCHING_PROTOCOLS, "From here on it is a websocket, as docs/wire.md describes it."),
    (StatusCode::OK, "Done."),
    (StatusCode::CREATED, "There is something new."),
    (StatusCode::ACCEPTED, "It will be done."),
    (StatusCode::NO_CONTENT, "Done; there is nothing to show."),
];

/// The OpenAPI 3.1 document of these routes.
pub fn document(declared: &[Declared], list: &OperationList) -> Value {
    let mut schemas = Schemas::new();
    let signatures: Vec<Signature> = declared.iter().map(|route| (route.describe)(&mut schemas)).collect();
    schemas.given.subschema_for::<Problem>();
    let named = schemas.named();
    let writer = Writer { named: &named, list };
    let mut paths = Map::new();
    for (route, signature) in declared.iter().zip(&signatures) {
        let path = paths.entry(route.path.clone()).or_insert_with(|| json!({}));
        path[route.method.as_str().to_lowercase()] = writer.operation(route, signature);
    }
    let responses: Map<String, Value> =
        list.every.iter().map(|(status, codes)| (status.to_string(), refused(codes))).collect();
    json!({
        "openapi": "3.1.0",
        "info": {
            "title": "Lodestep",
            "version": env!("CARGO_PKG_VERSION"),
            "description": "Positions of people under a roof that hides the sky. Times are RFC 3339 UTC, or seconds or nanoseconds since a session's start; positions are east, north, up in metres from the site's origin. An error is a problem document (RFC 9457) whose code is one of those listed with the operation. Both websockets are described in docs/wire.md.",
        },
        "servers": [{"url": "/"}],
        "paths": paths,
        "components": {
            "schemas": named.all,
            "responses": responses,
            "securitySchemes": {
                "token": {"type": "http", "scheme": "bearer"},
                "cookie": {"type": "apiKey", "in": "cookie", "name": crate::auth::COOKIE},
            },
        },
    })
}

struct Writer<'n> {
    named: &'n Named,
    list: &'n OperationList,
}

impl Writer<'_> {
    fn operation(&self, route: &Declared, signature: &Signature) -> Value {
        let mut operation = json!({
            "operationId": route.id,
            "summary": route.about,
            "tags": [tag(&route.path)],
            "parameters": self.parameters(route, signature),
            "responses": self.responses(route, signature),
        });
        if route.needs != Needs::Right(Right::Open) {
            operation["security"] = json!([{"token": []}, {"cookie": []}]);
            operation["x-right"] = json!(right(route.needs));
        }
        if !signature.body.is_empty() {
            let content = self.content(&signature.body, true);
            operation["requestBody"] = json!({"required": true, "content": content});
        }
        operation
    }

    fn parameters(&self, route: &Declared, signature: &Signature) -> Vec<Value> {
        let names = route.path.split('{').skip(1).filter_map(|rest| rest.split('}').next());
        let in_path = names
            .zip(&signature.path)
            .map(|(name, schema)| json!({"name": name, "in": "path", "required": true, "schema": schema}));
        let mut parameters: Vec<Value> = in_path.collect();
        if let Some(query) = &signature.query {
            let shape = self.named.of_request(query.schema.clone().to_value());
            let required: Vec<&str> =
                shape["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
            for (name, schema) in shape["properties"].as_object().into_iter().flatten() {
                let mut schema = schema.clone();
                let description = schema.as_object_mut().and_then(|schema| schema.remove("description"));
                let required = required.contains(&name.as_str());
                parameters.push(parameter(name, "query", required, schema, description));
            }
        }
        for header in &signature.headers {
            let Header { name, about, is_required, schema } = header;
            parameters.push(parameter(
                name,
                "header",
                *is_required,
                schema.clone().to_value(),
                Some(json!(about)),
            ));
        }
        parameters
    }

    fn responses(&self, route: &Declared, signature: &Signature) -> Map<String, Value> {
        let answers = signature.answers.iter().map(|answer| (answer.status.as_u16(), self.answer(answer)));
        let every = &self.list.every;
        let told = signature.problems.iter().chain(route.needs.problems());
        let problems = self.list.problems(route.id, told).into_iter().map(|(status, codes)| {
            let shared = every.get(&status) == Some(&codes);
            (
                status,
                if shared {
                    json!({"$ref": format!("#/components/responses/{status}")})
                } else {
                    refused(&codes)
                },
            )
        });
        answers.chain(problems).map(|(status, answer)| (status.to_string(), answer)).collect()
    }

    fn answer(&self, answered: &Answered) -> Value {
        let says =
            ANSWERS.iter().find(|(status, _)| *status == answered.status).map_or("Done.", |(_, says)| says);
        let mut answer = json!({"description": says});
        if !answered.content.is_empty() {
            answer["content"] = self.content(&answered.content, false);
        }
        for Header { name, about, is_required, schema } in &answered.headers {
            answer["headers"][name] =
                json!({"description": about, "required": is_required, "schema": schema});
        }
        answer
    }

    fn content(&self, content: &[Content], is_request: bool) -> Value {
        let mut all = json!({});
        for Content { media_type, schema, example } in content {
            let schema = schema.clone().to_value();
            let schema = if is_request { self.named.of_request(schema) } else { schema };
            // That JSON always has one is for a test to see.
            let example = example.clone().or_else(|| Examples { named: &self.named.all }.of(&schema).ok());
            all[media_type] = json!({"schema": schema});
            if let Some(example) = example {
                all[media_type]["example"] = example;
            }
        }
        all
    }
}

fn parameter(name: &str, place: &str, is_required: bool, schema: Value, about: Option<Value>) -> Value {
    let mut parameter = json!({"name": name, "in": place, "required": is_required, "schema": schema});
    if let Some(about) = about {
        parameter["description"] = about;
    }
    parameter
}

/// A problem document with one of these codes.
fn refused(codes: &BTreeSet<String>) -> Value {
    let words: Vec<String> = codes.iter().map(|code| format!("`{code}`")).collect();
    let code = json!({"properties": {"code": {"enum": codes}}});
    let schema = json!({"allOf": [{"$ref": "#/components/schemas/Problem"}, code]});
    json!({
        "description": format!("It was not done: {}.", words.join(", ")),
        "content": {"application/problem+json": {"schema": schema}},
    })
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

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::config::Config;
    use crate::http::Routes;

    fn routes() -> Routes {
        crate::api::routes(&Config::for_testing(std::path::Path::new(".")))
    }

    /// Every operation of the description with its method and path.
    fn operations(document: &Value) -> Vec<(String, &Value)> {
        let paths = document["paths"].as_object().into_iter().flatten();
        paths
            .flat_map(|(path, methods)| {
                methods
                    .as_object()
                    .into_iter()
                    .flatten()
                    .map(move |(method, operation)| (format!("{} {path}", method.to_uppercase()), operation))
            })
            .collect()
    }

    #[test]
    fn every_operation_has_a_name_of_its_own_and_says_what_it_is_about() {
        let mut names = BTreeMap::new();
        let document = crate::api::description(&routes());
        for (route, operation) in operations(&document) {
            let id = operation["operationId"].as_str().unwrap_or_default().to_owned();
            let is_verb_noun = id.len() > 4 && id.chars().all(|c| c.is_ascii_lowercase() || c == '_');
            assert!(is_verb_noun, "{route}: expected a name such as list_markers, found {id:?}");
            let about = operation["summary"].as_str().unwrap_or_default();
            assert!(about.len() > 5, "{route}: say what it is about()");
            if let Some(other) = names.insert(id.clone(), route.clone()) {
                panic!("{route} and {other} are both called {id}");
            }
        }
        assert!(names.len() > 100, "{} operations", names.len());
    }

    #[test]
    fn schemas_are_named_for_what_they_are() {
        let document = crate::api::description(&routes());
        let schemas = document["components"]["schemas"].as_object().expect("there are schemas");
        for name in schemas.keys() {
            // A second type of the same name is numbered.
            assert!(
                !name.ends_with(|last: char| last.is_ascii_digit()),
                "{name}: give this type a name of its own"
            );
            assert!(name.starts_with(|first: char| first.is_ascii_uppercase()), "{name}");
        }
        assert!(schemas.len() > 100, "{} schemas", schemas.len());
    }

    #[test]
    fn every_body_has_a_shape_and_an_example() {
        let document = crate::api::description(&routes());
        let named = document["components"]["schemas"].as_object().expect("there are schemas");
        for (route, operation) in operations(&document) {
            let answers = operation["responses"].as_object().into_iter().flatten().map(|(_, answer)| answer);
            for body in answers.chain([&operation["requestBody"]]) {
                for (media_type, content) in body["content"].as_object().into_iter().flatten() {
                    let schema = &content["schema"];
                    assert!(
                        schema.as_object().is_some_and(|schema| !schema.is_empty()),
                        "{route}: any {media_type}"
                    );
                    if media_type == "application/json" {
                        let example = Examples { named }.of(schema);
                        let example = example.unwrap_or_else(|lacking| panic!("{route}: {lacking}"));
                        assert_eq!(content["example"], example, "{route}");
                    }
                }
            }
        }
    }

    #[test]
    fn every_variable_part_of_a_path_is_described_as_its_handler_takes_it() {
        for route in routes().declared() {
            let parts = route.path.matches('{').count();
            let signature = (route.describe)(&mut Schemas::new());
            assert_eq!(
                signature.path.len(),
                parts,
                "{} {}: take Path(…) of every part",
                route.method,
                route.path
            );
        }
    }

    #[test]
    fn every_reference_leads_somewhere() {
        let document = crate::api::description(&routes());
        let text = document.to_string();
        for reference in text.split("\"$ref\":\"#").skip(1).filter_map(|rest| rest.split('"').next()) {
            assert!(document.pointer(reference).is_some(), "{reference}");
        }
    }
}
