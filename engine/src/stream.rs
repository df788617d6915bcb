//! Streams: what a session's readings come in, one sensor or instrument each.

use std::fmt;

use serde::de::{Deserialize, Deserializer, Error};
use serde::{Serialize, Serializer};

use crate::sample::ImuSample;

/// The longest name of a stream, bytes.
const MOST_BYTES: usize = 16;

/// Names a stream within its session: `left`, `gnss`, `station_2`. Lower-case letters, digits and `_`, at most 16.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct StreamId([u8; MOST_BYTES]);

impl StreamId {
    /// The stream of this name.
    ///
    /// # Panics
    ///
    /// Where it can be no name of a stream: while compiling, for a constant.
    pub const fn named(name: &str) -> StreamId {
        match StreamId::checked(name.as_bytes()) {
            Some(id) => id,
            None => panic!("a stream is named by 1 to 16 lower-case letters, digits and underscores"),
        }
    }

    /// The stream of a name that was read; `None` where it can be no name of a stream.
    pub const fn read(name: &str) -> Option<StreamId> {
        StreamId::checked(name.as_bytes())
    }

    const fn checked(bytes: &[u8]) -> Option<StreamId> {
        if bytes.is_empty() || bytes.len() > MOST_BYTES {
            return None;
        }
        let mut name = [0; MOST_BYTES];
        let mut at = 0;
        while at < bytes.len() {
            let byte = bytes[at];
            if !(byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'_') {
                return None;
            }
            name[at] = byte;
            at += 1;
        }
        Some(StreamId(name))
    }

    /// The name, as files, messages and tables spell it.
    pub fn name(&self) -> &str {
        let length = self.0.iter().position(|byte| *byte == 0).unwrap_or(MOST_BYTES);
        // Only ASCII goes in.
        std::str::from_utf8(&self.0[..length]).unwrap_or_default()
    }
}

impl fmt::Debug for StreamId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl fmt::Display for StreamId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl Serialize for StreamId {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for StreamId {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<StreamId, D::Error> {
        let name = String::deserialize(from)?;
        StreamId::read(&name).ok_or_else(|| {
            D::Error::custom(format!(
                "expected the name of a stream (1 to 16 lower-case letters, digits and underscores), found {name:?}"
            ))
        })
    }
}

/// What the readings of a stream are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Those of an inertial sensor, with field and pressure where it has them.
    Imu,
    /// Rows of numbers, in the columns that the system declares for the stream.
    Values,
}

impl Kind {
    /// Its word.
    pub fn word(self) -> &'static str {
        match self {
            Kind::Imu => "imu",
            Kind::Values => "values",
        }
    }

    /// The kind of that word.
    pub fn named(word: &str) -> Option<Kind> {
        [Kind::Imu, Kind::Values].into_iter().find(|kind| kind.word() == word)
    }
}

/// One stream of a session.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Stream {
    /// Its name.
    pub id: StreamId,
    /// Its number within the session, as binary frames carry it.
    pub number: u8,
    /// What it is to the system: the role of one of the rules that the system declares.
    pub role: String,
    /// What its readings are.
    pub kind: Kind,
    /// From the body's origin to where it measures, in b, m; `None` where the system does not need it.
    pub lever_arm_b_m: Option<[f64; 3]>,
}

/// What clients that know no streams call them, in messages of a system that is older than streams.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FormerKeys {
    /// The key for one stream, in place of `stream`.
    pub stream: &'static str,
    /// The key for a list of streams, in place of `streams`.
    pub streams: &'static str,
}

/// One reading of a stream.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reading<'a> {
    /// Of an inertial sensor.
    Imu(&'a ImuSample),
    /// A row of numbers.
    Values {
        /// Time since the session's start, on the session's clock, ns.
        t_ns: i64,
        /// In the order of the stream's columns; NaN where there is none.
        values: &'a [f64],
    },
}

/// Rows of numbers, each with its time.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    columns: usize,
    t_ns: Vec<i64>,
    values: Vec<f64>,
}

impl Rows {
    /// The most numbers that a row may have.
    pub const MOST_COLUMNS: usize = 32;

    /// No rows yet, of so many numbers each.
    pub fn new(columns: usize) -> Rows {
        Rows { columns, t_ns: Vec::new(), values: Vec::new() }
    }

    /// How many numbers a row has.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// How many rows there are.
    pub fn len(&self) -> usize {
        self.t_ns.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.t_ns.is_empty()
    }

    /// Appends a row; what it has too little is NaN, what it has too much is left out.
    pub fn push(&mut self, t_ns: i64, values: impl IntoIterator<Item = f64>) {
        self.t_ns.push(t_ns);
        self.values.extend(values.into_iter().take(self.columns));
        self.values.resize(self.t_ns.len() * self.columns, f64::NAN);
    }

    /// Row number `number`.
    pub fn get(&self, number: usize) -> Option<(i64, &[f64])> {
        let values = self.values.get(number * self.columns..(number + 1) * self.columns)?;
        Some((*self.t_ns.get(number)?, values))
    }

    /// The rows in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (i64, &[f64])> {
        let values = |number: usize| &self.values[number * self.columns..][..self.columns];
        self.t_ns.iter().enumerate().map(move |(number, t_ns)| (*t_ns, values(number)))
    }
}

/// The same bits, a NaN among them.
impl PartialEq for Rows {
    fn eq(&self, other: &Rows) -> bool {
        let same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
        (self.columns, &self.t_ns) == (other.columns, &other.t_ns)
            && self.values.iter().zip(&other.values).all(same)
    }
}

/// Some readings of one stream.
#[derive(Clone, Debug, PartialEq)]
pub enum Readings {
    /// Of an inertial sensor.
    Imu(Vec<ImuSample>),
    /// Rows of numbers.
    Values(Rows),
}

impl Readings {
    /// None yet, of a stream of this kind whose rows have so many numbers.
    pub fn none_of(kind: Kind, columns: usize) -> Readings {
        match kind {
            Kind::Imu => Readings::Imu(Vec::new()),
            Kind::Values => Readings::Values(Rows::new(columns)),
        }
    }

    /// What they are.
    pub fn kind(&self) -> Kind {
        match self {
            Readings::Imu(_) => Kind::Imu,
            Readings::Values(_) => Kind::Values,
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Readings::Imu(samples) => samples.len(),
            Readings::Values(rows) => rows.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Appends others of the same kind; of another kind there is none to append.
    pub fn append(&mut self, others: Readings) {
        match (self, others) {
            (Readings::Imu(samples), Readings::Imu(others)) => samples.extend(others),
            (Readings::Values(rows), Readings::Values(others)) => {
                others.iter().for_each(|(t_ns, values)| rows.push(t_ns, values.iter().copied()));
            }
            _ => {}
        }
    }

    /// Takes the readings from number `at` on out of these.
    pub fn split_off(&mut self, at: usize) -> Readings {
        match self {
            Readings::Imu(samples) => Readings::Imu(samples.split_off(at)),
            Readings::Values(rows) => Readings::Values(Rows {
                columns: rows.columns,
                t_ns: rows.t_ns.split_off(at),
                values: rows.values.split_off(at * rows.columns),
            }),
        }
    }

    /// Reading number `number`.
    pub fn get(&self, number: usize) -> Option<Reading<'_>> {
        match self {
            Readings::Imu(samples) => samples.get(number).map(Reading::Imu),
            Readings::Values(rows) => rows.get(number).map(|(t_ns, values)| Reading::Values { t_ns, values }),
        }
    }

    /// The readings in order.
    pub fn iter(&self) -> impl Iterator<Item = Reading<'_>> {
        (0..self.len()).filter_map(|number| self.get(number))
    }
}

impl Reading<'_> {
    /// Its time, ns.
    pub fn t_ns(&self) -> i64 {
        match self {
            Reading::Imu(sample) => sample.t_ns,
            Reading::Values { t_ns, .. } => *t_ns,
        }
    }
}

impl<'a> From<&'a ImuSample> for Reading<'a> {
    fn from(sample: &'a ImuSample) -> Self {
        Reading::Imu(sample)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_s_name_comes_back_from_json_and_bytes_and_nothing_else_is_one() {
        for name in ["left", "gnss", "station_12", "sixteen_letters_"] {
            let id = StreamId::named(name);
            assert_eq!((id.name(), format!("{id:>20}").len()), (name, 20));
            let text = serde_json::to_string(&id).unwrap();
            assert_eq!(serde_json::from_str::<StreamId>(&text).unwrap(), id);
            let bytes = postcard::to_allocvec(&id).unwrap();
            assert_eq!(postcard::from_bytes::<StreamId>(&bytes).unwrap(), id);
        }
        for wrong in ["", "Left", "left foot", "seventeen_letters"] {
            assert_eq!(StreamId::read(wrong), None, "{wrong:?}");
        }
        assert!(StreamId::named("left") < StreamId::named("right"), "names are in the order of the alphabet");
    }
}
