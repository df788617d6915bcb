//! What came in of a session: epochs, orbits and ranges, made of the rows of its streams.

use super::streams::{BASE, RANGES, ROVER, is_navigation};
use crate::geo::{Geodetic, LocalFrame};
use crate::gnss::ephemeris::Navigation;
use crate::gnss::observations::{Epoch, Observations};
use crate::gnss::time::GpsTime;
use crate::parse::navigation_rows;
use crate::parse::observation_rows::{EpochReader, Station};
use crate::parse::range_rows::RangeReader;
use crate::sample::TagRanges;
use crate::stream::StreamId;

/// All that a run is worked out from, beside what is known of the instruments.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    /// The rover's observations; without an epoch there are ranges alone.
    pub rover: Observations,
    /// The base's.
    pub base: Observations,
    /// Orbits and clocks.
    pub navigation: Navigation,
    /// Ranges in order of time.
    pub ranges: TagRanges,
    /// How far the base's own account of its place went from the first one, m; 0 where it stayed.
    pub base_moved_m: f64,
}

impl Recording {
    /// The session's clock begins with the first epoch; with ranges alone with the first range. Less that clock's own zero (the week of
    /// the first epoch, or that of the ranges' clock), ns.
    pub fn zero_ns(&self) -> i64 {
        match (self.rover.epochs.first(), self.ranges.rows.first()) {
            (Some(epoch), _) => -week_ns(epoch),
            (None, Some(range)) => -range.t_ns,
            (None, None) => 0,
        }
    }

    /// The base's antenna by its own account.
    pub fn base_place(&self) -> Option<Geodetic> {
        place_of(&Station {
            position_m: self.base.approximate_position_m,
            antenna_delta_hen_m: self.base.antenna_delta_hen_m,
        })
    }
}

/// The antenna of a station by its own account.
pub(super) fn place_of(station: &Station) -> Option<Geodetic> {
    let marker = Geodetic::from_ecef_m(station.position_m?);
    let [up, east, north] = station.antenna_delta_hen_m;
    Some(LocalFrame::new(marker).to_geodetic([east, north, up]))
}

/// A recording on its way.
#[derive(Clone, Debug, Default)]
pub(super) struct Recorder {
    pub(super) recording: Recording,
    rover: EpochReader,
    base: EpochReader,
    ranges: RangeReader,
    /// Rows that came later than later ones of their stream.
    pub(super) late: u64,
}

impl Recorder {
    /// Takes a row of a stream; says whether it completed anything.
    pub(super) fn take(&mut self, stream: StreamId, values: &[f64]) -> bool {
        match stream {
            ROVER => {
                let epochs = self.rover.take(values);
                let recording = &mut self.recording;
                keep(&mut recording.rover, epochs, &self.rover.station, &mut self.late)
            }
            BASE => {
                let epochs = self.base.take(values);
                let recording = &mut self.recording;
                let complete = keep(&mut recording.base, epochs, &self.base.station, &mut self.late);
                if let (true, Some([x, y, z]), Some(now_m)) =
                    (complete, recording.base.approximate_position_m, self.base.station.position_m)
                {
                    let off_m = libm::hypot(libm::hypot(now_m[0] - x, now_m[1] - y), now_m[2] - z);
                    recording.base_moved_m = recording.base_moved_m.max(off_m);
                }
                complete
            }
            RANGES => self.ranges.take(values),
            navigation if is_navigation(navigation) => {
                navigation_rows::take(values, &mut self.recording.navigation)
            }
            _ => false,
        }
    }

    /// What came so far, in order of time.
    pub(super) fn whole(&self) -> Recording {
        let mut whole = Recording { ranges: self.ranges.sorted(), ..self.recording.clone() };
        whole.navigation.in_order_of_time();
        whole
    }

    /// Ranges as they came.
    pub(super) fn ranges(&self) -> &TagRanges {
        &self.ranges.ranges
    }

    /// As that of the whole recording.
    pub(super) fn zero_ns(&self) -> i64 {
        match self.recording.rover.epochs.is_empty() {
            true => -self.ranges.ranges.rows.first().map_or(0, |range| range.t_ns),
            false => self.recording.zero_ns(),
        }
    }
}

/// The nanosecond of its week.
fn week_ns(epoch: &Epoch) -> i64 {
    epoch.time.ns - GpsTime::from_week(epoch.time.week(), 0.0).ns
}

/// Keeps the epochs that are later than all before them, as a reader of files does.
fn keep(to: &mut Observations, epochs: [Option<Epoch>; 2], station: &Station, late: &mut u64) -> bool {
    let mut complete = false;
    for epoch in epochs.into_iter().flatten() {
        if to.approximate_position_m.is_none() {
            to.approximate_position_m = station.position_m;
            to.antenna_delta_hen_m = station.antenna_delta_hen_m;
        }
        if to.epochs.last().is_some_and(|last| epoch.time <= last.time) {
            *late += 1;
            continue;
        }
        to.epochs.push(epoch);
        complete = true;
    }
    complete
}
