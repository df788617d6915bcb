//! The JSON messages of the device socket, as `docs/wire.md` lays them out.

use std::collections::BTreeMap;

use serde::ser::SerializeSeq;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::parse::batch::{self, Batch, StreamKey};
use crate::parse::error::{ParseError, ParseErrorKind, quoted};
use crate::parse::range_rows;
use crate::sample::ImuSample;
use crate::stream::{FormerKeys, Readings, Rows, StreamId};

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
        /// The system; `None` for the usual one.
        #[serde(skip_serializing_if = "Option::is_none")]
        system: Option<String>,
        /// The streams that will send; `None` for those that the system usually has.
        #[serde(skip_serializing_if = "Option::is_none")]
        streams: Option<Vec<StreamId>>,
        /// Heading of the first sensor's x axis, clockwise from true north, degrees.
        #[serde(skip_serializing_if = "Option::is_none")]
        initial_heading_deg: Option<f64>,
        /// What the instrument is like, TOML as the system documents it.
        #[serde(skip_serializing_if = "Option::is_none")]
        instrument: Option<String>,
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
        /// The first batch of each stream that is not on disk yet.
        next_sequence: NextSequence,
    },
    /// Every batch of this stream up to this one is on disk.
    Ack {
        /// The stream.
        stream: StreamId,
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

/// The first batch of each stream that is not on disk yet.
pub type NextSequence = BTreeMap<StreamId, u64>;

impl DeviceMessage {
    /// Reads one text message; beside `stream` and `streams` these keys are taken for them.
    ///
    /// The type is read first and the message then straight into its struct: serde's own tagged
    /// enums would build a tree of every number in a batch.
    ///
    /// # Errors
    ///
    /// When it is not JSON, its type is not known, or a field is missing or wrong.
    pub fn from_json(text: &str, former: &[FormerKeys]) -> Result<DeviceMessage, ParseError> {
        #[derive(Deserialize)]
        struct Tag<'a> {
            #[serde(borrow, rename = "type")]
            name: std::borrow::Cow<'a, str>,
        }
        let tag: Tag<'_> = from_str(text, "a JSON object with a \"type\"")?;
        match tag.name.as_ref() {
            "hello" => from_str::<HelloFields>(text, "a hello")?.hello(former).map(DeviceMessage::Hello),
            "batch" => from_str::<BatchFields>(text, "a batch")?.batch(former).map(DeviceMessage::Batch),
            "ranges" => from_str::<RangesFields>(text, "ranges")?.batch().map(DeviceMessage::Batch),
            "visit" => from_str(text, "a visit").map(DeviceMessage::Visit),
            "fault" => from_str(text, "a fault").map(DeviceMessage::Fault),
            "finish" => Ok(DeviceMessage::Finish),
            other => Err(ParseError::new(
                ParseErrorKind::UnknownMessage,
                "a message of type hello, batch, ranges, visit, fault or finish",
                quoted(other.as_bytes()),
                "look the message up in the device protocol",
            )),
        }
    }

    /// The message as the text that a device sends.
    pub fn to_json(&self) -> String {
        text_of(self)
    }
}

impl Answer {
    /// Reads an answer, whatever its server calls a stream.
    ///
    /// # Errors
    ///
    /// When it is none.
    pub fn from_json(text: &str, former: &[FormerKeys]) -> serde_json::Result<Answer> {
        serde_json::from_str(text).or_else(|error| {
            let mut answer: serde_json::Value = serde_json::from_str(text)?;
            let fields = answer.as_object_mut().ok_or(error)?;
            if let Some(stream) = former.iter().find_map(|keys| fields.remove(keys.stream)) {
                fields.insert("stream".to_owned(), stream);
            }
            serde_json::from_value(answer)
        })
    }

    /// The text of the answer; a device that knows no streams reads what it calls one.
    pub fn to_json(&self, former: Option<&FormerKeys>) -> String {
        match (self, former) {
            (Answer::Ack { stream, sequence }, Some(former)) => {
                format!(r#"{{"type":"ack","{}":"{stream}","sequence":{sequence}}}"#, former.stream)
            }
            _ => text_of(self),
        }
    }
}

fn text_of(message: &impl Serialize) -> String {
    serde_json::to_string(message).expect("every key is a string and no field can fail to serialise")
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

/// What a message has beside the fields that are known by name.
type Others = BTreeMap<String, serde_json::Value>;

#[derive(Deserialize)]
struct HelloFields {
    session_id: Option<String>,
    inspector_id: Option<String>,
    start: Option<Start>,
    system: Option<String>,
    streams: Option<Vec<StreamId>>,
    instrument: Option<String>,
    initial_heading_deg: Option<f64>,
    #[serde(flatten)]
    others: Others,
}

impl HelloFields {
    fn hello(self, former: &[FormerKeys]) -> Result<Hello, ParseError> {
        let wrong = |found: &str| {
            ParseError::new(
                ParseErrorKind::NotJson,
                "a hello with either a session_id or an inspector_id",
                found,
                "name the session to go on with, or the inspector who begins one",
            )
        };
        match (self.session_id, self.inspector_id) {
            (Some(session_id), None) => Ok(Hello::Continue { session_id }),
            (None, Some(inspector_id)) => Ok(Hello::Begin {
                inspector_id,
                start: self.start,
                system: self.system,
                streams: match self.streams {
                    Some(streams) => Some(streams),
                    None => by_former_key(&self.others, former.iter().map(|keys| keys.streams))?,
                },
                initial_heading_deg: self.initial_heading_deg,
                instrument: self.instrument,
            }),
            (Some(_), Some(_)) => Err(wrong("both")),
            (None, None) => Err(wrong("neither")),
        }
    }
}

/// The value of the first of these keys that is there.
fn by_former_key<T: serde::de::DeserializeOwned>(
    others: &Others,
    mut keys: impl Iterator<Item = &'static str>,
) -> Result<Option<T>, ParseError> {
    let Some(value) = keys.find_map(|key| others.get(key)) else { return Ok(None) };
    let read = serde_json::from_value(value.clone()).map_err(|error| {
        ParseError::new(
            ParseErrorKind::NotJson,
            "names of streams",
            format!("{} ({error})", quoted(value.to_string().as_bytes())),
            "send the message as the device protocol lays it out",
        )
    })?;
    Ok(Some(read))
}

#[derive(Deserialize)]
struct BatchFields {
    stream: Option<StreamId>,
    sequence: u64,
    samples: Option<Vec<SampleRow>>,
    rows: Option<Vec<(i64, Vec<Option<f64>>)>>,
    #[serde(flatten)]
    others: Others,
}

impl BatchFields {
    fn batch(self, former: &[FormerKeys]) -> Result<Batch, ParseError> {
        let wrong = |expected: &str, found: &str| {
            let what = "send the message as the device protocol lays it out";
            ParseError::new(ParseErrorKind::NotJson, expected, found, what)
        };
        let stream = match self.stream {
            Some(stream) => Some(stream),
            None => by_former_key(&self.others, former.iter().map(|keys| keys.stream))?,
        };
        let stream = stream.ok_or_else(|| wrong("a batch with the name of its stream", "none"))?;
        let readings = match (self.samples, self.rows) {
            (Some(samples), None) => Readings::Imu(samples.into_iter().map(|row| row.0).collect()),
            (None, Some(rows)) => Readings::Values(rows_of(rows)?),
            (Some(_), Some(_)) => return Err(wrong("a batch with either samples or rows", "both")),
            (None, None) => return Err(wrong("a batch with either samples or rows", "neither")),
        };
        batch::check_size(readings.len())?;
        Ok(Batch { stream: StreamKey::Id(stream), sequence: self.sequence, readings })
    }
}

/// Ranges of a tag at one time: a batch of the stream of ranges, as who ranges has them.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RangesFields {
    #[serde(rename = "type")]
    _message: serde::de::IgnoredAny,
    stream: Option<StreamId>,
    sequence: u64,
    t_s: f64,
    ranges: Vec<RangeFields>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RangeFields {
    anchor: String,
    range_m: Option<f64>,
}

impl RangesFields {
    fn batch(self) -> Result<Batch, ParseError> {
        /// The stream where none is named.
        const RANGES: StreamId = StreamId::named("ranges");
        /// Beyond, times are no seconds of anything.
        const LATEST_S: f64 = 9e9;
        batch::check_size(self.ranges.len())?;
        if self.t_s.abs() >= LATEST_S {
            return Err(ParseError::new(
                ParseErrorKind::BadTime,
                "t_s in seconds of the GPS week, or of the session",
                format!("{}", self.t_s),
                "send seconds, not milliseconds",
            ));
        }
        let t_ns = libm::round(self.t_s * 1e9) as i64;
        let mut rows = Rows::new(range_rows::COLUMNS.len());
        for RangeFields { anchor, range_m } in &self.ranges {
            let name = range_rows::packed(anchor).ok_or_else(|| {
                ParseError::new(
                    ParseErrorKind::TooLong,
                    "the name of an anchor, 1 to 18 bytes",
                    quoted(anchor.as_bytes()),
                    "give the anchor a shorter name, here and in the survey",
                )
            })?;
            rows.push(t_ns, range_rows::values(t_ns, name, range_m.unwrap_or(f64::NAN)));
        }
        let stream = StreamKey::Id(self.stream.unwrap_or(RANGES));
        Ok(Batch { stream, sequence: self.sequence, readings: Readings::Values(rows) })
    }
}

/// Rows of equal length, as `[t_ns, [value, …]]`, null for a missing value.
fn rows_of(given: Vec<(i64, Vec<Option<f64>>)>) -> Result<Rows, ParseError> {
    let columns = given.first().map_or(0, |(_, values)| values.len());
    let odd = given.iter().find(|(_, values)| values.len() != columns || columns > Rows::MOST_COLUMNS);
    if let Some((t_ns, values)) = odd {
        return Err(ParseError::new(
            ParseErrorKind::NotJson,
            format!("rows of equally many numbers, at most {}", Rows::MOST_COLUMNS),
            format!("{columns} in the first, {} at {t_ns} ns", values.len()),
            "send every column of the stream in every row, null for a missing value",
        ));
    }
    let mut rows = Rows::new(columns);
    for (t_ns, values) in given {
        rows.push(t_ns, values.into_iter().map(|value| value.unwrap_or(f64::NAN)));
    }
    Ok(rows)
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

/// Under the name of its stream: a batch that has only its number is not sent as text.
impl Serialize for Batch {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Fields {
            stream: StreamId,
            sequence: u64,
            #[serde(skip_serializing_if = "Option::is_none")]
            samples: Option<Vec<SampleRow>>,
            #[serde(skip_serializing_if = "Option::is_none")]
            rows: Option<Vec<(i64, Vec<f64>)>>,
        }
        let StreamKey::Id(stream) = self.stream else {
            return Err(serde::ser::Error::custom("a batch without the name of its stream"));
        };
        let (samples, rows) = match &self.readings {
            Readings::Imu(samples) => (Some(samples.iter().copied().map(SampleRow).collect()), None),
            Readings::Values(rows) => {
                (None, Some(rows.iter().map(|(t_ns, values)| (t_ns, values.to_vec())).collect()))
            }
        };
        Fields { stream, sequence: self.sequence, samples, rows }.serialize(serializer)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const FORMER: &[FormerKeys] = &[FormerKeys { stream: "side", streams: "sides" }];

    fn read(text: &str) -> DeviceMessage {
        DeviceMessage::from_json(text, FORMER).unwrap()
    }

    #[test]
    fn the_examples_of_the_protocol_are_read() {
        assert_eq!(
            read(r#"{"type":"hello","session_id":"s1"}"#),
            DeviceMessage::Hello(Hello::Continue { session_id: "s1".into() })
        );
        assert_eq!(
            read(r#"{"type":"hello","inspector_id":"i1","start":{"marker":"A17"},"sides":["right"]}"#),
            DeviceMessage::Hello(Hello::Begin {
                inspector_id: "i1".into(),
                start: Some(Start::Marker("A17".into())),
                system: None,
                streams: Some(vec![StreamId::named("right")]),
                initial_heading_deg: None,
                instrument: None,
            })
        );
        let batch = read(
            r#"{"sequence":3,"samples":[[10,0.1,0.2,0.3,0,0,9.8,null,1,2,null],[20,0,0,0,null,0,0,1,2,3,900.5]],"side":"left","type":"batch"}"#,
        );
        let DeviceMessage::Batch(batch) = batch else { panic!("a batch") };
        assert_eq!((batch.stream, batch.sequence), (StreamKey::Id(StreamId::named("left")), 3));
        let Readings::Imu(samples) = batch.readings else { panic!("samples") };
        assert_eq!(samples.len(), 2);
        assert_eq!(samples[0].mag_b_ut, None);
        assert_eq!(samples[0].w_ib_b_rad_s, [0.1, 0.2, 0.3]);
        assert_eq!(samples[1].mag_b_ut, Some([1.0, 2.0, 3.0]));
        assert_eq!(samples[1].pressure_hpa, Some(900.5));
        assert!(samples[1].f_b_m_s2[0].is_nan());
        assert_eq!(
            read(r#"{"type":"visit","marker":"A17","t_start_ns":1,"t_end_ns":2}"#),
            DeviceMessage::Visit(VisitMessage { marker: "A17".into(), t_start_ns: 1, t_end_ns: 2 })
        );
        assert_eq!(read(r#"{"type":"finish"}"#), DeviceMessage::Finish);
    }

    #[test]
    fn rows_of_numbers_are_read_and_written_and_odd_ones_refused() {
        let text =
            r#"{"type":"batch","stream":"fix","sequence":0,"rows":[[10,[1.5,2.0,null]],[20,[3.0,4.0,5.0]]]}"#;
        let DeviceMessage::Batch(batch) = read(text) else { panic!("a batch") };
        let Readings::Values(rows) = &batch.readings else { panic!("rows") };
        assert_eq!(rows.get(1), Some((20, &[3.0, 4.0, 5.0][..])));
        assert!(rows.get(0).unwrap().1[2].is_nan());
        assert_eq!(DeviceMessage::Batch(batch).to_json(), text);
        let odd = r#"{"type":"batch","stream":"fix","sequence":0,"rows":[[10,[1]],[20,[3,4]]]}"#;
        let error = DeviceMessage::from_json(odd, FORMER).unwrap_err().to_string();
        assert!(error.contains("1 in the first, 2 at 20 ns"), "{error}");
    }

    #[test]
    fn ranges_are_the_rows_that_their_log_would_give() {
        let text = r#"{"type":"ranges","sequence":4,"t_s":116400.0501,"ranges":[{"anchor":"A1","range_m":3.25},{"anchor":"A2","range_m":null}]}"#;
        let DeviceMessage::Batch(batch) = read(text) else { panic!("a batch") };
        assert_eq!((batch.stream, batch.sequence), (StreamKey::Id(StreamId::named("ranges")), 4));
        let Readings::Values(rows) = batch.readings else { panic!("rows") };
        let (log, _) =
            range_rows::read(b"t_s,anchor,range_m\n116400.0501,A1,3.25\n116400.0501,A2,\n").unwrap();
        assert_eq!(rows, log);
        for (wrong, code) in [
            (text.replace("A1", "an-anchor-in-the-hall"), "too_long"),
            (text.replace("116400.0501", "1e12"), "bad_time"),
            (text.replace("range_m\":3.25", "range_mm\":3250"), "not_json"),
        ] {
            assert_eq!(DeviceMessage::from_json(&wrong, FORMER).unwrap_err().code(), code);
        }
    }

    #[test]
    fn wrong_messages_say_what_is_wrong() {
        let code = |text: &str| DeviceMessage::from_json(text, FORMER).unwrap_err().code();
        assert_eq!(code("hello"), "not_json");
        assert_eq!(code("{}"), "not_json");
        assert_eq!(code(r#"{"type":"hullo"}"#), "unknown_message");
        assert_eq!(code(r#"{"type":"hello"}"#), "not_json");
        assert_eq!(code(r#"{"type":"hello","session_id":"a","inspector_id":"b"}"#), "not_json");
        assert_eq!(code(r#"{"type":"batch","side":"left","sequence":0,"samples":[]}"#), "batch_size");
        assert_eq!(code(r#"{"type":"batch","side":"left","sequence":0,"samples":[[1,2]]}"#), "not_json");
        assert_eq!(
            code(r#"{"type":"batch","side":"left","sequence":0,"samples":[[1,0,0,0,0,0,9.8,0,0,0,0,0]]}"#),
            "not_json"
        );
        assert_eq!(code(r#"{"type":"batch","side":"Middle","sequence":0,"samples":[]}"#), "not_json");
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
            let message = DeviceMessage::Batch(Batch::imu(StreamId::named("left"), sequence, vec![sample]));
            prop_assert_eq!(read(&message.to_json()), message);
        }

        #[test]
        fn arbitrary_text_never_panics(text in ".{0,200}") {
            let _ = DeviceMessage::from_json(&text, FORMER);
        }
    }

    #[test]
    fn answers_read_as_they_are_written() {
        let welcome = Answer::Welcome {
            session_id: "s".into(),
            next_sequence: [(StreamId::named("left"), 3), (StreamId::named("right"), 0)].into(),
        };
        let text = serde_json::to_string(&welcome).unwrap();
        assert_eq!(text, r#"{"type":"welcome","session_id":"s","next_sequence":{"left":3,"right":0}}"#);
        assert_eq!(serde_json::from_str::<Answer>(&text).unwrap(), welcome);
        let error: Answer =
            serde_json::from_str(r#"{"type":"error","code":"sequence_gap","status":409}"#).unwrap();
        let Answer::Error(problem) = error else { panic!("an error") };
        assert_eq!(problem["code"], "sequence_gap");
        let ack = Answer::Ack { stream: StreamId::named("left"), sequence: 7 };
        assert_eq!(ack.to_json(None), r#"{"type":"ack","stream":"left","sequence":7}"#);
        assert_eq!(ack.to_json(FORMER.first()), r#"{"type":"ack","side":"left","sequence":7}"#);
    }
}
