//! The named schemas of all operations. What is sent here and what is answered are described apart: a field that may be
//! left out of a request is always in the answer.

use std::collections::BTreeSet;

use schemars::SchemaGenerator;
use schemars::generate::SchemaSettings;
use serde_json::{Map, Value};

/// Where named schemas stand in the description.
const PLACE: &str = "#/components/schemas/";

/// The schemas of all operations.
#[derive(Debug)]
pub struct Schemas {
    /// Of what is sent here.
    pub(super) taken: SchemaGenerator,
    /// Of what is answered.
    pub(super) given: SchemaGenerator,
}

impl Schemas {
    /// None yet.
    pub fn new() -> Schemas {
        let settings =
            || SchemaSettings::draft2020_12().with(|s| s.definitions_path = "/components/schemas".into());
        Schemas {
            taken: settings().for_deserialize().into_generator(),
            given: settings().for_serialize().into_generator(),
        }
    }

    /// All that have a name. Where one is taken in another shape than it is given, the taken one is `…Input`.
    pub(super) fn named(mut self) -> Named {
        let mut taken = self.taken.take_definitions(true);
        let mut all = self.given.take_definitions(true);
        let mut differ: BTreeSet<String> = taken
            .iter()
            .filter(|(name, schema)| all.get(*name).is_some_and(|given| given != *schema))
            .map(|(name, _)| name.clone())
            .collect();
        // One that is the same but for what it refers to is another, too.
        loop {
            let more: Vec<String> = taken
                .iter()
                .filter(|(name, schema)| {
                    all.contains_key(*name)
                        && !differ.contains(*name)
                        && references(schema).iter().any(|to| differ.contains(*to))
                })
                .map(|(name, _)| name.clone())
                .collect();
            if more.is_empty() {
                break;
            }
            differ.extend(more);
        }
        for schema in taken.values_mut() {
            refer_to_inputs(schema, &differ);
        }
        for (name, schema) in taken {
            let name = if differ.contains(&name) { input(&name) } else { name };
            all.insert(name, schema);
        }
        Named { all, inputs: differ }
    }
}

impl Default for Schemas {
    fn default() -> Schemas {
        Schemas::new()
    }
}

/// The named schemas, put together.
pub(super) struct Named {
    /// By name.
    pub(super) all: Map<String, Value>,
    /// The names of those that are taken in another shape than they are given.
    inputs: BTreeSet<String>,
}

impl Named {
    /// Makes what is said of a request refer to the shapes that are taken.
    pub(super) fn of_request(&self, mut value: Value) -> Value {
        refer_to_inputs(&mut value, &self.inputs);
        value
    }
}

fn input(name: &str) -> String {
    format!("{name}Input")
}

/// The names that a schema refers to.
fn references(schema: &Value) -> Vec<&str> {
    match schema {
        Value::Object(fields) => {
            let own = fields.get("$ref").and_then(Value::as_str).and_then(|to| to.strip_prefix(PLACE));
            own.into_iter().chain(fields.values().flat_map(references)).collect()
        }
        Value::Array(items) => items.iter().flat_map(references).collect(),
        _ => Vec::new(),
    }
}

fn refer_to_inputs(schema: &mut Value, inputs: &BTreeSet<String>) {
    match schema {
        Value::Object(fields) => {
            if let Some(Value::String(to)) = fields.get_mut("$ref")
                && let Some(name) = to.strip_prefix(PLACE)
                && inputs.contains(name)
            {
                *to = format!("{PLACE}{}", input(name));
            }
            fields.values_mut().for_each(|value| refer_to_inputs(value, inputs));
        }
        Value::Array(items) => items.iter_mut().for_each(|value| refer_to_inputs(value, inputs)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use schemars::JsonSchema;
    use serde::{Deserialize, Serialize};

    use super::*;

    #[derive(Serialize, Deserialize, JsonSchema)]
    struct Walk {
        note: Note,
        state: State,
    }

    #[derive(Serialize, Deserialize, JsonSchema)]
    struct Note {
        #[serde(default)]
        starred: bool,
    }

    #[derive(Serialize, Deserialize, JsonSchema)]
    enum State {
        Live,
        Finished,
    }

    #[test]
    fn what_may_be_left_out_of_a_request_is_always_answered() {
        let mut schemas = Schemas::new();
        let request = schemas.taken.subschema_for::<Walk>().to_value();
        schemas.given.subschema_for::<Walk>();
        let named = schemas.named();
        let names: Vec<&str> = named.all.keys().map(String::as_str).collect();
        assert_eq!(names, ["Note", "NoteInput", "State", "Walk", "WalkInput"]);
        assert_eq!(named.all["Note"]["required"], serde_json::json!(["starred"]));
        assert_eq!(named.all["NoteInput"].get("required"), None);
        assert_eq!(named.of_request(request)["$ref"], "#/components/schemas/WalkInput");
        assert_eq!(named.all["WalkInput"]["properties"]["note"]["$ref"], "#/components/schemas/NoteInput");
        assert_eq!(named.all["WalkInput"]["properties"]["state"]["$ref"], "#/components/schemas/State");
    }
}
