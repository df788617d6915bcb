//! Looks on while a session is computed, and keeps what its charts need.

use std::collections::BTreeMap;

use lodestep_engine::event::{AidKind, Event};
use lodestep_engine::sample::ImuSample;
use lodestep_engine::session::{SensorState, Session, SessionConfig};
use lodestep_engine::stream::{Kind, StreamId};
use lodestep_engine::system::ChartValue;

use super::cells::{CELL_NS, Cells};
use super::of_samples::SampleCells;
use crate::store::charts::Series;

/// What the filter believes of its sensors changes slowly: it is looked at once in this time, ns.
const LOOK_NS: i64 = 500_000_000;

const AXES: [&str; 3] = ["x", "y", "z"];

/// The record of one run.
#[derive(Debug)]
pub(crate) struct Recorder {
    samples: BTreeMap<StreamId, SampleCells>,
    /// Innovations of each aid, accepted and not.
    innovations: BTreeMap<(AidKind, bool), Cells>,
    sensors: BTreeMap<StreamId, SensorCells>,
    /// The system's own charts, by chart and line.
    own: BTreeMap<(&'static str, String), Cells>,
    next_look_ns: i64,
}

/// The biases of one stream's sensor, each axis with its sigma, and the field's heading less the filter's.
#[derive(Debug)]
struct SensorCells {
    stream: StreamId,
    biases: [(&'static str, [Cells; 3]); 4],
    magnetic: Cells,
}

impl Recorder {
    /// Of a session that is configured so.
    pub(crate) fn new(config: &SessionConfig) -> Recorder {
        let inertial =
            || config.streams.iter().filter(|stream| stream.kind == Kind::Imu).map(|stream| stream.id);
        Recorder {
            samples: inertial().map(|stream| (stream, SampleCells::new(stream, CELL_NS))).collect(),
            innovations: BTreeMap::new(),
            sensors: inertial().map(|stream| (stream, SensorCells::new(stream))).collect(),
            own: BTreeMap::new(),
            next_look_ns: i64::MIN,
        }
    }

    /// A sample that the session is given next.
    #[inline]
    pub(crate) fn sample(&mut self, stream: StreamId, sample: &ImuSample) {
        if let Some(cells) = self.samples.get_mut(&stream) {
            cells.take(sample);
        }
    }

    /// Something that the session told.
    pub(crate) fn event(&mut self, event: &Event) {
        // Visits are few, and stored one by one.
        if let Event::Aid(outcome) = event
            && outcome.aid != AidKind::MARKERS
        {
            self.innovations
                .entry((outcome.aid, outcome.accepted))
                .or_insert_with(|| Cells::new(CELL_NS))
                .take(outcome.t_ns, outcome.nis);
        }
    }

    /// A value of the system's own charts.
    pub(crate) fn value(&mut self, value: ChartValue) {
        let ChartValue { t_ns, chart, series, value } = value;
        self.own.entry((chart, series)).or_insert_with(|| Cells::new(CELL_NS)).take(t_ns, value);
    }

    /// The session as it is at `t_ns`.
    #[inline]
    pub(crate) fn look(&mut self, session: &Session, t_ns: i64) {
        // A clock that steps back far begins anew.
        if t_ns < self.next_look_ns && self.next_look_ns.saturating_sub(t_ns) <= LOOK_NS {
            return;
        }
        self.next_look_ns = t_ns.saturating_add(LOOK_NS);
        for state in session.sensors() {
            if let Some(cells) = self.sensors.get_mut(&state.stream) {
                cells.take(t_ns, &state);
            }
        }
    }

    pub(crate) fn into_series(self) -> Vec<Series> {
        let innovations = self.innovations.into_iter().filter_map(|((aid, accepted), cells)| {
            cells.into_series(&innovation_chart(aid), if accepted { "accepted" } else { "rejected" })
        });
        let samples = self.samples.into_values().flat_map(SampleCells::into_series);
        let sensors = self.sensors.into_values().flat_map(SensorCells::into_series);
        let own =
            self.own.into_iter().filter_map(|((chart, series), cells)| cells.into_series(chart, &series));
        samples.chain(innovations).chain(sensors).chain(own).collect()
    }
}

impl SensorCells {
    fn new(stream: StreamId) -> SensorCells {
        let three = || std::array::from_fn(|_| Cells::new(LOOK_NS));
        SensorCells {
            stream,
            biases: ["gyro_bias", "gyro_bias_sigma", "accelerometer_bias", "accelerometer_bias_sigma"]
                .map(|chart| (chart, three())),
            magnetic: Cells::new(LOOK_NS),
        }
    }

    fn take(&mut self, t_ns: i64, state: &SensorState) {
        let values = [
            state.gyro_bias_b_rad_s,
            state.sigma_gyro_bias_rad_s,
            state.accelerometer_bias_b_m_s2,
            state.sigma_accelerometer_bias_m_s2,
        ];
        for ((_, axes), values) in self.biases.iter_mut().zip(values) {
            for (cells, value) in axes.iter_mut().zip(values) {
                cells.take(t_ns, value);
            }
        }
        if let Some(off_rad) = state.magnetic_minus_heading_rad {
            self.magnetic.take(t_ns, off_rad);
        }
    }

    fn into_series(self) -> impl Iterator<Item = Series> {
        let stream = self.stream;
        let biases = self.biases.into_iter().flat_map(move |(chart, axes)| {
            AXES.into_iter()
                .zip(axes)
                .filter_map(move |(axis, cells)| cells.into_series(chart, &format!("{stream}_{axis}")))
        });
        biases.chain(self.magnetic.into_series("magnetic", stream.name()))
    }
}

/// The chart of an aid's innovations.
pub(super) fn innovation_chart(aid: AidKind) -> String {
    format!("nis_{}", aid.as_str())
}

#[cfg(test)]
mod tests {
    use lodestep_engine::event::AidOutcome;
    use lodestep_engine::systems::pedestrian;

    use super::*;

    #[test]
    fn innovations_are_told_apart_by_what_became_of_them_and_infinite_ones_are_not_drawn() {
        let mut recorder = Recorder::new(&pedestrian::two_feet());
        for (t_ns, nis, accepted) in [(0, 0.5, true), (1_000_000_000, 20.0, false), (2, f64::INFINITY, false)]
        {
            recorder.event(&Event::Aid(AidOutcome {
                t_ns,
                stream: None,
                aid: pedestrian::aids::SEPARATION,
                nis,
                degrees_of_freedom: 1,
                updates: 1,
                accepted,
            }));
        }
        let all = recorder.into_series();
        let names: Vec<_> = all.iter().map(|series| (&series.chart[..], &series.name[..])).collect();
        assert_eq!(names, [("nis_separation", "rejected"), ("nis_separation", "accepted")]);
        assert_eq!((all[0].first_cell, &all[0].low[..]), (10, &[20.0][..]));
    }
}
