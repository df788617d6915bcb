//! RTCM 3 as a receiver would send it: written for the tests from the standard's tables, with nothing of the decoder in it.

use std::collections::BTreeMap;

use lodestep_engine::gnss::ephemeris::Ephemeris;
use lodestep_engine::gnss::observations::{Epoch, Signal};
use lodestep_engine::gnss::satellite::{Constellation, Satellite};
use lodestep_engine::gnss::signal::{LIGHT_M_S, wavelength_m};
use lodestep_engine::gnss::time::GpsTime;

const MILLISECOND_M: f64 = LIGHT_M_S / 1000.0;
const SEMICIRCLE: f64 = std::f64::consts::PI;

/// A message on its way: bits, the first the highest.
#[derive(Default)]
struct Message(Vec<bool>);

impl Message {
    fn put(&mut self, value: i64, length: u32) -> &mut Message {
        self.0.extend((0..length).rev().map(|bit| value >> bit & 1 == 1));
        self
    }

    /// In steps of 2 to this power.
    fn scaled(&mut self, value: f64, length: u32, power: i32) -> &mut Message {
        self.put((value / 2_f64.powi(power)).round() as i64, length)
    }

    /// The whole frame.
    fn frame(&self) -> Vec<u8> {
        let body: Vec<u8> = self
            .0
            .chunks(8)
            .map(|bits| bits.iter().enumerate().map(|(k, bit)| u8::from(*bit) << (7 - k)).sum())
            .collect();
        RtcmWriter::framed(&body)
    }
}

/// What is left of the bytes, followed by 24 zeros, divided by the generator of CRC-24Q.
fn remainder(bytes: &[u8]) -> u32 {
    const GENERATOR: u32 = 0b1_1000_0110_0100_1100_1111_1011;
    let bits = bytes.iter().flat_map(|byte| (0..8).rev().map(move |bit| byte >> bit & 1));
    bits.chain([0; 24]).fold(0, |left, bit| {
        let shifted = left << 1 | u32::from(bit);
        if shifted >> 24 == 1 { shifted ^ GENERATOR } else { shifted }
    })
}

/// A signal: band, way of tracking, and its number.
type Named = (u8, u8, u32);

/// Bits of a signal in masks, by RINEX's names: (band, way of tracking, number).
const SIGNALS: [(Constellation, &[Named]); 4] = [
    (
        Constellation::Gps,
        &[
            (1, b'C', 2),
            (1, b'W', 4),
            (2, b'W', 10),
            (2, b'L', 16),
            (2, b'X', 17),
            (5, b'Q', 23),
            (5, b'X', 24),
        ],
    ),
    (Constellation::Beidou, &[(2, b'I', 2), (6, b'I', 8), (7, b'I', 14), (5, b'P', 23), (1, b'P', 31)]),
    (Constellation::Galileo, &[(1, b'C', 2), (1, b'X', 5), (7, b'Q', 15), (5, b'Q', 23), (5, b'X', 24)]),
    (Constellation::Qzss, &[(1, b'C', 2), (2, b'L', 16), (5, b'Q', 23)]),
];

/// A receiver that sends: it shifts phases by whole cycles so that they lie near the codes, and counts how long signals are held.
#[derive(Default)]
pub struct RtcmWriter {
    arcs: BTreeMap<(Satellite, u8, u8), (f64, GpsTime)>,
}

impl RtcmWriter {
    /// The frame of a message.
    pub fn framed(body: &[u8]) -> Vec<u8> {
        let mut frame = vec![0xD3, (body.len() >> 8) as u8, body.len() as u8];
        frame.extend(body);
        let remainder = remainder(&frame);
        frame.extend([(remainder >> 16) as u8, (remainder >> 8) as u8, remainder as u8]);
        frame
    }

    /// An epoch as MSM4, 5, 6 or 7, a message a system.
    pub fn epoch(&mut self, epoch: &Epoch, kind: i64) -> Vec<u8> {
        let here = |constellation: Constellation| {
            epoch.satellites.iter().any(|tracked| tracked.satellite.constellation == constellation)
        };
        let systems: Vec<Constellation> = Constellation::ALL.into_iter().filter(|one| here(*one)).collect();
        let mut frames = Vec::new();
        for (k, constellation) in systems.iter().enumerate() {
            frames.extend(self.msm(epoch, *constellation, kind, k + 1 < systems.len()));
        }
        frames
    }

    fn msm(&mut self, epoch: &Epoch, constellation: Constellation, kind: i64, more: bool) -> Vec<u8> {
        let known = SIGNALS.iter().find(|(of, _)| *of == constellation).expect("every system has signals").1;
        let number_of = |signal: &Signal| {
            known
                .iter()
                .find(|(band, way, _)| (*band, *way) == (signal.band, signal.attribute))
                .map(|one| one.2)
        };
        let mut satellites: BTreeMap<u8, BTreeMap<u32, Signal>> = BTreeMap::new();
        for tracked in epoch.satellites.iter().filter(|one| one.satellite.constellation == constellation) {
            let signals = epoch.signals_of(tracked).iter().filter(|signal| signal.code_m != 0.0);
            let numbered: BTreeMap<u32, Signal> =
                signals.filter_map(|signal| Some((number_of(signal)?, *signal))).collect();
            if !numbered.is_empty() {
                satellites.insert(tracked.satellite.number, numbered);
            }
        }
        let mut numbers: Vec<u32> = satellites.values().flat_map(|signals| signals.keys().copied()).collect();
        numbers.sort_unstable();
        numbers.dedup();
        let (first, behind_ms) = match constellation {
            Constellation::Gps => (1070, 0),
            Constellation::Galileo => (1090, 0),
            Constellation::Qzss => (1110, 0),
            Constellation::Beidou => (1120, 14_000),
        };
        let tow_ms = ((epoch.time.tow_s() * 1000.0).round() as i64 - behind_ms).rem_euclid(604_800_000);
        let mut message = Message::default();
        message.put(first + kind, 12).put(7, 12).put(tow_ms, 30).put(i64::from(more), 1).put(0, 18);
        for k in 1..=64 {
            message.put(i64::from(satellites.contains_key(&k)), 1);
        }
        for k in 1..=32 {
            message.put(i64::from(numbers.contains(&k)), 1);
        }
        for signals in satellites.values() {
            for k in &numbers {
                message.put(i64::from(signals.contains_key(k)), 1);
            }
        }
        let rough: Vec<i64> = satellites
            .values()
            .map(|signals| {
                (signals.values().next().expect("a satellite has signals").code_m / MILLISECOND_M * 1024.0)
                    .round() as i64
            })
            .collect();
        for range in &rough {
            message.put(range >> 10, 8);
        }
        if kind % 2 == 1 {
            for _ in &rough {
                message.put(0, 4);
            }
        }
        for range in &rough {
            message.put(range & 1023, 10);
        }
        if kind % 2 == 1 {
            for _ in &rough {
                message.put(-1, 14);
            }
        }
        let mut cells = Vec::new();
        for ((number, signals), rough) in satellites.iter().zip(&rough) {
            for signal in signals.values() {
                let satellite = Satellite { constellation, number: *number };
                cells.push(self.cell(satellite, signal, epoch.time, *rough as f64 / 1024.0));
            }
        }
        let (fine, rate) = (kind >= 6, kind % 2 == 1);
        let sizes: [(u32, i32); 2] = if fine { [(20, -29), (24, -31)] } else { [(15, -24), (22, -29)] };
        for cell in &cells {
            message.scaled(cell.code_ms, sizes[0].0, sizes[0].1);
        }
        for cell in &cells {
            match cell.phase_ms {
                Some(phase) => message.scaled(phase, sizes[1].0, sizes[1].1),
                None => message.put(-(1 << (sizes[1].0 - 1)), sizes[1].0),
            };
        }
        for cell in &cells {
            // The last indicator whose time is not longer than the signal has been held.
            let (length, most) = if fine { (10, 704) } else { (4, 15) };
            let least = |i: u64| match fine {
                true if i < 64 => i,
                true => {
                    let row = (i - 64) / 32 + 1;
                    // Rows of the table double their steps; each begins where the one before ends.
                    (1..row).fold(64, |from, row| from + 32 * (1 << row)) + ((i - 64) % 32) * (1 << row)
                }
                false if i == 0 => 0,
                false => 32 << (i - 1),
            };
            let indicator = (0..=most)
                .take_while(|i| least(*i) <= cell.held_ms)
                .last()
                .expect("the first indicator is of no time");
            message.put(indicator as i64, length);
        }
        for cell in &cells {
            message.put(i64::from(cell.half_cycle), 1);
        }
        for cell in &cells {
            match fine {
                true => message.put((cell.strength * 16.0).round() as i64, 10),
                false => message.put(cell.strength.round() as i64, 6),
            };
        }
        if rate {
            for _ in &cells {
                message.put(5, 15);
            }
        }
        message.frame()
    }

    fn cell(&mut self, satellite: Satellite, signal: &Signal, time: GpsTime, rough_ms: f64) -> Cell {
        let wavelength_m = wavelength_m(satellite.constellation, signal.band).expect("a band that is used");
        let key = (satellite, signal.band, signal.attribute);
        let away = |shift: f64| (signal.phase_cycles - shift) * wavelength_m / MILLISECOND_M - rough_ms;
        if signal.lost_lock || self.arcs.get(&key).is_some_and(|(shift, _)| away(*shift).abs() > 0.0035) {
            self.arcs.remove(&key);
        }
        let near = || ((signal.phase_cycles * wavelength_m - signal.code_m) / wavelength_m).round();
        let (shift, since) = *self.arcs.entry(key).or_insert_with(|| (near(), time));
        Cell {
            code_ms: signal.code_m / MILLISECOND_M - rough_ms,
            phase_ms: (signal.phase_cycles != 0.0).then(|| away(shift)),
            held_ms: ((time.ns - since.ns) / 1_000_000) as u64,
            half_cycle: signal.half_cycle,
            strength: f64::from(signal.strength_db_hz),
        }
    }

    /// 1006 of an antenna.
    pub fn station([x, y, z]: [f64; 3], height_m: f64) -> Vec<u8> {
        let tenth_mm = |metres: f64| (metres * 10_000.0).round() as i64;
        let mut message = Message::default();
        message.put(1006, 12).put(7, 12).put(0, 6).put(0b1110, 4);
        message.put(tenth_mm(x), 38).put(0, 2).put(tenth_mm(y), 38).put(0, 2).put(tenth_mm(z), 38);
        message.put(tenth_mm(height_m), 16).frame()
    }

    /// 1019, 1042 or 1046.
    pub fn ephemeris(one: &Ephemeris) -> Vec<u8> {
        let mut message = Message::default();
        let number = i64::from(one.satellite.number);
        let angle = |value: f64| value / SEMICIRCLE;
        let week = i64::from(one.toe.week());
        let [a0, a1, a2] = one.clock;
        let (harmonic, rad, metre, toe_bits, toe) = match one.satellite.constellation {
            Constellation::Gps => {
                message.put(1019, 12).put(number, 6).put(week % 1024, 10).put(0, 6);
                message.scaled(angle(one.i_dot), 14, -43).put(0, 8);
                message.put((one.toc.tow_s() / 16.0) as i64, 16);
                message.scaled(a2, 8, -55).scaled(a1, 16, -43).scaled(a0, 22, -31).put(0, 10);
                (16, -29, -5, 16, one.toe.tow_s() / 16.0)
            }
            Constellation::Beidou => {
                let (toe, toc) = (one.toe - 14.0, one.toc - 14.0);
                message.put(1042, 12).put(number, 6).put(i64::from(toe.week()) - 1356, 13).put(0, 4);
                message.scaled(angle(one.i_dot), 14, -43).put(0, 5);
                message.put((toc.tow_s() / 8.0) as i64, 17);
                message.scaled(a2, 11, -66).scaled(a1, 22, -50).scaled(a0, 24, -33).put(0, 5);
                (18, -31, -6, 17, toe.tow_s() / 8.0)
            }
            _ => {
                message.put(1046, 12).put(number, 6).put(week - 1024, 12).put(0, 18);
                message.scaled(angle(one.i_dot), 14, -43);
                message.put((one.toc.tow_s() / 60.0) as i64, 14);
                message.scaled(a2, 6, -59).scaled(a1, 21, -46).scaled(a0, 31, -34);
                (16, -29, -5, 14, one.toe.tow_s() / 60.0)
            }
        };
        message.scaled(one.cr[1], harmonic, metre).scaled(angle(one.delta_n), 16, -43);
        message.scaled(angle(one.m0), 32, -31).scaled(one.cu[0], harmonic, rad);
        message.scaled(one.eccentricity, 32, -33).scaled(one.cu[1], harmonic, rad);
        message.scaled(one.sqrt_a, 32, -19).put(toe as i64, toe_bits);
        message.scaled(one.ci[0], harmonic, rad).scaled(angle(one.omega0), 32, -31);
        message.scaled(one.ci[1], harmonic, rad).scaled(angle(one.i0), 32, -31);
        message.scaled(one.cr[0], harmonic, metre).scaled(angle(one.omega), 32, -31);
        message.scaled(angle(one.omega_dot), 24, -43);
        let ill = i64::from(!one.healthy);
        match one.satellite.constellation {
            Constellation::Gps => message.put(0, 8).put(ill, 6).put(0, 2),
            Constellation::Beidou => message.put(0, 20).put(ill, 1),
            _ => message.put(0, 20).put(ill, 2).put(0, 6),
        };
        message.frame()
    }
}

struct Cell {
    code_ms: f64,
    phase_ms: Option<f64>,
    held_ms: u64,
    half_cycle: bool,
    strength: f64,
}
