//! What the samples themselves show: lengths of rate, force and field, the height by pressure, and how many
//! came in each second.

use lodestep_engine::measure::height::pressure_height_m;
use lodestep_engine::sample::ImuSample;
use lodestep_engine::stream::StreamId;

use super::cells::Cells;
use crate::store::charts::Series;

/// The charts that samples give, as [`SampleCells`] has them.
pub(super) const CHARTS: [&str; 4] = ["gyro_norm", "force_norm", "field", "pressure_height"];

/// The chart of the samples in each second, whatever the cells.
pub(super) const RATE: &str = "rate";

const SECOND_NS: i64 = 1_000_000_000;
/// A silence is drawn as so many seconds without samples, at most.
const LONGEST_SILENCE_S: i64 = 3_600;

/// One stream's samples, cut into cells: rad/s, m/s², µT, m in the standard atmosphere.
#[derive(Clone, Debug)]
pub(super) struct SampleCells {
    stream: StreamId,
    cells: [Cells; 4],
    rate: Cells,
    /// The present second, and how many samples it has had.
    second: Option<(i64, u32)>,
    /// The first second is not a whole one.
    is_whole: bool,
}

impl SampleCells {
    pub(super) fn new(stream: StreamId, cell_ns: i64) -> SampleCells {
        SampleCells {
            stream,
            cells: std::array::from_fn(|_| Cells::new(cell_ns)),
            rate: Cells::new(SECOND_NS),
            second: None,
            is_whole: false,
        }
    }

    #[inline]
    pub(super) fn take(&mut self, sample: &ImuSample) {
        let length = |[x, y, z]: [f64; 3]| (x * x + y * y + z * z).sqrt();
        let [gyro, force, field, height] = &mut self.cells;
        gyro.take(sample.t_ns, length(sample.w_ib_b_rad_s));
        force.take(sample.t_ns, length(sample.f_b_m_s2));
        if let Some(mag_b_ut) = sample.mag_b_ut {
            field.take(sample.t_ns, length(mag_b_ut));
        }
        if let Some(pressure_hpa) = sample.pressure_hpa {
            height.take(sample.t_ns, pressure_height_m(pressure_hpa));
        }
        self.count(sample.t_ns.div_euclid(SECOND_NS));
    }

    /// One more sample of this second; when it is another than the last one's, that one is done.
    #[inline]
    fn count(&mut self, second: i64) {
        match &mut self.second {
            Some((present, samples)) if *present == second => *samples += 1,
            last => {
                if let Some((done, samples)) = last.replace((second, 1)) {
                    if self.is_whole {
                        self.rate.take(done * SECOND_NS, f64::from(samples));
                    }
                    for silent in done.saturating_add(1)..second.min(done.saturating_add(LONGEST_SILENCE_S)) {
                        self.rate.take(silent * SECOND_NS, 0.0);
                    }
                    self.is_whole = true;
                }
            }
        }
    }

    pub(super) fn into_series(self) -> impl Iterator<Item = Series> {
        let stream = self.stream;
        let cells = CHARTS.into_iter().zip(self.cells);
        cells
            .chain([(RATE, self.rate)])
            .filter_map(move |(chart, cells)| cells.into_series(chart, stream.name()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_counts_whole_seconds_and_shows_a_silence() {
        let mut cells = SampleCells::new(StreamId::named("body"), 100_000_000);
        for k in (0..250).chain(550..700) {
            cells.take(&ImuSample {
                t_ns: k * 10_000_000,
                w_ib_b_rad_s: [3.0, 0.0, 4.0],
                f_b_m_s2: [0.0, 0.0, 9.8],
                mag_b_ut: None,
                pressure_hpa: Some(1013.25),
            });
        }
        let all: Vec<_> = cells.into_series().collect();
        let names: Vec<_> = all.iter().map(|line| &line.chart[..]).collect();
        assert_eq!(names, ["gyro_norm", "force_norm", "pressure_height", "rate"]);
        assert!(all[0].low.iter().filter(|value| value.is_finite()).all(|value| *value == 5.0));
        // The first and the last second are not whole ones.
        assert_eq!((all[3].first_cell, &all[3].low[..]), (1, &[100.0, 50.0, 0.0, 0.0, 50.0][..]));
    }
}
