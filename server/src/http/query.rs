//! A query read; what cannot be read is told by what was expected, what was found, where, and what to do.

use axum::http::{StatusCode, Uri};
use lodestep_engine::stream::FormerKeys;
use lodestep_engine::systems::catalogue;
use schemars::{JsonSchema, schema_for};
use serde::de::DeserializeOwned;
use serde_json::{Map, Number, Value};

use super::schema_mismatch::{first_mismatch, types};
use crate::error::{Error, Place, Result};

/// Reads what stands after the question mark.
pub(super) fn read<T: DeserializeOwned + JsonSchema>(query: &str) -> Result<T> {
    let query = with_stream_keys(query);
    // Only what no line of a request can hold does not pass here.
    let uri: Uri = format!("/?{query}").parse().map_err(|_| {
        wrong(
            "expected a query of name=value&…, found letters that an address cannot hold: encode them as %XX",
            None,
        )
    })?;
    match axum::extract::Query::<T>::try_from_uri(&uri) {
        Ok(axum::extract::Query(asked)) => Ok(asked),
        Err(error) => Err(does_not_fit::<T>(&uri, &error.body_text())),
    }
}

/// The query with the key of clients that know no streams put right.
fn with_stream_keys(query: &str) -> String {
    let former = catalogue::former_keys();
    let pairs = query.split('&').map(|pair| {
        let value = |keys: &FormerKeys| pair.strip_prefix(keys.stream)?.strip_prefix('=');
        match former.iter().find_map(value) {
            Some(value) => format!("stream={value}"),
            None => pair.to_owned(),
        }
    });
    pairs.collect::<Vec<_>>().join("&")
}

fn does_not_fit<T: JsonSchema>(uri: &Uri, told: &str) -> Error {
    let schema = without_null(schema_for!(T).to_value());
    let pairs = axum::extract::Query::<Vec<(String, String)>>::try_from_uri(uri);
    let pairs = pairs.map(|axum::extract::Query(pairs)| pairs).unwrap_or_default();
    let mut asked = Map::new();
    for (name, text) in pairs {
        let value = value_of(&text, schema.get("properties").and_then(|known| known.get(&name)));
        if asked.insert(name.clone(), value).is_some() {
            return wrong(
                &format!("expected {name} once in the query, found it twice: leave one out"),
                Some(name),
            );
        }
    }
    match first_mismatch(&Value::Object(asked), &schema) {
        Some(found) => {
            let words = format!("at {} in the query", found.field);
            wrong(&found.sentence(&words), Some(found.field))
        }
        // A rule that no schema tells.
        None => {
            let told = told.rsplit_once("query string: ").map_or(told, |(_, told)| told);
            let detail = format!(
                "expected a query as /api/v1/openapi.json describes it, found one that breaks a rule ({told}): correct it"
            );
            wrong(&detail, None)
        }
    }
}

/// The schema without the null that stands for what may be left out: a query leaves it out.
fn without_null(mut schema: Value) -> Value {
    let known = schema.get_mut("properties").and_then(Value::as_object_mut);
    for property in known.into_iter().flat_map(|known| known.values_mut()) {
        for alternatives in ["type", "anyOf"] {
            if let Some(all) = property.get_mut(alternatives).and_then(Value::as_array_mut) {
                all.retain(|one| one != "null" && one.get("type").is_none_or(|kind| kind != "null"));
            }
        }
    }
    schema
}

/// What a text of the query stands for where the schema wants this kind.
fn value_of(text: &str, schema: Option<&Value>) -> Value {
    let kinds = schema.map(types).unwrap_or_default();
    let number = kinds.iter().any(|kind| matches!(*kind, "integer" | "number"));
    let whole = || text.parse::<i64>().ok().map(Value::from);
    let real = || text.parse::<f64>().ok().and_then(Number::from_f64).map(Value::Number);
    let read = match text {
        "true" | "false" if kinds.contains(&"boolean") => Some(Value::Bool(text == "true")),
        _ if number => whole().or_else(real),
        _ => None,
    };
    read.unwrap_or_else(|| Value::from(text))
}

fn wrong(detail: &str, field: Option<String>) -> Error {
    let place = Place { field, ..Place::default() };
    Error::http_at(StatusCode::BAD_REQUEST, "wrong_query", detail, place)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "only whether it can be read is asked")]
    struct Asked {
        /// How many.
        limit: Option<u8>,
        #[schemars(example = &"left")]
        stream: StreamId,
        with_track: Option<bool>,
        within_m: Option<f64>,
        at: Option<String>,
    }

    #[derive(Debug, serde::Deserialize, JsonSchema)]
    #[serde(rename_all = "snake_case")]
    enum StreamId {
        Left,
        Right,
    }

    #[test]
    fn what_is_wrong_is_told_with_its_name() {
        for (query, told) in [
            (
                "stream=left&limit=many",
                "expected a whole number from 0 to 255, found \"many\" at limit in the query: correct it",
            ),
            (
                "stream=left&limit=300",
                "expected a whole number from 0 to 255, found 300 at limit in the query: correct it",
            ),
            ("stream=both", "expected one of left, right, found \"both\" at stream in the query: correct it"),
            ("limit=3", "expected one of left, right, found none at stream in the query: add it"),
            (
                "stream=left&with_track=yes",
                "expected true or false, found \"yes\" at with_track in the query: correct it",
            ),
            (
                "stream=left&colour=red",
                "expected only the fields at, limit, stream, with_track, within_m, found \"colour\" at colour in the query: leave it out, or correct its name",
            ),
            ("stream=left&stream=right", "expected stream once in the query, found it twice: leave one out"),
        ] {
            assert_eq!(read::<Asked>(query).unwrap_err().to_string(), told, "{query}");
        }
    }

    #[test]
    fn what_fits_is_read() {
        for query in [
            "stream=left",
            "stream=right&limit=3&with_track=true&within_m=0.5&at=12",
            "stream=left&within_m=3",
        ] {
            read::<Asked>(query).unwrap();
        }
    }
}
