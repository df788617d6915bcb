//! The name of a stream in JSON, beside it under the keys of clients that know no streams.

use std::borrow::Cow;
use std::collections::BTreeMap;

use lodestep_engine::stream::StreamId;
use lodestep_engine::systems::catalogue;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserialize, Deserializer, Error};
use serde::ser::SerializeMap as _;
use serde::{Serialize, Serializer};
use serde_json::Value;

/// A field for `#[serde(flatten)]`: written as `stream` and, where a system has such a stream and is older than streams,
/// under its former key, too; read from either.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StreamField(pub StreamId);

/// The same of what may concern several streams: null then.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct OptionalStreamField(pub Option<StreamId>);

fn write<S: Serializer>(stream: Option<StreamId>, to: S) -> Result<S::Ok, S::Error> {
    let mut map = to.serialize_map(None)?;
    map.serialize_entry("stream", &stream)?;
    let former = match stream {
        Some(stream) => catalogue::former_keys_of(stream).into_iter().collect(),
        None => catalogue::former_keys(),
    };
    for keys in former {
        map.serialize_entry(keys.stream, &stream)?;
    }
    map.end()
}

fn read<'de, D: Deserializer<'de>>(from: D) -> Result<Option<StreamId>, D::Error> {
    let fields = BTreeMap::<String, Value>::deserialize(from)?;
    let former = catalogue::former_keys().into_iter().map(|keys| keys.stream);
    let found = std::iter::once("stream").chain(former).find_map(|key| fields.get(key));
    let Some(value) = found.filter(|value| !value.is_null()) else { return Ok(None) };
    serde_json::from_value(value.clone()).map_err(D::Error::custom)
}

impl Serialize for StreamField {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        write(Some(self.0), to)
    }
}

impl Serialize for OptionalStreamField {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        write(self.0, to)
    }
}

impl<'de> Deserialize<'de> for StreamField {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        read(from)?.map(StreamField).ok_or_else(|| D::Error::custom("missing field `stream`"))
    }
}

impl<'de> Deserialize<'de> for OptionalStreamField {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        read(from).map(OptionalStreamField)
    }
}

/// The fields of a request with the keys of clients that know no streams put right.
pub(crate) fn with_stream_keys(mut request: Value) -> Value {
    if let Value::Object(fields) = &mut request {
        for keys in catalogue::former_keys() {
            for (former, key) in [(keys.stream, "stream"), (keys.streams, "streams")] {
                if !fields.contains_key(key)
                    && let Some(value) = fields.remove(former)
                {
                    fields.insert(key.to_owned(), value);
                }
            }
        }
    }
    request
}

/// `stream` and the former keys, each a name.
fn schema(kind: &Value) -> Schema {
    let keys = std::iter::once("stream").chain(catalogue::former_keys().into_iter().map(|keys| keys.stream));
    let properties: BTreeMap<&str, Value> = keys
        .map(|key| (key, serde_json::json!({ "type": kind, "description": "The name of a stream.", "examples": ["left"] })))
        .collect();
    json_schema!({ "type": "object", "properties": properties })
}

impl JsonSchema for StreamField {
    fn schema_name() -> Cow<'static, str> {
        "StreamName".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        schema(&"string".into())
    }
}

impl JsonSchema for OptionalStreamField {
    fn schema_name() -> Cow<'static, str> {
        "OptionalStreamName".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        schema(&serde_json::json!(["string", "null"]))
    }
}

#[cfg(test)]
mod tests {
    use lodestep_engine::systems::pedestrian::LEFT;
    use serde::{Deserialize, Serialize};

    use super::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct Log {
        id: u8,
        #[serde(flatten)]
        stream: StreamField,
    }

    #[test]
    fn a_stream_is_written_under_both_keys_and_read_from_either() {
        let former = catalogue::usual().former_keys.unwrap().stream;
        let log = Log { id: 7, stream: StreamField(LEFT) };
        assert_eq!(
            serde_json::to_value(&log).unwrap(),
            serde_json::json!({ "id": 7, "stream": "left", former: "left" })
        );
        for key in ["stream", former] {
            let read: Log = serde_json::from_value(serde_json::json!({ "id": 7, key: "left" })).unwrap();
            assert_eq!(read, log);
        }
        let fix = Log { id: 7, stream: StreamField(StreamId::named("fix")) };
        assert_eq!(serde_json::to_value(&fix).unwrap(), serde_json::json!({ "id": 7, "stream": "fix" }));
        assert!(serde_json::from_value::<Log>(serde_json::json!({ "id": 7 })).is_err());
        let none = serde_json::to_value(OptionalStreamField(None)).unwrap();
        assert_eq!(none, serde_json::json!({ "stream": null, former: null }));
    }
}
