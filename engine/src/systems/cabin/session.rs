//! A session of the cabin: rows of all devices in order of their tags go in, poses come out.
//!
//! At every twentieth of a second the rows that were written since are weighed. A pose rests on rows written before its time
//! and on nothing else.

use serde::{Deserialize, Serialize};

use super::aids::Aids;
use super::body::{Body, Weighed};
use super::handover::Handover;
use super::instrument::Instrument;
use super::now::Now;
use super::output::Row;
use super::rig::Rig;
use super::rows::{AidRow, ImuRow};
use super::tuning::Tuning;
use super::watch::{CabinAnomaly, Watch};
use crate::system::AidState;

/// Which filter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Estimator {
    /// The joint filter.
    #[default]
    Own,
    /// Paper 3, fifteen states: antennas of stated sigmas for the cabin, stations for the platform.
    Paper,
}

/// What a session is to do.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct CabinConfig {
    /// Which filter.
    pub estimator: Estimator,
    /// Whether poses are smoothed; they then come late.
    pub smoothed: bool,
    /// Poses a second.
    pub rate_hz: f64,
    /// Whether stations are read.
    pub has_stations: bool,
    /// Whether encoders are read.
    pub has_encoders: bool,
    /// Whether the platform's inertial sensor is read.
    pub has_platform_imu: bool,
    /// Whether the platform's poses are asked for.
    pub platform: bool,
}

/// Poses that have become known.
#[derive(Clone, Debug, Default)]
pub struct Poses {
    /// Of the cabin.
    pub cabin: Vec<Row>,
    /// Of the platform.
    pub platform: Vec<Row>,
}

/// Why a session cannot go on; a sentence.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct CabinError(pub(super) String);

/// Between two epochs, ns.
pub(super) const EPOCH_NS: i64 = 50_000_000;

/// One session.
#[derive(Debug, Serialize, Deserialize)]
pub struct CabinSession {
    config: CabinConfig,
    aids: Aids,
    cabin: Body,
    /// The platform by itself, where no encoders join it to the cabin.
    platform: Option<Body>,
    /// Whether encoders join it to the cabin.
    joined: bool,
    handover: Handover,
    rows: Vec<AidRow>,
    watch: Watch,
    next_epoch_ns: Option<i64>,
    output: Ticks,
    latest_ns: i64,
    epochs: u64,
}

/// The times at which poses are wanted: every k/rate.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Ticks {
    rate_hz: f64,
    k: i64,
}

impl Ticks {
    fn next_ns(&self) -> i64 {
        (self.k as f64 * 1e9 / self.rate_hz).round() as i64
    }
}

impl CabinSession {
    /// A session at its beginning.
    ///
    /// # Errors
    ///
    /// When what is asked for needs a device that is not there.
    pub fn new(instrument: &Instrument, config: CabinConfig) -> Result<CabinSession, CabinError> {
        if config.platform && !config.has_encoders && !config.has_stations {
            return Err(CabinError(
                "the platform's pose needs the encoders, or stations that look at its prisms; found neither: add --encoders or --stations, or leave the platform out".to_owned(),
            ));
        }
        let paper = config.estimator == Estimator::Paper;
        let tuning = if paper { Tuning::PAPER } else { Tuning::OWN };
        let cabin =
            Body::new(Rig::of_cabin(instrument, config.has_encoders && !paper), tuning, &config, true);
        let joined = config.has_encoders && !paper;
        // Beside the encoders the platform by itself is the spare.
        let by_itself = config.platform && config.has_stations && (config.has_platform_imu || !joined);
        let platform = by_itself.then(|| {
            let rig = Rig::of_platform(instrument, config.has_platform_imu);
            Body::new(rig, tuning, &config, false)
        });
        Ok(CabinSession {
            aids: Aids::new(instrument, config.has_platform_imu),
            cabin,
            platform,
            joined,
            handover: Handover::new(config.smoothed),
            rows: Vec::new(),
            watch: Watch::default(),
            next_epoch_ns: None,
            output: Ticks { rate_hz: config.rate_hz, k: i64::MIN },
            latest_ns: i64::MIN,
            epochs: 0,
            config,
        })
    }

    /// The names of what may correct a pose.
    pub fn aids(&self) -> &Aids {
        &self.aids
    }

    /// Epochs so far.
    pub fn epochs(&self) -> u64 {
        self.epochs
    }

    /// Readings of the cabin's inertial sensor; all rows come in order of their tags.
    ///
    /// # Errors
    ///
    /// When the rows so far cannot be those of the instrument.
    pub fn push_imu(&mut self, row: &ImuRow, poses: &mut Poses) -> Result<(), CabinError> {
        self.reach(row.t_ns, poses)?;
        self.cabin.imu(row, &mut self.aids, &mut self.watch, "imu");
        Ok(())
    }

    /// Readings of the platform's inertial sensor.
    ///
    /// # Errors
    ///
    /// As for the cabin's.
    pub fn push_platform_imu(&mut self, row: &ImuRow, poses: &mut Poses) -> Result<(), CabinError> {
        self.reach(row.t_ns, poses)?;
        if let Some(platform) = &mut self.platform {
            platform.imu(row, &mut self.aids, &mut self.watch, "platform_imu");
        }
        Ok(())
    }

    /// A row of another device.
    ///
    /// # Errors
    ///
    /// As for the cabin's inertial sensor.
    pub fn push_aid(&mut self, row: &AidRow, poses: &mut Poses) -> Result<(), CabinError> {
        self.reach(row.t_ns(), poses)?;
        self.rows.push(*row);
        Ok(())
    }

    /// Where cabin and platform are at the newest reading; `None` before they are known. Of a smoothed session it is the filter's.
    pub fn now(&self) -> Option<Now> {
        let joins = self.config.platform && self.joined;
        let [cabin, joined] = self.cabin.now(&self.aids, joins);
        let alone = self.platform.as_ref().and_then(|platform| {
            let [platform, _] = platform.now(&self.aids, false);
            platform
        });
        Some(Now { cabin: cabin?, platform: self.handover.now(joined, alone) })
    }

    /// What corrects the poses at a time, ns, as bits, and how each aid is.
    pub(super) fn aid_states(&self, t_ns: i64) -> (u64, Vec<AidState>) {
        (self.aids.fresh(t_ns), self.aids.states(t_ns, &self.watch))
    }

    /// What became of the cabin's rows in the last epoch.
    pub(super) fn weighed(&mut self) -> Vec<Weighed> {
        self.cabin.weighed()
    }

    /// What has turned out to be wrong since the last time, told as soon as it is known.
    pub fn fresh_anomalies(&mut self) -> Vec<CabinAnomaly> {
        self.watch.fresh()
    }

    /// Lets go of anomalies that are over, which a session without an end would gather.
    pub(super) fn forget_what_is_over(&mut self) {
        self.watch.forget_what_is_over();
    }

    /// The end: the poses that remain, and what was wrong.
    ///
    /// # Errors
    ///
    /// When no pose was ever found.
    pub fn finish(mut self, poses: &mut Poses) -> Result<Vec<CabinAnomaly>, CabinError> {
        if self.latest_ns > i64::MIN {
            self.pass(self.latest_ns, poses)?;
        }
        let (mut joined, mut alone) = (Vec::new(), Vec::new());
        self.cabin.finish(&mut poses.cabin, &mut joined);
        if let Some(platform) = &mut self.platform {
            platform.finish(&mut alone, &mut Vec::new());
        }
        self.handover.take(joined, alone);
        self.handover.give(i64::MAX, &mut poses.platform);
        if !self.cabin.has_started() {
            return Err(CabinError(self.cabin.why_not_started()));
        }
        Ok(self.watch.finish())
    }

    /// Everything before `t_ns` has come.
    fn reach(&mut self, t_ns: i64, poses: &mut Poses) -> Result<(), CabinError> {
        if self.next_epoch_ns.is_none() {
            self.next_epoch_ns = Some(t_ns.div_euclid(EPOCH_NS) * EPOCH_NS);
            self.output.k = (t_ns as f64 * 1e-9 * self.output.rate_hz).floor() as i64;
        }
        // A clock that leaps by an hour does not make an hour of rows.
        if t_ns > self.latest_ns.saturating_add(600_000_000_000) && self.latest_ns > i64::MIN {
            return Err(CabinError(format!(
                "expected rows of one session, found {:.3} s after {:.3} s: a clock has leapt; cut the files there",
                t_ns as f64 * 1e-9,
                self.latest_ns as f64 * 1e-9
            )));
        }
        self.pass(t_ns - 1, poses)?;
        self.latest_ns = self.latest_ns.max(t_ns);
        Ok(())
    }

    /// Epochs and poses up to a time, both ends included.
    fn pass(&mut self, until_ns: i64, poses: &mut Poses) -> Result<(), CabinError> {
        loop {
            let Some(epoch_ns) = self.next_epoch_ns else { return Ok(()) };
            let output_ns = self.output.next_ns();
            if epoch_ns.min(output_ns) > until_ns {
                return Ok(());
            }
            if epoch_ns <= output_ns {
                self.turn_page(poses);
                self.epoch(epoch_ns)?;
                self.next_epoch_ns = Some(epoch_ns + EPOCH_NS);
            } else {
                self.emit(output_ns, poses);
                self.output.k += 1;
            }
        }
    }

    fn epoch(&mut self, t_ns: i64) -> Result<(), CabinError> {
        self.epochs += 1;
        let has_come = |row: &AidRow| row.t_ns() <= t_ns;
        let readings = self.rows.iter().filter(|row| has_come(row) && matches!(row, AidRow::Encoders(_)));
        let reading_ns = readings.map(AidRow::t_ns).max();
        let cabin = &self.cabin;
        let due = |row: &AidRow| has_come(row) && !cabin.waits_for_reading(row, t_ns, reading_ns);
        let mut rows: Vec<AidRow> = self.rows.iter().copied().filter(due).collect();
        self.rows.retain(|row| !due(row));
        rows.sort_by_key(AidRow::order);
        self.cabin.epoch(t_ns, &rows, &mut self.aids, &mut self.watch)?;
        if let Some(platform) = &mut self.platform {
            let rays: Vec<AidRow> = rows.into_iter().filter(|row| matches!(row, AidRow::Ray(_))).collect();
            platform.epoch(t_ns, &rays, &mut self.aids, &mut self.watch)?;
        }
        self.watch.pass(t_ns);
        Ok(())
    }

    fn emit(&mut self, t_ns: i64, poses: &mut Poses) {
        let (mut joined, mut alone) = (Vec::new(), Vec::new());
        let joins = self.config.platform && self.joined;
        self.cabin.emit(t_ns, &self.aids, joins, &mut poses.cabin, &mut joined);
        if let Some(platform) = &mut self.platform {
            platform.emit(t_ns, &self.aids, false, &mut alone, &mut Vec::new());
        }
        if let Some(platform) = &mut self.platform
            && (!self.joined || self.cabin.holds_platform())
        {
            platform.is_wanted_at(t_ns);
        }
        self.handover.take(joined, alone);
        if !self.config.smoothed {
            self.handover.give(t_ns, &mut poses.platform);
        }
    }

    /// What has been recorded since the last epoch is put aside; now and then it is smoothed.
    fn turn_page(&mut self, poses: &mut Poses) {
        if !self.config.smoothed {
            return;
        }
        let (mut joined, mut alone) = (Vec::new(), Vec::new());
        self.cabin.turn_page(&mut poses.cabin, &mut joined);
        if let Some(platform) = &mut self.platform {
            platform.turn_page(&mut alone, &mut Vec::new());
        }
        if joined.is_empty() && alone.is_empty() {
            return;
        }
        self.handover.take(joined, alone);
        let bodies = [Some(&self.cabin), self.platform.as_ref()];
        let known_ns = bodies.into_iter().flatten().map(Body::known_until_ns).min();
        self.handover.give(known_ns.unwrap_or(i64::MIN), &mut poses.platform);
    }
}
