//! What a WitMotion sensor (CMP10A, WT901B, HWT901B, …) sends on its serial line, dumped as it came.
//!
//! Packets of 11 bytes: 0x55, a type, eight bytes of data, and the sum of the ten before. Little-endian.
//! The layout is that of WitMotion's data sheets (WT901, WT901SDCL, HWT905) and standard protocol:
//!
//! | type | what | value |
//! |---|---|---|
//! | 0x50 | time | year − 2000, month, day, hour, minute, second, milliseconds (u16) |
//! | 0x51 | specific force x y z | i16 / 32768 · 16 g |
//! | 0x52 | angular rate x y z | i16 / 32768 · 2000 deg/s |
//! | 0x53 | roll pitch yaw | not used |
//! | 0x54 | magnetic field x y z | i16, counts that differ from model to model |
//! | 0x56 | pressure, height | i32 in Pa, i32 in cm (not used) |
//!
//! The newer sensors (WT901BLE, WT9011DCL, …) send 20 bytes without a sum, by radio and by cable: 0x55, 0x61, then force, rate and angles,
//! nine i16 of the same scales; and 0x55, 0x71, a register's number and eight i16, when they are asked: from register 0x3A on
//! the field. Such a packet is believed where another begins behind it. They bear no time.
//!
//! A sensor sends the packets that are switched on in the order of their types, cycle by cycle. A cycle
//! without force or rate, and a packet whose sum is wrong, are left out: the gap shows in the times.

use crate::parse::clock_text::DAY_NS;
use crate::parse::error::{ParseError, ParseErrorKind};
use crate::sample::ImuSample;

const LENGTH: usize = 11;
/// Of a packet of the newer protocol.
const COMBINED: usize = 20;
/// The register from which on the field is read.
const FIELD_REGISTER: u16 = 0x3A;
const STANDARD_GRAVITY_M_S2: f64 = 9.806_65;
/// Packets in a row that are no coincidence.
const ENOUGH_TO_RECOGNISE: usize = 4;
/// So many cycles without a time, and none with one: the sensor sends none.
const MOST_TIMELESS: u64 = 100;
/// A dump may begin in the middle of something.
const BEGINS_WITHIN: usize = 512;

/// Whether these first bytes of a file are such a dump.
pub(super) fn recognise(head: &[u8]) -> bool {
    let packets_from = |start: usize| {
        let packets = head[start..].chunks_exact(LENGTH);
        packets.take(ENOUGH_TO_RECOGNISE).take_while(|packet| is_packet(packet)).count()
            == ENOUGH_TO_RECOGNISE
    };
    let combined_from = |start: usize| {
        let packets = head[start..].chunks_exact(COMBINED).take(ENOUGH_TO_RECOGNISE);
        packets.filter(|packet| is_combined(packet)).count() == ENOUGH_TO_RECOGNISE
    };
    (0..head.len().min(BEGINS_WITHIN)).any(|start| packets_from(start) || combined_from(start))
}

fn is_combined(bytes: &[u8]) -> bool {
    bytes[0] == 0x55 && matches!(bytes[1], 0x61 | 0x71)
}

fn is_packet(bytes: &[u8]) -> bool {
    bytes[0] == 0x55
        && (0x50..=0x5F).contains(&bytes[1])
        && bytes[..10].iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte)) == bytes[10]
}

/// A push parser: takes bytes in pieces of any size and gives the samples that they complete.
pub(super) struct WitSerial {
    rate_hz: Option<f64>,
    field_ut_per_count: Option<f64>,
    waiting: Vec<u8>,
    cycle: Cycle,
    samples: u64,
    broken_bytes: u64,
    bytes: u64,
    has_time: bool,
    timeless: u64,
    /// Packets of the newer protocol have come.
    combined: bool,
}

/// What has come of the cycle that is under way.
#[derive(Clone, Copy, Default)]
struct Cycle {
    last_type: u8,
    t_ns: Option<i64>,
    force: Option<[f64; 3]>,
    rate: Option<[f64; 3]>,
    field: Option<[f64; 3]>,
    pressure_hpa: Option<f64>,
}

impl WitSerial {
    /// A parser at the start of a dump; `rate_hz` is how often the sensor was set to send, for dumps
    /// without time packets.
    pub(super) fn new(rate_hz: Option<f64>, field_ut_per_count: Option<f64>) -> WitSerial {
        WitSerial {
            rate_hz,
            field_ut_per_count,
            waiting: Vec::new(),
            cycle: Cycle::default(),
            samples: 0,
            broken_bytes: 0,
            bytes: 0,
            has_time: false,
            timeless: 0,
            combined: false,
        }
    }

    pub(super) fn push(&mut self, bytes: &[u8], samples: &mut Vec<ImuSample>) -> Result<(), ParseError> {
        self.bytes += bytes.len() as u64;
        let mut all = std::mem::take(&mut self.waiting);
        all.extend_from_slice(bytes);
        let mut at = 0;
        while all.len() - at >= LENGTH {
            let packet = &all[at..at + LENGTH];
            if is_packet(packet) {
                self.take(packet, samples)?;
                at += LENGTH;
            } else if is_combined(packet) {
                // Whether another begins behind it has to be seen.
                let Some(next) = all.get(at + COMBINED..at + COMBINED + 2) else { break };
                if is_combined(next) {
                    self.take_combined(&all[at..at + COMBINED], samples)?;
                    at += COMBINED;
                } else {
                    self.broken_bytes += 1;
                    at += 1;
                }
            } else {
                self.broken_bytes += 1;
                at += 1;
            }
        }
        all.drain(..at);
        self.waiting = all;
        Ok(())
    }

    pub(super) fn finish(&mut self, samples: &mut Vec<ImuSample>) -> Result<(), ParseError> {
        self.end_cycle(samples)?;
        let last = std::mem::take(&mut self.waiting);
        if self.combined && last.len() == COMBINED && is_combined(&last) {
            self.take_combined(&last, samples)?;
        }
        if self.samples == 0 && self.timeless > 0 {
            return Err(without_time());
        }
        if self.samples == 0 {
            return Err(ParseError::new(
                ParseErrorKind::EmptyFile,
                "packets of specific force (0x51) and angular rate (0x52) in every cycle",
                "no cycle with both",
                "switch acceleration and angular velocity on in the sensor's output",
            ));
        }
        if self.broken_bytes * 2 > self.bytes {
            return Err(ParseError::new(
                ParseErrorKind::NotText,
                "packets of 11 bytes, one after the other",
                format!("{} of {} bytes that belong to no whole packet", self.broken_bytes, self.bytes),
                "record the line in binary, at the baud rate of the sensor",
            ));
        }
        Ok(())
    }

    fn take(&mut self, packet: &[u8], samples: &mut Vec<ImuSample>) -> Result<(), ParseError> {
        let kind = packet[1];
        if kind <= self.cycle.last_type {
            self.end_cycle(samples)?;
        }
        self.cycle.last_type = kind;
        let word = |i: usize| i16::from_le_bytes([packet[2 + 2 * i], packet[3 + 2 * i]]);
        let three = |full_scale: f64| [0, 1, 2].map(|i| f64::from(word(i)) / 32_768.0 * full_scale);
        match kind {
            0x50 => {
                self.cycle.t_ns = clock_ns(packet);
                self.has_time |= self.cycle.t_ns.is_some();
            }
            0x51 => self.cycle.force = Some(three(16.0 * STANDARD_GRAVITY_M_S2)),
            0x52 => self.cycle.rate = Some(three(2000.0_f64.to_radians())),
            0x54 => {
                let counts = [0, 1, 2].map(|i| f64::from(word(i)));
                self.cycle.field = self.field_ut_per_count.map(|ut| counts.map(|count| count * ut));
            }
            0x56 => {
                let pascal = i32::from_le_bytes([packet[2], packet[3], packet[4], packet[5]]);
                self.cycle.pressure_hpa = Some(f64::from(pascal) / 100.0);
            }
            _ => {}
        }
        Ok(())
    }

    fn take_combined(&mut self, packet: &[u8], samples: &mut Vec<ImuSample>) -> Result<(), ParseError> {
        self.combined = true;
        let word = |i: usize| i16::from_le_bytes([packet[2 + 2 * i], packet[3 + 2 * i]]);
        let three = |from: usize, full_scale: f64| {
            [0, 1, 2].map(|i| f64::from(word(from + i)) / 32_768.0 * full_scale)
        };
        if packet[1] == 0x61 {
            self.cycle.force = Some(three(0, 16.0 * STANDARD_GRAVITY_M_S2));
            self.cycle.rate = Some(three(3, 2000.0_f64.to_radians()));
            return self.end_cycle(samples);
        }
        if u16::from_le_bytes([packet[2], packet[3]]) == FIELD_REGISTER {
            let counts = [1, 2, 3].map(|i| f64::from(word(i)));
            self.cycle.field = self.field_ut_per_count.map(|ut| counts.map(|count| count * ut));
        }
        Ok(())
    }

    fn end_cycle(&mut self, samples: &mut Vec<ImuSample>) -> Result<(), ParseError> {
        let cycle = std::mem::take(&mut self.cycle);
        let (Some(f_b_m_s2), Some(w_ib_b_rad_s)) = (cycle.force, cycle.rate) else { return Ok(()) };
        let t_ns = match (self.rate_hz, cycle.t_ns) {
            (Some(rate_hz), _) => (self.samples as f64 / rate_hz * 1e9).round() as i64,
            (None, Some(t_ns)) => t_ns,
            // A time packet was broken or lies before the dump: the sample cannot be placed.
            (None, None) => {
                self.timeless += 1;
                let never = !self.has_time && self.timeless > MOST_TIMELESS;
                return if never { Err(without_time()) } else { Ok(()) };
            }
        };
        self.samples += 1;
        samples.push(ImuSample {
            t_ns,
            w_ib_b_rad_s,
            f_b_m_s2,
            mag_b_ut: cycle.field,
            pressure_hpa: cycle.pressure_hpa,
        });
        Ok(())
    }
}

fn without_time() -> ParseError {
    ParseError::new(
        ParseErrorKind::MappingNeeded,
        "a time packet (0x50) in every cycle, or the rate at which the sensor sent",
        "cycles without a time",
        "give the rate that the sensor was set to, in Hz, or switch the time on in its output",
    )
}

/// Nanoseconds since 2000 of the sensor's clock; `None` for a date that is none.
fn clock_ns(packet: &[u8]) -> Option<i64> {
    let month = time::Month::try_from(packet[3]).ok()?;
    let date = time::Date::from_calendar_date(2000 + i32::from(packet[2]), month, packet[4]).ok()?;
    let days = i64::from(date.to_julian_day()) - 2_440_588;
    let (hour, minute, second) = (i64::from(packet[5]), i64::from(packet[6]), i64::from(packet[7]));
    let milliseconds = i64::from(u16::from_le_bytes([packet[8], packet[9]]));
    if hour > 23 || minute > 59 || second > 59 || milliseconds > 999 {
        return None;
    }
    Some(days * DAY_NS + (((hour * 60 + minute) * 60 + second) * 1000 + milliseconds) * 1_000_000)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::parse::log_format::LogFormat;
    use crate::parse::log_reader::{LogReader, ReadOptions, samples_of};

    pub(in crate::parse) fn packet(kind: u8, data: [u8; 8]) -> Vec<u8> {
        let mut bytes = vec![0x55, kind];
        bytes.extend(data);
        bytes.push(bytes.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte)));
        bytes
    }

    fn words(values: [i16; 4]) -> [u8; 8] {
        let mut data = [0; 8];
        for (at, value) in values.into_iter().enumerate() {
            data[2 * at..2 * at + 2].copy_from_slice(&value.to_le_bytes());
        }
        data
    }

    /// Cycles 10 ms apart, beginning at 9:30:59.990.
    pub(in crate::parse) fn dump(cycles: u16, with_time: bool) -> Vec<u8> {
        let mut bytes = Vec::new();
        for i in 0..cycles {
            let ms = 59_990 + 10 * u32::from(i);
            let [low, high] = ((ms % 1000) as u16).to_le_bytes();
            let (minute, second) = (30 + ms / 60_000, ms / 1000 % 60);
            if with_time {
                bytes.extend(packet(0x50, [26, 11, 25, 9, minute as u8, second as u8, low, high]));
            }
            bytes.extend(packet(0x51, words([0, 1024, 2048, 2500])));
            bytes.extend(packet(0x52, words([16_384, 0, -16_384, 2500])));
            bytes.extend(packet(0x53, words([1, 2, 3, 4])));
            bytes.extend(packet(0x54, words([200, -50, 400, 2500])));
            let mut pressure = [0; 8];
            pressure[..4].copy_from_slice(&90_150_i32.to_le_bytes());
            bytes.extend(packet(0x56, pressure));
        }
        bytes
    }

    #[test]
    fn a_dump_is_read_over_the_minute() {
        let (recognised, samples) = samples_of(&dump(3, true)).unwrap();
        assert_eq!(recognised.format, LogFormat::WitSerial);
        let times: Vec<i64> = samples.iter().map(|sample| sample.t_ns).collect();
        assert_eq!(times, [0, 10_000_000, 20_000_000]);
        let first = samples[0];
        assert!((first.f_b_m_s2[2] - 9.806_65).abs() < 1e-12, "{first:?}");
        assert!((first.f_b_m_s2[1] - 4.903_325).abs() < 1e-12);
        assert!((first.w_ib_b_rad_s[0] - 1000.0_f64.to_radians()).abs() < 1e-12);
        assert_eq!((first.mag_b_ut, first.pressure_hpa), (None, Some(901.5)));
    }

    #[test]
    fn the_field_is_told_when_it_is_said_how_much_a_count_is() {
        let mut reader =
            LogReader::new(ReadOptions { field_ut_per_count: Some(0.1), ..ReadOptions::default() });
        let mut samples = Vec::new();
        reader.push(&dump(2, true), &mut samples).unwrap();
        reader.finish(&mut samples).unwrap();
        assert_eq!(samples[0].mag_b_ut, Some([20.0, -5.0, 40.0]));
    }

    #[test]
    fn a_broken_packet_costs_its_own_cycle_at_most() {
        let mut bytes = dump(40, true);
        bytes.drain(..5);
        // A flipped bit in the rate of the fourth cycle, and noise between two others.
        bytes[3 * 66 + 22 + 4 - 5] ^= 0x10;
        let noise_at = 9 * 66 - 5;
        bytes.splice(noise_at..noise_at, [0x55, 0x51, 0x00]);
        let (_, samples) = samples_of(&bytes).unwrap();
        // The first lost its time, the fourth its rate.
        assert_eq!(samples.len(), 38);
        assert!(samples.windows(2).all(|pair| pair[0].t_ns < pair[1].t_ns));
        assert!(samples.iter().all(|sample| (sample.f_b_m_s2[2] - 9.806_65).abs() < 1e-12));
    }

    #[test]
    fn without_time_packets_the_rate_is_asked_for_and_used() {
        let error = samples_of(&dump(20, false)).unwrap_err();
        assert_eq!(error.code(), "mapping_needed");
        let mut reader = LogReader::new(ReadOptions { rate_hz: Some(200.0), ..ReadOptions::default() });
        let mut samples = Vec::new();
        reader.push(&dump(20, false), &mut samples).unwrap();
        reader.finish(&mut samples).unwrap();
        assert_eq!((samples.len(), samples[19].t_ns), (20, 95_000_000));
    }

    #[test]
    fn the_newer_packets_are_read_at_the_rate_that_is_given() {
        let mut bytes = vec![0x00, 0x61, 0x55];
        for k in 0..50_i16 {
            bytes.extend([0x55, 0x61]);
            for word in [0, 1024, 2048, 16_384, 0, -16_384, 1, 2, k] {
                bytes.extend(i16::to_le_bytes(word));
            }
            if k == 20 {
                bytes.extend([0x55, 0x71]);
                for word in [0x3A, 200, -50, 400, 0, 0, 0, 0, 0] {
                    bytes.extend(i16::to_le_bytes(word));
                }
            }
        }
        assert!(recognise(&bytes));
        assert_eq!(samples_of(&bytes).unwrap_err().code(), "mapping_needed");
        let reading =
            ReadOptions { rate_hz: Some(100.0), field_ut_per_count: Some(0.1), ..ReadOptions::default() };
        let mut reader = LogReader::new(reading);
        let mut samples = Vec::new();
        for piece in bytes.chunks(7) {
            reader.push(piece, &mut samples).unwrap();
        }
        reader.finish(&mut samples).unwrap();
        assert_eq!((samples.len(), samples[49].t_ns), (50, 490_000_000));
        assert!((samples[0].f_b_m_s2[2] - 9.806_65).abs() < 1e-12);
        assert!((samples[0].w_ib_b_rad_s[0] - 1000.0_f64.to_radians()).abs() < 1e-12);
        assert_eq!((samples[20].mag_b_ut, samples[21].mag_b_ut), (None, Some([20.0, -5.0, 40.0])));
    }

    #[test]
    fn text_and_noise_are_no_dumps() {
        assert!(!recognise(b"UQUQUQUQUQUQUQUQUQUQUQUQUQUQUQUQUQUQUQUQUQUQUQUQUQUQUQUQUQ"));
        assert!(!recognise(&[0x55; 400]));
        assert!(!recognise(&dump(1, true)[..33]));
    }
}
