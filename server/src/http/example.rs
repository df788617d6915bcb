//! What a value of a schema looks like: put together from the examples that stand beside the fields of the types.

use serde_json::{Map, Value, json};

/// An id, wherever one is shown.
const ID: &str = "0199f3a0-7c1e-7d52-9b1a-4f6e2d8c3b57";
/// A time, wherever one is shown.
const INSTANT: &str = "2026-11-28T08:15:00Z";
/// Types within types, at most.
const DEEPEST: usize = 20;

/// Makes examples from schemas that may refer to named ones.
#[derive(Clone, Copy, Debug)]
pub(super) struct Examples<'n> {
    /// The named schemas.
    pub(super) named: &'n Map<String, Value>,
}

impl<'n> Examples<'n> {
    /// A value of this schema, or which field lacks an example.
    pub(super) fn of(self, schema: &'n Value) -> Result<Value, String> {
        self.at("", schema, 0)
    }

    fn at(self, path: &str, schema: &'n Value, depth: usize) -> Result<Value, String> {
        if depth > DEEPEST {
            return Err(format!("{path}: types within types without an end"));
        }
        let parts = |key: &str| schema.get(key).and_then(Value::as_array);
        if let Some(example) = parts("examples").and_then(|all| all.first()) {
            return Ok(example.clone());
        }
        if let Some(word) = schema.get("const").or_else(|| parts("enum")?.first()) {
            return Ok(word.clone());
        }
        if let Some(name) = schema.get("$ref").and_then(Value::as_str).and_then(|to| to.rsplit('/').next()) {
            let named = self.named.get(name).ok_or_else(|| format!("{path}: there is no schema {name}"))?;
            return self.at(&format!("{path} ({name})"), named, depth + 1);
        }
        let alternatives = parts("oneOf").or_else(|| parts("anyOf"));
        let shown = alternatives.and_then(|all| all.iter().find(|one| !is_null(one)));
        let alternative = shown.map(|one| self.at(path, one, depth + 1)).transpose()?;
        match (kind(schema), alternative) {
            // Fields beside those of an alternative.
            (Some("object"), Some(Value::Object(more))) => {
                let mut fields = self.fields(path, schema, depth)?;
                fields.extend(more);
                Ok(Value::Object(fields))
            }
            (_, Some(alternative)) => Ok(alternative),
            (Some("object"), None) => self.fields(path, schema, depth).map(Value::Object),
            (Some("array"), None) => self.items(path, schema, depth),
            (Some("boolean"), None) => Ok(Value::Bool(false)),
            (Some("integer"), None) => Ok(json!(bound(schema, 1.0) as i64)),
            (Some("number"), None) => Ok(json!(bound(schema, 1.5))),
            (Some("string"), None) => match schema.get("format").and_then(Value::as_str) {
                Some("uuid") => Ok(json!(ID)),
                Some("date-time") => Ok(json!(INSTANT)),
                _ => Err(format!("{path}: text without an example")),
            },
            (kind, None) => {
                Err(format!("{path}: {} without an example", kind.unwrap_or("a value of any type")))
            }
        }
    }

    fn fields(self, path: &str, schema: &'n Value, depth: usize) -> Result<Map<String, Value>, String> {
        let known = schema.get("properties").and_then(Value::as_object);
        let fields = known.into_iter().flatten();
        fields
            .map(|(name, schema)| Ok((name.clone(), self.at(&format!("{path}.{name}"), schema, depth + 1)?)))
            .collect()
    }

    fn items(self, path: &str, schema: &'n Value, depth: usize) -> Result<Value, String> {
        if let Some(all) = schema.get("prefixItems").and_then(Value::as_array) {
            return all.iter().map(|one| self.at(path, one, depth + 1)).collect();
        }
        let item =
            schema.get("items").ok_or_else(|| format!("{path}: a list of anything without an example"))?;
        let least = schema.get("minItems").and_then(Value::as_u64).unwrap_or(1);
        let item = self.at(&format!("{path}[]"), item, depth + 1)?;
        Ok(Value::Array(vec![item; least.max(1) as usize]))
    }
}

fn is_null(schema: &Value) -> bool {
    schema.get("type").is_some_and(|kind| kind == "null")
}

/// A number within the bounds of its schema.
fn bound(schema: &Value, usual: f64) -> f64 {
    let limit = |key: &str| schema.get(key).and_then(Value::as_f64);
    usual.max(limit("minimum").unwrap_or(usual)).min(limit("maximum").unwrap_or(usual).max(usual))
}

/// The JSON type of what is shown: of several the first that is not null.
fn kind(schema: &Value) -> Option<&str> {
    match schema.get("type")? {
        Value::Array(some) => some.iter().filter_map(Value::as_str).find(|kind| *kind != "null"),
        one => one.as_str(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named() -> Map<String, Value> {
        let named = json!({
            "Walk": {"type": "object", "properties": {
                "id": {"type": "string", "format": "uuid"},
                "title": {"type": ["string", "null"], "examples": ["Ring road"]},
                "start_m": {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3},
                "state": {"$ref": "#/components/schemas/State"},
            }, "oneOf": [{"type": "object", "properties": {"live": {"type": "boolean"}}}]},
            "State": {"oneOf": [{"const": "live", "description": "Goes on."}, {"const": "finished"}]},
            "Endless": {"type": "object", "properties": {"next": {"$ref": "#/components/schemas/Endless"}}},
        });
        named.as_object().expect("an object").clone()
    }

    #[test]
    fn an_example_is_put_together_from_those_of_the_fields() {
        let named = named();
        let schema = json!({"type": "array", "items": {"$ref": "#/components/schemas/Walk"}});
        let walk = json!({"id": ID, "title": "Ring road", "start_m": [1.5, 1.5, 1.5], "state": "live", "live": false});
        assert_eq!(Examples { named: &named }.of(&schema), Ok(json!([walk])));
    }

    #[test]
    fn what_has_none_is_named() {
        let named = named();
        let examples = Examples { named: &named };
        let schema = json!({"type": "object", "properties": {"names": {"type": "array", "items": {"type": "string"}}}});
        assert_eq!(examples.of(&schema), Err(".names[]: text without an example".to_owned()));
        assert!(examples.of(&json!({"$ref": "#/components/schemas/Endless"})).is_err());
    }
}
