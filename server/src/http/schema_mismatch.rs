//! Where a JSON body or a query does not fit what a route takes, by the same schema that describes the API.

use serde_json::Value;
use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;
use uuid::Uuid;

/// Letters of a value that are shown.
const SHOWN_LETTERS: usize = 40;
/// Whose values are not repeated, whatever stands there.
const SECRETS: [&str; 3] = ["password", "secret", "token"];

/// The first thing that does not fit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Mismatch {
    /// The field, as a path such as `visits[2].marker`; empty for the body itself.
    pub(super) field: String,
    /// What should be there.
    expected: String,
    /// What is there.
    found: String,
    /// What to do.
    advice: &'static str,
}

impl Mismatch {
    /// Expected, found, what to do, with words for where it is in between.
    pub(super) fn sentence(&self, place: &str) -> String {
        let Mismatch { expected, found, advice, .. } = self;
        format!("expected {expected}, found {found} {place}: {advice}")
    }
}

/// The first thing of a value that does not fit the schema; `None` where the schema sees nothing wrong.
pub(super) fn first_mismatch(value: &Value, schema: &Value) -> Option<Mismatch> {
    Search { root: schema }.search(schema, "", value)
}

struct Search<'s> {
    /// Where references point into.
    root: &'s Value,
}

impl<'s> Search<'s> {
    /// The schema itself, where this refers to one.
    fn resolved(&self, schema: &'s Value) -> &'s Value {
        let target = schema.get("$ref").and_then(Value::as_str).and_then(|to| to.strip_prefix('#'));
        target.and_then(|pointer| self.root.pointer(pointer)).unwrap_or(schema)
    }

    fn search(&self, schema: &'s Value, at: &str, value: &Value) -> Option<Mismatch> {
        let schema = self.resolved(schema);
        let parts = |key: &str| schema.get(key).and_then(Value::as_array);
        if let Some(found) =
            parts("allOf").into_iter().flatten().find_map(|part| self.search(part, at, value))
        {
            return Some(found);
        }
        if let Some(alternatives) = parts("anyOf").or_else(|| parts("oneOf")) {
            let found = self.of_alternatives(schema, alternatives, at, value);
            if found.is_some() {
                return found;
            }
        }
        let types = types(schema);
        let fits = types.is_empty() || types.iter().any(|kind| is_a(kind, value));
        let among = parts("enum").is_none_or(|words| words.contains(value))
            && schema.get("const").is_none_or(|word| word == value);
        let (least, most) = (number(schema, "minimum"), number(schema, "maximum"));
        let within = value.as_f64().is_none_or(|value| {
            least.is_none_or(|least| value >= least) && most.is_none_or(|most| value <= most)
        });
        let well_formed =
            value.as_str().is_none_or(|text| match schema.get("format").and_then(Value::as_str) {
                Some("uuid") => Uuid::parse_str(text).is_ok(),
                Some("date-time") => OffsetDateTime::parse(text, &Rfc3339).is_ok(),
                _ => true,
            });
        if !(fits && among && within && well_formed) {
            return Some(self.wrong(schema, at, value));
        }
        match value {
            Value::Object(fields) => self.of_object(schema, at, fields),
            Value::Array(items) => {
                let schema = schema.get("items")?;
                items
                    .iter()
                    .enumerate()
                    .find_map(|(k, item)| self.search(schema, &format!("{at}[{k}]"), item))
            }
            _ => None,
        }
    }

    fn wrong(&self, schema: &'s Value, at: &str, value: &Value) -> Mismatch {
        let advice = "correct it";
        Mismatch { field: at.to_owned(), expected: self.words(schema), found: shown(at, value), advice }
    }

    fn of_object(
        &self,
        schema: &'s Value,
        at: &str,
        fields: &serde_json::Map<String, Value>,
    ) -> Option<Mismatch> {
        let path = |name: &str| if at.is_empty() { name.to_owned() } else { format!("{at}.{name}") };
        let known = schema.get("properties").and_then(Value::as_object);
        let required = schema.get("required").and_then(Value::as_array);
        let missing =
            required.into_iter().flatten().filter_map(Value::as_str).find(|name| !fields.contains_key(*name));
        if let Some(name) = missing {
            let what = known.and_then(|known| known.get(name)).map(|schema| self.words(schema));
            return Some(Mismatch {
                field: path(name),
                expected: what.unwrap_or_else(|| "a value".to_owned()),
                found: "none".to_owned(),
                advice: "add it",
            });
        }
        let others = schema.get("additionalProperties");
        fields.iter().find_map(|(name, value)| match (known.and_then(|known| known.get(name)), others) {
            (Some(schema), _) => self.search(schema, &path(name), value),
            (None, Some(Value::Bool(false))) => {
                let names: Vec<&str> = known.into_iter().flatten().map(|(name, _)| name.as_str()).collect();
                Some(Mismatch {
                    field: path(name),
                    expected: match names.is_empty() {
                        true => "no field at all".to_owned(),
                        false => format!("only the fields {}", names.join(", ")),
                    },
                    found: format!("{:?}", short(name)),
                    advice: "leave it out, or correct its name",
                })
            }
            (None, Some(schema)) => self.search(schema, &path(name), value),
            (None, None) => None,
        })
    }

    fn of_alternatives(
        &self,
        schema: &'s Value,
        alternatives: &'s [Value],
        at: &str,
        value: &Value,
    ) -> Option<Mismatch> {
        if alternatives.iter().any(|one| self.search(one, at, value).is_none()) {
            return None;
        }
        let all = || alternatives.iter().map(|one| self.resolved(one));
        // Objects that are told apart by a word: the one with that word is meant.
        let tag = all().find_map(|one| {
            let fields = one.get("properties")?.as_object()?;
            fields.iter().find(|(_, schema)| schema.get("const").is_some()).map(|(name, _)| name)
        });
        if let (Value::Object(fields), Some(tag)) = (value, tag) {
            let word = |one: &'s Value| one.get("properties")?.get(tag)?.get("const");
            if let Some(one) = all().find(|&one| word(one).is_some() && word(one) == fields.get(tag)) {
                return self.search(one, at, value);
            }
            let words: Vec<String> = all().filter_map(word).map(plain).collect();
            let field = if at.is_empty() { tag.clone() } else { format!("{at}.{tag}") };
            let found = fields.get(tag).map_or("none".to_owned(), |value| shown(&field, value));
            return Some(Mismatch {
                expected: format!("one of {}", words.join(", ")),
                found,
                field,
                advice: "correct it",
            });
        }
        let alike: Vec<&Value> =
            all().filter(|one| types(one).iter().any(|kind| is_a(kind, value))).collect();
        match alike[..] {
            [one] if one.get("const").is_none() => self.search(one, at, value),
            _ => Some(self.wrong(schema, at, value)),
        }
    }

    /// What a schema asks for, in words.
    fn words(&self, schema: &'s Value) -> String {
        let schema = self.resolved(schema);
        let parts = |key: &str| schema.get(key).and_then(Value::as_array);
        if let Some(word) = schema.get("const") {
            return plain(word);
        }
        if let Some(words) = parts("enum") {
            return format!("one of {}", words.iter().map(plain).collect::<Vec<_>>().join(", "));
        }
        if let Some(alternatives) = parts("anyOf").or_else(|| parts("oneOf")) {
            let all: Vec<&Value> = alternatives.iter().map(|one| self.resolved(one)).collect();
            let consts: Vec<String> = all.iter().filter_map(|one| one.get("const")).map(plain).collect();
            if consts.len() == all.len() {
                return format!("one of {}", consts.join(", "));
            }
            return all.iter().map(|one| self.words(one)).collect::<Vec<_>>().join(" or ");
        }
        let format = schema.get("format").and_then(Value::as_str);
        let bounds = match (number(schema, "minimum"), number(schema, "maximum")) {
            (Some(least), Some(most)) => format!(" from {least} to {most}"),
            (Some(least), None) => format!(" of at least {least}"),
            (None, Some(most)) => format!(" of at most {most}"),
            (None, None) => String::new(),
        };
        let one = |kind: &str| match (kind, format) {
            ("string", Some("uuid")) => "an id (a UUID)".to_owned(),
            ("string", Some("date-time")) => "a time such as 2026-11-28T08:15:00Z".to_owned(),
            ("string", _) => "text".to_owned(),
            ("integer", _) => format!("a whole number{bounds}"),
            ("number", _) => format!("a number{bounds}"),
            ("boolean", _) => "true or false".to_owned(),
            ("array", _) => "a list".to_owned(),
            ("object", _) => {
                let names = parts("required").into_iter().flatten().filter_map(Value::as_str);
                let names: Vec<&str> = names.collect();
                if names.is_empty() {
                    "an object".to_owned()
                } else {
                    format!("an object with {}", names.join(", "))
                }
            }
            (other, _) => other.to_owned(),
        };
        let kinds: Vec<String> = types(schema).into_iter().map(one).collect();
        if kinds.is_empty() { "another value".to_owned() } else { kinds.join(" or ") }
    }
}

/// The JSON types that a schema allows; none: all.
pub(super) fn types(schema: &Value) -> Vec<&str> {
    match schema.get("type") {
        Some(Value::String(one)) => vec![one],
        Some(Value::Array(some)) => some.iter().filter_map(Value::as_str).collect(),
        _ => Vec::new(),
    }
}

fn is_a(kind: &str, value: &Value) -> bool {
    match kind {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "integer" => value.is_i64() || value.is_u64(),
        "number" => value.is_number(),
        "string" => value.is_string(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        _ => false,
    }
}

fn number(schema: &Value, bound: &str) -> Option<f64> {
    schema.get(bound).and_then(Value::as_f64)
}

/// A word of an enumeration, without quotes.
fn plain(word: &Value) -> String {
    word.as_str().map_or_else(|| word.to_string(), str::to_owned)
}

/// What stands there, as far as a sentence bears it.
fn shown(field: &str, value: &Value) -> String {
    let name = field.rsplit('.').next().unwrap_or(field);
    match value {
        Value::Array(items) => format!("a list of {}", items.len()),
        Value::Object(_) => "an object".to_owned(),
        Value::Null => "null".to_owned(),
        _ if SECRETS.iter().any(|secret| name.contains(secret)) => "something else".to_owned(),
        Value::String(text) => format!("{:?}", short(text)),
        other => other.to_string(),
    }
}

fn short(text: &str) -> String {
    let mut short: String = text.chars().take(SHOWN_LETTERS).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    short
}
