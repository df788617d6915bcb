//! The units in which a device sends: said in its hello, and checked by its first samples, before they are stored.
//!
//! A hello may bear `"units":{"time":"ms","gyr":"deg_s","acc":"g"}`, in the words of a log's mapping; what it does not name is in
//! the units of the protocol: ns since the session's start, rad/s, m/s², µT, hPa. Times in something else show in the first
//! samples, and so does the unit of the force, for a walk begins at rest.

use serde::{Deserialize, Serialize};

use crate::parse::batch::{Batch, StreamKey};
use crate::parse::error::{ParseError, ParseErrorKind, quoted};
use crate::parse::log_reader::is_of_a_calendar;
use crate::parse::mapping::{Factor, FieldUnit, ForceUnit, PressureUnit, RateUnit, TimeUnit};
use crate::parse::units_check::Looks;
use crate::sample::ImuSample;
use crate::stream::Readings;

/// Samples nearer to each other are of no sensor on a body, ns …
const SHORTEST_NS: i64 = 100_000;
/// … nor are those that are farther apart.
const LONGEST_NS: i64 = 500_000_000;
/// Intervals that show what the times are.
const FEWEST_INTERVALS: usize = 3;
const ENOUGH_INTERVALS: usize = 32;
/// Forces that show their unit …
const FEWEST_FORCES: usize = 24;
/// … and after so many it is known.
const ENOUGH_FORCES: usize = 96;

/// In which units a device sends.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LiveUnits {
    /// Of its times, a whole number each: `s`, `ms`, `us`, `ns`, `ticks10_khz`, or `ticks` with `rate_hz`.
    pub time: Option<TimeUnit>,
    /// Ticks a second, for `ticks`.
    pub rate_hz: Option<f64>,
    /// What its clock shows at the session's start, in the unit of its times: for one that counts from 1970.
    pub clock_zero: i64,
    /// Of the angular rate.
    pub gyr: Option<RateUnit>,
    /// Of the specific force.
    pub acc: Option<ForceUnit>,
    /// Of the magnetic field.
    pub mag: Option<FieldUnit>,
    /// Of the pressure.
    pub pressure: Option<PressureUnit>,
}

impl LiveUnits {
    /// What a hello says of them, as the text that came.
    ///
    /// # Errors
    ///
    /// When it names a unit that is none of these, or ticks without a rate.
    pub fn of_hello(text: &str) -> Result<LiveUnits, ParseError> {
        #[derive(Deserialize)]
        struct Said {
            units: Option<serde_json::Value>,
        }
        let wrong = |found: String| {
            ParseError::new(
                ParseErrorKind::NotJson,
                "units as the device protocol lays them out, such as {\"time\":\"ms\",\"gyr\":\"deg_s\",\"acc\":\"g\"}",
                found,
                "name the units of time, gyr, acc, mag and pressure that differ from those of the protocol",
            )
        };
        let said = serde_json::from_str::<Said>(text).ok().and_then(|said| said.units);
        let Some(said) = said else { return Ok(LiveUnits::default()) };
        let units: LiveUnits = serde_json::from_value(said.clone())
            .map_err(|error| wrong(format!("{} ({error})", quoted(said.to_string().as_bytes()))))?;
        let countless = matches!(units.mag, Some(FieldUnit::Counts));
        let timeless = matches!(units.time, Some(TimeUnit::Samples | TimeUnit::DateTime | TimeUnit::Days));
        let rateless = units.time == Some(TimeUnit::Ticks)
            && !units.rate_hz.is_some_and(|rate_hz| (1.0..=1e10).contains(&rate_hz));
        if countless || timeless || rateless {
            return Err(wrong(quoted(said.to_string().as_bytes())));
        }
        Ok(units)
    }

    /// A batch in the units of the protocol.
    pub fn converted(&self, mut batch: Batch) -> Batch {
        if *self == LiveUnits::default() {
            return batch;
        }
        if let Readings::Imu(samples) = &mut batch.readings {
            samples.iter_mut().for_each(|sample| self.convert(sample));
        }
        batch
    }

    fn convert(&self, sample: &mut ImuSample) {
        let ticks = sample.t_ns.saturating_sub(self.clock_zero);
        sample.t_ns = match (self.time.unwrap_or(TimeUnit::Ns).ns(), self.rate_hz) {
            (Some(unit_ns), _) => ticks.saturating_mul(unit_ns),
            // A cast keeps within what an i64 holds.
            (None, Some(rate_hz)) => libm::round(ticks as f64 / rate_hz * 1e9) as i64,
            (None, None) => ticks,
        };
        let scaled = |value: [f64; 3], by: f64| value.map(|x| x * by);
        if let Some(unit) = self.gyr {
            sample.w_ib_b_rad_s = scaled(sample.w_ib_b_rad_s, unit.factor());
        }
        if let Some(unit) = self.acc {
            sample.f_b_m_s2 = scaled(sample.f_b_m_s2, unit.factor());
        }
        if let Some(unit) = self.mag {
            sample.mag_b_ut = sample.mag_b_ut.map(|field| scaled(field, unit.factor()));
        }
        if let Some(unit) = self.pressure {
            sample.pressure_hpa = sample.pressure_hpa.map(|pressure| pressure * unit.factor());
        }
    }
}

/// Looks at the first samples of each stream of a connection.
#[derive(Clone, Debug, Default)]
pub struct LiveCheck {
    streams: Vec<Start>,
}

/// What the first samples of a stream show.
#[derive(Clone, Debug)]
struct Start {
    stream: StreamKey,
    last_ns: Option<i64>,
    intervals_ns: Vec<i64>,
    forces: Vec<f64>,
}

impl LiveCheck {
    /// Looks at a batch, before it is stored.
    ///
    /// # Errors
    ///
    /// When its times or forces can only be in other units.
    pub fn check(&mut self, batch: &Batch) -> Result<(), ParseError> {
        let Readings::Imu(samples) = &batch.readings else { return Ok(()) };
        let at = match self.streams.iter().position(|start| start.stream == batch.stream) {
            Some(at) => at,
            None => {
                let stream = batch.stream;
                self.streams.push(Start {
                    stream,
                    last_ns: None,
                    intervals_ns: Vec::new(),
                    forces: Vec::new(),
                });
                self.streams.len() - 1
            }
        };
        let start = &mut self.streams[at];
        if start.forces.len() >= ENOUGH_FORCES && start.intervals_ns.len() >= ENOUGH_INTERVALS {
            return Ok(());
        }
        // A batch that is refused has said nothing.
        let before = start.clone();
        let looked_at = start.take(samples);
        if looked_at.is_err() {
            *start = before;
        }
        looked_at
    }
}

impl Start {
    fn take(&mut self, samples: &[ImuSample]) -> Result<(), ParseError> {
        for sample in samples {
            if let Some(last_ns) = self.last_ns.replace(sample.t_ns)
                && self.intervals_ns.len() < ENOUGH_INTERVALS
                && sample.t_ns > last_ns
            {
                self.intervals_ns.push(sample.t_ns.saturating_sub(last_ns));
            }
            let [x, y, z] = sample.f_b_m_s2;
            let length = (x * x + y * y + z * z).sqrt();
            if self.forces.len() < ENOUGH_FORCES && length.is_finite() {
                self.forces.push(length);
            }
        }
        self.times().and_then(|()| self.force())
    }

    fn times(&self) -> Result<(), ParseError> {
        let wrong = |found: String, advice: &str| {
            Err(ParseError::new(
                ParseErrorKind::BadTime,
                "times in nanoseconds since the session's start",
                found,
                advice,
            ))
        };
        if let Some(last_ns) = self.last_ns.filter(|last_ns| is_of_a_calendar(*last_ns)) {
            return wrong(
                format!("{last_ns}: this looks like a time since 1970, or of another clock"),
                "subtract what the clock shows at the start, or say that in the hello: \"units\":{\"clock_zero\":…}",
            );
        }
        if self.intervals_ns.len() < FEWEST_INTERVALS {
            return Ok(());
        }
        let mut sorted = self.intervals_ns.clone();
        sorted.sort_unstable();
        let usual_ns = sorted[sorted.len() / 2];
        let (looks_like, unit) = match usual_ns {
            SHORTEST_NS..=LONGEST_NS => return Ok(()),
            1 => ("numbers of samples, or seconds", "\"time\":\"ticks\",\"rate_hz\":100"),
            2..=50 => ("milliseconds", "\"time\":\"ms\""),
            51..=499 => ("tenths of a millisecond", "\"time\":\"ticks10_khz\""),
            500..SHORTEST_NS => ("microseconds", "\"time\":\"us\""),
            _ => ("no nanoseconds", "\"time\":\"ticks\",\"rate_hz\":…"),
        };
        wrong(
            format!("a sample every {usual_ns}: these look like {looks_like}"),
            &format!("send nanoseconds, or say the unit in the hello: \"units\":{{{unit}}}"),
        )
    }

    fn force(&self) -> Result<(), ParseError> {
        if self.forces.len() < FEWEST_FORCES {
            return Ok(());
        }
        let mut sorted = self.forces.clone();
        sorted.sort_by(f64::total_cmp);
        let middle = sorted[sorted.len() / 2];
        // At rest all are alike.
        let alike = sorted.iter().filter(|length| (**length / middle - 1.0).abs() < 0.1).count();
        let Some(looks) = Looks::of_gravity(middle).filter(|_| alike * 10 >= sorted.len() * 9) else {
            return Ok(());
        };
        let (looks_like, way) = match looks {
            Looks::Metres => return Ok(()),
            Looks::G => ("multiples of g".to_owned(), "or say so in the hello: \"units\":{\"acc\":\"g\"}"),
            Looks::Mg => {
                ("thousandths of g".to_owned(), "or say so in the hello: \"units\":{\"acc\":\"mg\"}")
            }
            Looks::Counts(counts) => (
                format!("counts of the sensor, {counts} for g"),
                "by the ranges of accelerometer and gyroscope",
            ),
        };
        Err(ParseError::new(
            ParseErrorKind::OtherUnit,
            "specific force in m/s², about 9.8 long at rest",
            format!(
                "a length of about {middle:.2} in {} samples at rest: these look like {looks_like}",
                sorted.len()
            ),
            format!("send m/s², {way}"),
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::StreamId;

    fn batch(from: i64, count: i64, step: i64, force: f64) -> Batch {
        let sample = |k: i64| ImuSample {
            t_ns: k * step,
            w_ib_b_rad_s: [0.0, 0.0, 90.0],
            f_b_m_s2: [0.0, 0.0, force + 0.001 * force * (k % 3) as f64],
            mag_b_ut: Some([0.3, 0.0, 0.4]),
            pressure_hpa: Some(89_000.0),
        };
        Batch::imu(StreamId::named("left"), 0, (from..from + count).map(sample).collect())
    }

    /// What is said of a stream of these, in frames of so many samples each.
    fn said(step: i64, force: f64, frame: i64) -> Option<String> {
        let mut check = LiveCheck::default();
        let batches = (0..200 / frame).map(|k| batch(k * frame, frame, step, force));
        batches.map(|batch| check.check(&batch)).find_map(Result::err).map(|error| error.to_string())
    }

    #[test]
    fn times_and_forces_in_other_units_are_told_with_one_way_to_say_it() {
        for frame in [1, 10, 100] {
            assert_eq!(said(10_000_000, 9.8, frame), None);
            assert_eq!(said(1_000_000, 9.8, frame), None, "a kilohertz");
            for (step, force, words, way) in [
                (10, 9.8, "milliseconds", "\"time\":\"ms\""),
                (10_000, 9.8, "microseconds", "\"time\":\"us\""),
                (100, 9.8, "tenths of a millisecond", "ticks10_khz"),
                (1, 9.8, "numbers of samples", "ticks"),
                (10_000_000, 1.0, "multiples of g", "\"acc\":\"g\""),
                (10_000_000, 1000.0, "thousandths of g", "\"acc\":\"mg\""),
                (10_000_000, 4096.0, "4096 for g", "ranges"),
            ] {
                let sentence = said(step, force, frame).unwrap_or_else(|| panic!("{step} {force} {frame}"));
                assert!(sentence.contains(words) && sentence.contains(way), "{sentence}");
            }
        }
        let mut check = LiveCheck::default();
        let unix = check.check(&batch(176_406_300_000, 10, 10_000_000, 9.8)).unwrap_err();
        assert!(unix.to_string().contains("since 1970") && unix.advice.contains("clock_zero"), "{unix}");
    }

    #[test]
    fn what_a_hello_says_is_done() {
        let hello = r#"{"type":"hello","inspector_id":"x","units":{"time":"ms","clock_zero":1000,"gyr":"deg_s","acc":"g","mag":"gauss","pressure":"pa"}}"#;
        let units = LiveUnits::of_hello(hello).unwrap();
        let converted = units.converted(batch(100, 100, 10, 1.0));
        let Readings::Imu(samples) = &converted.readings else { panic!("samples") };
        assert_eq!((samples[0].t_ns, samples[1].t_ns), (0, 10_000_000));
        assert!((samples[0].w_ib_b_rad_s[2] - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        assert!((samples[0].f_b_m_s2[2] - 9.8).abs() < 0.03);
        assert!((samples[0].mag_b_ut.unwrap()[2] - 40.0).abs() < 1e-9);
        assert!((samples[0].pressure_hpa.unwrap() - 890.0).abs() < 1e-9);
        LiveCheck::default().check(&converted).unwrap();
        assert_eq!(LiveUnits::of_hello("{\"type\":\"hello\"}").unwrap(), LiveUnits::default());
        for wrong in
            [r#"{"units":{"time":"years"}}"#, r#"{"units":{"time":"ticks"}}"#, r#"{"units":{"colour":1}}"#]
        {
            assert!(LiveUnits::of_hello(wrong).unwrap_err().expected.contains("units"), "{wrong}");
        }
        let ticks = LiveUnits::of_hello(r#"{"units":{"time":"ticks","rate_hz":32768}}"#).unwrap();
        let Readings::Imu(samples) = &ticks.converted(batch(0, 2, 32_768, 9.8)).readings else {
            panic!("samples")
        };
        assert_eq!(samples[1].t_ns, 1_000_000_000);
    }
}
