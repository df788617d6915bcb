//! A window of a session's charts, with as many values as there is room for.

use futures_util::TryStreamExt;
use lodestep_engine::measure::height::pressure_height_m;
use lodestep_engine::sample::ImuSample;
use lodestep_engine::stream::Readings;
use schemars::JsonSchema;
use serde::Serialize;
use tokio::runtime::Handle;
use uuid::Uuid;

use super::cells::CELL_NS;
use super::limits::{Limit, limits};
use super::of_points::of_points;
use super::of_samples::{CHARTS as OF_SAMPLES, RATE, SampleCells};
use crate::error::Result;
use crate::sessions::engine_config::engine_config;
use crate::sessions::parameters::{self, Wanted};
use crate::sessions::stored_samples::{self, Recording};
use crate::state::App;
use crate::store::charts::Series;
use crate::store::sessions::Session;
use crate::store::track::{self, TrackKind};
use crate::store::{Store, StoreError, charts, raw_chunks};

/// What is asked for.
#[derive(Clone, Debug)]
pub(crate) struct Window {
    /// From when, ns.
    pub(crate) from_ns: i64,
    /// Until when, ns.
    pub(crate) to_ns: i64,
    /// How many values of each line at most.
    pub(crate) buckets: usize,
    /// Which charts; all of them when there are none.
    pub(crate) charts: Vec<String>,
}

/// The answer.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "SessionCharts")]
pub(crate) struct Charts {
    session_id: Uuid,
    from_s: f64,
    to_s: f64,
    limits: Vec<Limit>,
    series: Vec<Line>,
}

/// One line: value `i` is of the time from `start_s + i · step_s` on, for `step_s`.
#[derive(Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "ChartLine")]
struct Line {
    #[schemars(example = &"height")]
    chart: String,
    #[schemars(example = &"main")]
    series: String,
    start_s: f64,
    step_s: f64,
    /// The smallest value of each step; null where there is none.
    low: Vec<Option<f32>>,
    /// The largest, likewise; left out where it is the smallest everywhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    high: Option<Vec<Option<f32>>>,
}

impl Window {
    fn wants(&self, chart: &str) -> bool {
        self.charts.is_empty() || self.charts.iter().any(|wanted| wanted == chart)
    }

    /// What each value may span, ns.
    fn step_ns(&self) -> i64 {
        (self.to_ns.saturating_sub(self.from_ns) / self.buckets.max(1) as i64).max(1)
    }

    /// Cells of this length, as a grid of whole milliseconds.
    fn sample_cell_ns(&self) -> i64 {
        ((self.step_ns() + 999_999) / 1_000_000 * 1_000_000).min(CELL_NS)
    }
}

/// The charts of a session in a window. What is stored is merged; of a session that was never processed,
/// live for instance, and of a window that is smaller than what is stored can show, the samples are read.
pub(crate) async fn charts(app: &App, session: &Session, window: Window) -> Result<Charts> {
    let mut series = charts::of_session(app.store.read(), session.id).await?;
    let processed = !series.is_empty();
    if !processed {
        let points: Vec<_> =
            track::points(app.store.read(), session.id, TrackKind::Main).try_collect().await?;
        series = of_points(session.declaration(), TrackKind::Main, &points);
    }
    series.retain(|line| window.wants(&line.chart));
    let wants_samples = OF_SAMPLES.iter().any(|chart| window.wants(chart));
    if (wants_samples && window.step_ns() < CELL_NS) || !processed {
        let mut read = from_samples(app, session, &window).await?;
        // A window cuts seconds in two: the stored rate is better.
        read.retain(|line| !processed || line.chart != RATE);
        series.retain(|line| !OF_SAMPLES.contains(&&line.chart[..]));
        series.extend(read);
    }
    if window.wants("pressure_height") {
        level_pressure(app, session, &mut series).await?;
    }
    // The levels that the session is computed with, not those of a system as it is by default.
    let mut config = engine_config(&app.site, session, &session.streams);
    // Where these cannot be told any more, its levels are those of the defaults.
    if let Ok(chosen) = parameters::of_walk(app, session, Wanted::AsStored).await {
        chosen.parameters.apply(&mut config);
    }
    Ok(Charts {
        session_id: session.id,
        from_s: seconds(window.from_ns),
        to_s: seconds(window.to_ns),
        limits: limits(&config).into_iter().filter(|limit| window.wants(&limit.chart)).collect(),
        series: series.iter().filter_map(|line| merged(line, &window)).collect(),
    })
}

/// The samples of the window, cut into cells as small as it shows them.
async fn from_samples(app: &App, session: &Session, window: &Window) -> Result<Vec<Series>> {
    let mut recordings = Vec::new();
    for &stream in &session.streams {
        recordings.extend(stored_samples::recording(&app.store, session.id, stream).await?);
    }
    let (store, runtime, window) = (app.store.clone(), Handle::current(), window.clone());
    let reading = tokio::task::spawn_blocking(move || {
        let mut all = Vec::new();
        for recording in recordings {
            all.extend(stream_samples(&store, &runtime, &recording, &window)?);
        }
        Ok::<_, StoreError>(all)
    });
    Ok(reading.await.map_err(anyhow::Error::new)??.into_iter().filter(has_values).collect())
}

/// Whether a line of samples has anything to show.
fn has_values(line: &Series) -> bool {
    line.low.iter().any(|value| value.is_finite())
}

fn stream_samples(
    store: &Store,
    runtime: &Handle,
    recording: &Recording,
    window: &Window,
) -> Result<Vec<Series>, StoreError> {
    let between = raw_chunks::sequences_between(store.read(), recording.origin, window.from_ns, window.to_ns);
    let Some((first, last)) = runtime.block_on(between)? else { return Ok(Vec::new()) };
    let mut cells = SampleCells::new(recording.stream, window.sample_cell_ns());
    let mut next = first;
    while next <= last {
        let chunks = runtime.block_on(raw_chunks::next(store.read(), recording.origin, next, 1))?;
        let Some(end) = chunks.last().map(|chunk| chunk.first_sequence + chunk.sequences) else { break };
        next = end;
        let samples = chunks.iter().flat_map(|chunk| imu_samples(&chunk.readings));
        samples.filter(|s| (window.from_ns..window.to_ns).contains(&s.t_ns)).for_each(|s| cells.take(s));
    }
    Ok(cells.into_series().filter(|line| window.wants(&line.chart)).collect())
}

/// Heights by pressure are counted from the start of the recording, which stands at the track's first height.
async fn level_pressure(app: &App, session: &Session, series: &mut [Series]) -> Result<()> {
    let first = track::first(app.store.read(), session.id).await?;
    let first_u_m = first.map_or(session.start.position_m[2], |point| point.position_n_m[2]);
    for line in series.iter_mut().filter(|line| line.chart == "pressure_height") {
        let stream = session.streams.iter().copied().find(|stream| stream.name() == line.name);
        let Some(stream) = stream else { continue };
        let Some(recording) = stored_samples::recording(&app.store, session.id, stream).await? else {
            continue;
        };
        let chunks = raw_chunks::next(app.store.read(), recording.origin, 0, 1).await?;
        let Some(zero_m) = mean_height_m(chunks.iter().flat_map(|chunk| imu_samples(&chunk.readings))) else {
            continue;
        };
        for value in line.low.iter_mut().chain(&mut line.high) {
            *value += (first_u_m - zero_m) as f32;
        }
    }
    Ok(())
}

/// The samples of an inertial sensor; none of another stream.
fn imu_samples(readings: &Readings) -> &[ImuSample] {
    match readings {
        Readings::Imu(samples) => samples,
        Readings::Values(_) => &[],
    }
}

/// Mean height by pressure of the first readings, m in the standard atmosphere.
fn mean_height_m<'a>(samples: impl Iterator<Item = &'a ImuSample>) -> Option<f64> {
    let (mut sum_m, mut readings) = (0.0, 0_u32);
    for pressure_hpa in samples.filter_map(|sample| sample.pressure_hpa).take(100) {
        sum_m += pressure_height_m(pressure_hpa);
        readings += 1;
    }
    (readings > 0).then(|| sum_m / f64::from(readings))
}

/// The part of a line that lies in the window, cells merged to as many as it has room for. Steps begin at
/// multiples of their length, so that a window that moves shows the same steps.
fn merged(line: &Series, window: &Window) -> Option<Line> {
    let cells = (window.step_ns() + line.cell_ns - 1) / line.cell_ns;
    let step_ns = cells * line.cell_ns;
    let end_cell = line.first_cell + line.low.len() as i64;
    let from = window.from_ns.max(line.first_cell * line.cell_ns).div_euclid(step_ns);
    let to = (window.to_ns - 1).min(end_cell * line.cell_ns - 1).div_euclid(step_ns);
    if to < from {
        return None;
    }
    let within = |step: i64| {
        let place = |cell: i64| (cell - line.first_cell).clamp(0, line.low.len() as i64) as usize;
        place(step * cells)..place((step + 1) * cells)
    };
    let mut low = Vec::with_capacity((to - from + 1) as usize);
    let mut high = Vec::with_capacity(low.capacity());
    for step in from..=to {
        low.push(tidy(line.low[within(step)].iter().copied().fold(f32::NAN, f32::min)));
        high.push(tidy(line.high[within(step)].iter().copied().fold(f32::NAN, f32::max)));
    }
    if low.iter().all(Option::is_none) {
        return None;
    }
    Some(Line {
        chart: line.chart.clone(),
        series: line.name.clone(),
        start_s: seconds(from * step_ns),
        step_s: seconds(step_ns),
        high: (high != low).then_some(high),
        low,
    })
}

/// Six digits; none for what is not a number.
fn tidy(value: f32) -> Option<f32> {
    if !value.is_finite() {
        return None;
    }
    let value = f64::from(value);
    let scale = 10_f64.powi(5 - value.abs().max(1e-30).log10().floor() as i32);
    Some(((value * scale).round() / scale) as f32)
}

fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::super::cells::Cells;
    use super::*;

    fn window(from_ns: i64, to_ns: i64, buckets: usize) -> Window {
        Window { from_ns, to_ns, buckets, charts: Vec::new() }
    }

    #[test]
    fn merging_loses_no_extreme_and_keeps_to_a_grid_of_its_own() {
        let mut cells = Cells::new(100);
        for k in 0..1000 {
            cells.take(k * 100 + 50, if k == 437 { -5.0 } else { f64::from((k % 7) as i32) });
        }
        let line = cells.into_series("a", "b").unwrap();
        let all = merged(&line, &window(0, 100_000, 100)).unwrap();
        assert_eq!(all.low.len(), 100);
        assert_eq!(all.low[43], Some(-5.0));
        assert!(all.high.unwrap().iter().all(|high| *high == Some(6.0)));
        // A window moved by less than a step shows the same steps, and one more.
        let moved = merged(&line, &window(1_300, 51_300, 50)).unwrap();
        assert!((moved.start_s - 1e-6).abs() < 1e-15, "{moved:?}");
        assert_eq!(moved.low[1..10], all.low[2..11]);
        // Never more values than asked for and one at either end.
        assert!(moved.low.len() <= 52);
        // No finer than what is known, and nothing where nothing is.
        let fine = merged(&line, &window(200, 500, 1000)).unwrap();
        assert_eq!((fine.low.len(), fine.high), (3, None));
        assert_eq!(merged(&line, &window(200_000, 300_000, 10)), None);
    }

    #[test]
    fn values_have_six_digits_and_holes_are_null() {
        assert_eq!(
            [tidy(-130.123_46), tidy(0.001_234_567), tidy(0.0)],
            [Some(-130.123), Some(0.001_234_57), Some(0.0)]
        );
        assert_eq!(tidy(f32::NAN), None);
    }
}
