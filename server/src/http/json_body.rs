//! A JSON body read; what cannot be read is told by what was expected, what was found, where, and what to do.

use axum::http::StatusCode;
use schemars::{JsonSchema, schema_for};
use serde::de::DeserializeOwned;
use serde_json::Value;
use serde_json::error::Category;

use super::schema_mismatch::first_mismatch;
use crate::error::{Error, Place, Result};
use crate::stream_field::with_stream_keys;

/// Reads a body.
pub(crate) fn read<T: DeserializeOwned + JsonSchema>(body: &[u8]) -> Result<T> {
    serde_json::from_slice(body).or_else(|error| {
        // A client that knows no streams says them in its own words.
        let said = serde_json::from_slice::<Value>(body).unwrap_or_default();
        let renamed = with_stream_keys(said.clone());
        let read = (renamed != said).then(|| serde_json::from_value(renamed).ok()).flatten();
        read.ok_or_else(|| explained::<T>(body, error))
    })
}

/// Why a body could not be read.
fn explained<T: JsonSchema>(body: &[u8], error: serde_json::Error) -> Error {
    if body.trim_ascii().is_empty() {
        return Error::http(
            StatusCode::BAD_REQUEST,
            "not_json",
            "expected a JSON body, found an empty one: send what the route takes, {} where that is nothing",
        );
    }
    // A field that is wrong or missing stops the reader before it has seen whether all of this is JSON.
    let (error, value) = match serde_json::from_slice::<Value>(body) {
        Ok(value) => (error, with_stream_keys(value)),
        Err(syntax) => (syntax, Value::Null),
    };
    let place = Spot::of(&error, body);
    match error.classify() {
        Category::Data => does_not_fit::<T>(&value, &error, &place),
        Category::Eof => place.not_json(
            "JSON that is complete",
            "its end",
            "close what is open, and see whether all of it was sent",
        ),
        Category::Syntax | Category::Io => place.not_json(
            "JSON",
            &place.found(),
            "correct it; quotes, commas and brackets are where to look",
        ),
    }
}

/// Well-formed JSON that the route does not take.
fn does_not_fit<T: JsonSchema>(value: &Value, error: &serde_json::Error, spot: &Spot) -> Error {
    let place = Place { line: Some(spot.line), character: Some(spot.character), ..Place::default() };
    match first_mismatch(value, schema_for!(T).as_value()) {
        Some(found) => {
            let words = match found.field.as_str() {
                "" => "in the body".to_owned(),
                field => format!("in {field}"),
            };
            let field = (!found.field.is_empty()).then(|| found.field.clone());
            Error::invalid_at("wrong_field", found.sentence(&words), Place { field, ..place })
        }
        // A rule that no schema tells, such as a field that is given twice.
        None => {
            let told = error.to_string();
            let told = told.rsplit_once(" at line ").map_or(told.as_str(), |(told, _)| told);
            let detail = format!(
                "expected a body as /api/v1/openapi.json describes it, found one that breaks a rule ({told}) {}: correct it",
                spot.words()
            );
            Error::invalid_at("wrong_field", detail, place)
        }
    }
}

/// Where reading stopped.
struct Spot {
    /// Line, counted from 1.
    line: u64,
    /// Letter of the line, counted from 1.
    character: u64,
    /// What stands there.
    letter: Option<char>,
}

impl Spot {
    fn of(error: &serde_json::Error, body: &[u8]) -> Spot {
        let line = error.line().max(1);
        let text = body.split(|byte| *byte == b'\n').nth(line - 1).unwrap_or_default();
        // The parser counts bytes, the last of them the one at which it stopped.
        let upto = String::from_utf8_lossy(&text[..error.column().min(text.len())]).into_owned();
        let character = upto.chars().count().max(1) as u64;
        Spot { line: line as u64, character, letter: upto.chars().next_back() }
    }

    fn words(&self) -> String {
        format!("at line {}, character {}", self.line, self.character)
    }

    fn found(&self) -> String {
        self.letter.map_or("something else".to_owned(), |letter| format!("{:?}", letter.to_string()))
    }

    fn not_json(&self, expected: &str, found: &str, advice: &str) -> Error {
        let detail = format!("expected {expected}, found {found} {}: {advice}", self.words());
        let place = Place { line: Some(self.line), character: Some(self.character), ..Place::default() };
        Error::http_at(StatusCode::BAD_REQUEST, "not_json", detail, place)
    }
}
