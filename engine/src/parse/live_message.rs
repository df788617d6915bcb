//! The JSON messages of the device socket, as `docs/wire.md` lays them out.

use serde::ser::SerializeSeq;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::parse::batch::{self, Batch};
use crate::parse::error::{ParseError, ParseErrorKind, quoted};
use crate::sample::{Foot, ImuSample};

/// What a device says in text.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum DeviceMessage {
    /// The first message of a socket.
    Hello(Hello),
    /// Some samples.
    Batch(Batch),
    /// The inspector stood at a marker.
    Visit(VisitMessage),
    /// The inspector found a fault.
    Fault(FaultMessage),
    /// The walk is over.
    Finish,
}

/// Which session a socket is about.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Hello {
    /// Go on with a session.
    Continue {
        /// Its id.
        session_id: String,
    },
    /// Begin one.
    Begin {
        /// Whose walk it is.
        inspector_id: String,
        /// Where it starts; `None` for the site's origin.
        #[serde(skip_serializing_if = "Option::is_none")]
        start: Option<Start>,
        /// The feet that will send.
        feet: Vec<Foot>,
        /// Heading of the first sensor's x axis, clockwise from true north, degrees.
        #[serde(skip_serializing_if = "Option::is_none")]
        initial_heading_deg: Option<f64>,
    },
}

/// Where a session starts: `{"marker":"A17"}` or `{"position_m":[e,n,u]}`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Start {
    /// At a marker.
    Marker(String),
    /// At a position, east-north-up from the site's origin, m.
    PositionM([f64; 3]),
}

/// The inspector stood at a marker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VisitMessage {
    /// The marker's name.
    pub marker: String,
    /// When the inspector arrived, ns since the session's start.
    pub t_start_ns: i64,
    /// When the inspector left, ns since the session's start.
    pub t_end_ns: i64,
}

/// The inspector found a fault.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FaultMessage {
    /// What kind of fault.
    pub kind: String,
    /// How bad it is: `low`, `medium` or `high`.
    pub severity: String,
    /// What the inspector has to say about it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub text: Option<String>,
    /// The marker that the inspector named, when one was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub marker: Option<String>,
    /// When, ns since the session's start.
    pub t_ns: i64,
}

/// What the server answers on the device socket.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum Answer {
    /// To the hello.
    Welcome {
        /// The session's id.
        session_id: String,
        /// The first batch of each foot that is not on disk yet.
        next_sequence: NextSequence,
    },
    /// Every batch of this foot up to this one is on disk.
    Ack {
        /// The foot.
        foot: Foot,
        /// The last batch that is on disk.
        sequence: u64,
    },
    /// A visit or a fault has been stored.
    Event(serde_json::Map<String, serde_json::Value>),
    /// Something was wrong: a problem document.
    Error(serde_json::Map<String, serde_json::Value>),
    /// The session is finished.
    Finished,
}

/// The first batch of each foot that is not on disk yet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct NextSequence {
    /// Of the left foot.
    pub left: u64,
    /// Of the right foot.
    pub right: u64,
}

impl DeviceMessage {
    /// Reads one text message.
    ///
    /// The type is read first and the message then straight into its struct: serde's own tagged
    /// enums would build a tree of every number in a batch.
    ///
    /// # Errors
    ///
    /// When it is not JSON, its type is not known, or a field is missing or wrong.
    pub fn from_json(text: &str) -> Result<DeviceMessage, ParseError> {
        #[derive(Deserialize)]
        struct Tag<'a> {
            #[serde(borrow, rename = "type")]
            name: std::borrow::Cow<'a, str>,
        }
        let tag: Tag<'_> = from_str(text, "a JSON object with a \"type\"")?;
        match tag.name.as_ref() {
            "hello" => from_str::<HelloFields>(text, "a hello")?.try_into().map(DeviceMessage::Hello),
            "batch" => {
                let fields: BatchFields = from_str(text, "a batch")?;
                batch::check_size(fields.samples.len())?;
                let samples = fields.samples.into_iter().map(|row| row.0).collect();
                Ok(DeviceMessage::Batch(Batch { foot: fields.foot, sequence: fields.sequence, samples }))
            }
            "visit" => from_str(text, "a visit").map(DeviceMessage::Visit),
            "fault" => from_str(text, "a fault").map(DeviceMessage::Fault),
            "finish" => Ok(DeviceMessage::Finish),
            other => Err(ParseError::new(
                ParseErrorKind::UnknownMessage,
                "a message of type hello, batch, visit, fault or finish",
                quoted(other.as_bytes()),
                "look the message up in the device protocol",
            )),
        }
    }

    /// The message as the text that a device sends.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).expect("every key is a string and no field can fail to serialise")
    }
}

fn from_str<'a, T: Deserialize<'a>>(text: &'a str, what: &str) -> Result<T, ParseError> {
    serde_json::from_str(text).map_err(|error| {
        ParseError::new(
            ParseErrorKind::NotJson,
            format!("{what} as JSON"),
            format!("{} ({error})", quoted(text.as_bytes())),
            "send the message as the device protocol lays it out",
        )
    })
}

#[derive(Deserialize)]
struct HelloFields {
    session_id: Option<String>,
    inspector_id: Option<String>,
    start: Option<Start>,
    feet: Option<Vec<Foot>>,
    initial_heading_deg: Option<f64>,
}

impl TryFrom<HelloFields> for Hello {
    type Error = ParseError;

    fn try_from(fields: HelloFields) -> Result<Hello, ParseError> {
        let wrong = |found: &str| {
            ParseError::new(
                ParseErrorKind::NotJson,
                "a hello with either a session_id or an inspector_id",
                found,
                "name the session to go on with, or the inspector who begins one",
            )
        };
        match (fields.session_id, fields.inspector_id) {
            (Some(session_id), None) => Ok(Hello::Continue { session_id }),
            (None, Some(inspector_id)) => Ok(Hello::Begin {
                inspector_id,
                start: fields.start,
                feet: fields.feet.unwrap_or_else(|| Foot::BOTH.to_vec()),
                initial_heading_deg: fields.initial_heading_deg,
            }),
            (Some(_), Some(_)) => Err(wrong("both")),
            (None, None) => Err(wrong("neither")),
        }
    }
}

#[derive(Deserialize)]
struct BatchFields {
    foot: Foot,
    sequence: u64,
    samples: Vec<SampleRow>,
}

/// A sample as `[t_ns, gx, gy, gz, ax, ay, az, mx, my, mz, p]`, null for a missing value.
struct SampleRow(ImuSample);

type Channel = Option<f64>;
type Row = (i64, Channel, Channel, Channel, Channel, Channel, Channel, Channel, Channel, Channel, Channel);

impl<'de> Deserialize<'de> for SampleRow {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (t_ns, gx, gy, gz, ax, ay, az, mx, my, mz, p) = Row::deserialize(deserializer)?;
        let channels = [gx, gy, gz, ax, ay, az, mx, my, mz, p].map(|value| value.unwrap_or(f64::NAN));
        Ok(SampleRow(batch::sample(t_ns, channels)))
    }
}

impl Serialize for SampleRow {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut row = serializer.serialize_seq(Some(11))?;
        row.serialize_element(&self.0.t_ns)?;
        // JSON has no NaN: serde_json writes null.
        for value in batch::channels(&self.0) {
            row.serialize_element(&value)?;
        }
        row.end()
    }
}

impl Serialize for Batch {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Fields {
            foot: Foot,
            sequence: u64,
            samples: Vec<SampleRow>,
        }
        let samples = self.samples.iter().copied().map(SampleRow).collect();
        Fields { foot: self.foot, sequence: self.sequence, samples }.serialize(serializer)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn read(text: &str) -> DeviceMessage {
        DeviceMessage::from_json(text).unwrap()
    }

    #[test]
    fn the_examples_of_the_protocol_are_read() {
        assert_eq!(
            read(r#"{"type":"hello","session_id":"s1"}"#),
            DeviceMessage::Hello(Hello::Continue { session_id: "s1".into() })
        );
        assert_eq!(
            read(r#"{"type":"hello","inspector_id":"i1","start":{"marker":"A17"},"feet":["right"]}"#),
            DeviceMessage::Hello(Hello::Begin {
                inspector_id: "i1".into(),
                start: Some(Start::Marker("A17".into())),
                feet: vec![Foot::Right],
                initial_heading_deg: None,
            })
        );
        let batch = read(
            r#"{"sequence":3,"samples":[[10,0.1,0.2,0.3,0,0,9.8,null,1,2,null],[20,0,0,0,null,0,0,1,2,3,900.5]],"foot":"left","type":"batch"}"#,
        );
        let DeviceMessage::Batch(batch) = batch else { panic!("a batch") };
        assert_eq!((batch.foot, batch.sequence, batch.samples.len()), (Foot::Left, 3, 2));
        assert_eq!(batch.samples[0].mag_b_ut, None);
        assert_eq!(batch.samples[0].w_ib_b_rad_s, [0.1, 0.2, 0.3]);
        assert_eq!(batch.samples[1].mag_b_ut, Some([1.0, 2.0, 3.0]));
        assert_eq!(batch.samples[1].pressure_hpa, Some(900.5));
        assert!(batch.samples[1].f_b_m_s2[0].is_nan());
        assert_eq!(
            read(r#"{"type":"visit","marker":"A17","t_start_ns":1,"t_end_ns":2}"#),
            DeviceMessage::Visit(VisitMessage { marker: "A17".into(), t_start_ns: 1, t_end_ns: 2 })
        );
        assert_eq!(read(r#"{"type":"finish"}"#), DeviceMessage::Finish);
    }

    #[test]
    fn wrong_messages_say_what_is_wrong() {
        let code = |text: &str| DeviceMessage::from_json(text).unwrap_err().code();
        assert_eq!(code("hello"), "not_json");
        assert_eq!(code("{}"), "not_json");
        assert_eq!(code(r#"{"type":"hullo"}"#), "unknown_message");
        assert_eq!(code(r#"{"type":"hello"}"#), "not_json");
        assert_eq!(code(r#"{"type":"hello","session_id":"a","inspector_id":"b"}"#), "not_json");
        assert_eq!(code(r#"{"type":"batch","foot":"left","sequence":0,"samples":[]}"#), "batch_size");
        assert_eq!(code(r#"{"type":"batch","foot":"left","sequence":0,"samples":[[1,2]]}"#), "not_json");
        assert_eq!(
            code(r#"{"type":"batch","foot":"left","sequence":0,"samples":[[1,0,0,0,0,0,9.8,0,0,0,0,0]]}"#),
            "not_json"
        );
        assert_eq!(code(r#"{"type":"batch","foot":"middle","sequence":0,"samples":[]}"#), "not_json");
    }

    proptest! {
        #[test]
        fn a_batch_keeps_its_bits(
            t_ns in any::<i64>(),
            channels in prop::array::uniform10(prop::num::f64::NORMAL | prop::num::f64::ZERO | prop::num::f64::SUBNORMAL),
            has_mag in any::<bool>(),
            sequence in any::<u64>(),
        ) {
            let mut sample = batch::sample(t_ns, channels);
            if !has_mag { sample.mag_b_ut = None; }
            let message = DeviceMessage::Batch(Batch { foot: Foot::Left, sequence, samples: vec![sample] });
            prop_assert_eq!(read(&message.to_json()), message);
        }

        #[test]
        fn arbitrary_text_never_panics(text in ".{0,200}") {
            let _ = DeviceMessage::from_json(&text);
        }
    }

    #[test]
    fn answers_read_as_they_are_written() {
        let welcome =
            Answer::Welcome { session_id: "s".into(), next_sequence: NextSequence { left: 3, right: 0 } };
        let text = serde_json::to_string(&welcome).unwrap();
        assert_eq!(text, r#"{"type":"welcome","session_id":"s","next_sequence":{"left":3,"right":0}}"#);
        assert_eq!(serde_json::from_str::<Answer>(&text).unwrap(), welcome);
        let error: Answer =
            serde_json::from_str(r#"{"type":"error","code":"sequence_gap","status":409}"#).unwrap();
        let Answer::Error(problem) = error else { panic!("an error") };
        assert_eq!(problem["code"], "sequence_gap");
    }
}
