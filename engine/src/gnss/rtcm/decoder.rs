//! Bytes in, epochs, orbits and stations out.

use std::collections::BTreeMap;

use super::bits::Bits;
use super::frames::{self, Next};
use super::msm::{self, Msm};
use super::orbits;
use super::station::{self, Station};
use crate::gnss::ephemeris::Ephemeris;
use crate::gnss::observations::{Epoch, Signal, Tracked};
use crate::gnss::satellite::{Constellation, Satellite};
use crate::gnss::time::{GPS_MINUS_BEIDOU_S, GpsTime, WEEK_S};

/// Something that was read.
#[derive(Clone, Debug, PartialEq)]
pub enum Message {
    /// All that was observed at one time.
    Epoch(Epoch),
    /// A satellite's orbit and clock.
    Ephemeris(Box<Ephemeris>),
    /// Where the sender is.
    Station(Station),
}

/// What came so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Frames with the right checksum.
    pub frames: u64,
    /// Frames that were read.
    pub read: u64,
    /// Frames of numbers that are not read here.
    pub other: u64,
    /// Frames that are shorter than their message, or say what cannot be.
    pub malformed: u64,
    /// Places at which a frame began and its checksum was wrong.
    pub corrupt: u64,
    /// Bytes that belong to no frame.
    pub garbage_bytes: u64,
}

/// How a signal was held when it was seen last.
#[derive(Clone, Copy, Debug)]
struct Held {
    time: GpsTime,
    least_ms: u64,
}

/// A decoder of one sender's bytes.
#[derive(Clone, Debug, Default)]
pub struct Decoder {
    bytes: Vec<u8>,
    under_way: Option<Epoch>,
    held: BTreeMap<(Satellite, u8, u8), Held>,
    counts: Counts,
}

impl Decoder {
    /// Takes some bytes. `now` says which week it is: it may be off by half of one. Gives what became complete, in order.
    pub fn push(&mut self, bytes: &[u8], now: GpsTime) -> Vec<Message> {
        self.bytes.extend_from_slice(bytes);
        let mut told = Vec::new();
        let mut at = 0;
        loop {
            match frames::next(&self.bytes[at..]) {
                Next::Wait => break,
                Next::Garbage(length, began) => {
                    self.counts.corrupt += u64::from(began);
                    self.counts.garbage_bytes += length as u64;
                    at += length;
                }
                Next::Message(part, length) => {
                    self.counts.frames += 1;
                    let message = self.bytes[at + part.start..at + part.end].to_vec();
                    self.read(&message, now, &mut told);
                    at += length;
                }
            }
        }
        self.bytes.drain(..at);
        told
    }

    /// What came so far.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    fn read(&mut self, message: &[u8], now: GpsTime, told: &mut Vec<Message>) {
        let mut bits = Bits::new(message);
        let Some(number) = bits.unsigned(12) else {
            self.counts.malformed += 1;
            return;
        };
        let read = match number {
            1005 | 1006 => station::read(&mut bits, number == 1006).map(Message::Station),
            1019 => orbits::gps(&mut bits, now).map(|one| Message::Ephemeris(Box::new(one))),
            1042 => orbits::beidou(&mut bits, now).map(|one| Message::Ephemeris(Box::new(one))),
            1046 => orbits::galileo(&mut bits, now).map(|one| Message::Ephemeris(Box::new(one))),
            _ => {
                let Some((constellation, kind)) = msm::kind(number) else {
                    self.counts.other += 1;
                    // An epoch may end with the message of a system that is not read here.
                    if msm::is_other(number) && ends(&mut bits) == Some(true) {
                        told.extend(self.under_way.take().map(Message::Epoch));
                    }
                    return;
                };
                match msm::read(&mut bits, constellation, kind) {
                    Some(msm) => {
                        self.counts.read += 1;
                        self.observe(&msm, now, told);
                    }
                    None => self.counts.malformed += 1,
                }
                return;
            }
        };
        match read {
            Some(message) => {
                self.counts.read += 1;
                told.push(message);
            }
            None => self.counts.malformed += 1,
        }
    }

    fn observe(&mut self, msm: &Msm, now: GpsTime, told: &mut Vec<Message>) {
        let time = time_of(msm, now);
        let earlier = self.under_way.take_if(|epoch| epoch.time != time);
        told.extend(earlier.map(Message::Epoch));
        let mut epoch = self.under_way.take().unwrap_or_else(|| Epoch { time, ..Epoch::default() });
        for cell in &msm.cells {
            // A satellite is told once; a message that was sent twice says nothing new.
            let (satellite, end) = (cell.satellite, epoch.signals.len() as u32);
            let is_last = epoch.satellites.last().is_some_and(|last| last.satellite == satellite);
            let is_known = epoch.satellites.iter().any(|other| other.satellite == satellite);
            match epoch.satellites.last_mut() {
                Some(last) if is_last => last.end = end + 1,
                _ if is_known => continue,
                _ => epoch.satellites.push(Tracked { satellite, first: end, end: end + 1 }),
            }
            let [least_ms, most_ms] = cell.held_ms;
            let key = (satellite, cell.band, cell.attribute);
            let before = self.held.insert(key, Held { time, least_ms });
            // Held for less than the time since it was seen last, or for less than then: lost in between.
            let lost_lock = before.is_some_and(|before| {
                let since_ms = (time.ns - before.time.ns).unsigned_abs() / 1_000_000;
                least_ms < before.least_ms || most_ms <= since_ms
            });
            epoch.signals.push(Signal {
                band: cell.band,
                attribute: cell.attribute,
                code_m: cell.code_m,
                phase_cycles: cell.phase_cycles,
                strength_db_hz: cell.strength_db_hz,
                lost_lock,
                half_cycle: cell.half_cycle,
            });
        }
        match msm.more {
            true => self.under_way = Some(epoch),
            false => told.push(Message::Epoch(epoch)),
        }
    }
}

/// Whether an MSM of whatever system is the last of its time; behind its number.
fn ends(bits: &mut Bits<'_>) -> Option<bool> {
    bits.skip(12 + 30)?;
    Some(!bits.flag()?)
}

/// The time of a message in the week that brings it nearest to now.
fn time_of(msm: &Msm, now: GpsTime) -> GpsTime {
    let ahead_s = match msm.constellation {
        Constellation::Beidou => GPS_MINUS_BEIDOU_S,
        _ => 0,
    };
    let in_week = GpsTime::from_week(now.week(), 0.0).ns + (msm.tow_ms as i64 + 1000 * ahead_s) * 1_000_000;
    let week_ns = (WEEK_S * 1e9) as i64;
    let off = in_week - now.ns;
    let weeks = (off + week_ns / 2).div_euclid(week_ns);
    GpsTime { ns: in_week - weeks * week_ns }
}
