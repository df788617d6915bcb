//! How well standing feet are recognised, by gait and sample rate: on simulated walks, and on recorded
//! ones under motion capture.

use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use indicatif::ProgressBar;
use lodestep_engine::evaluate::pedestrian::{FootInstant, StanceErrors, foot_instants, stances};
use lodestep_engine::evaluate::{median, percentile};
use lodestep_engine::event::TrackPoint;
use lodestep_engine::geo::Site;
use lodestep_engine::parse::truth_csv;
use lodestep_engine::sample::ImuSample;
use lodestep_engine::session::{Session, SessionConfig};
use lodestep_engine::sim::pedestrian::{SensorModel, Simulator, WalkKind, Walker};
use lodestep_engine::stream::Readings;
use lodestep_engine::systems::pedestrian::Side;
use lodestep_engine::systems::pedestrian::{self, Aids};
use lodestep_engine::track::Track;

use super::recordings::{self, Judge, Recording};
use crate::cli::failure::Failure;
use crate::cli::log_file::{LogFile, read_small};
use crate::cli::print::print;
use crate::cli::progress;
use crate::sessions::merge_by_time::StreamReadings;

/// The arguments of `lodestep evaluate stance`.
#[derive(Debug, Args)]
pub(super) struct StanceArgs {
    /// Recordings with motion capture (NAME.csv beside NAME.truth.csv), or folders of them, to judge
    /// beside the simulated walks
    #[arg(value_name = "DIR|FILES")]
    paths: Vec<PathBuf>,

    /// How many seeds of each simulated walk, from 1 on
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: u64,
}

/// Sample rates of simulated sensors, Hz.
const RATES_HZ: [f64; 4] = [100.0, 200.0, 400.0, 820.0];

/// Name, walk, and how far the soles give, m.
fn gaits() -> [(&'static str, WalkKind, f64); 6] {
    [
        ("slow walking, 0.5 m/s", WalkKind::Slow { metres: 25.0 }, 0.0),
        ("walking, 1.25 m/s", WalkKind::Line { metres: 60.0 }, 0.0),
        ("walking, soles give 6 mm", WalkKind::Line { metres: 60.0 }, 0.006),
        ("running, 3.1 m/s", WalkKind::Run { metres: 150.0 }, 0.0),
        ("stairs", WalkKind::Stairs, 0.0),
        ("crawling, 0.5 m/s", WalkKind::Crawl { metres: 20.0 }, 0.0),
    ]
}

/// Recorded walks by how fast the foot is in its swings (95th percentile of its speed), m/s.
const RECORDED: [(&str, f64); 3] = [
    ("crawling: feet up to 2.2 m/s", 2.2),
    ("walking and stairs: up to 3.5 m/s", 3.5),
    ("running: faster", f64::INFINITY),
];

/// One row.
#[derive(Default)]
struct Row {
    walks: usize,
    errors: StanceErrors,
    /// Length of the path as the engine told it, m.
    told_m: f64,
    /// How much the engine's height grew beyond the true one, over all walks, m.
    height_error_m: f64,
    /// How late each walk's decisions came, s.
    late_s: Vec<f64>,
}

/// What the engine told of one foot.
struct Told {
    /// When, and whether the foot was taken to stand.
    stands: Vec<(i64, bool)>,
    distance_m: f64,
    /// Height at the end less height at the start, m.
    risen_m: f64,
    late_s: f64,
}

/// Prints the table.
pub(super) fn stance(args: &StanceArgs) -> Result<()> {
    let found = recorded(&args.paths)?;
    let count = gaits().len() as u64 * RATES_HZ.len() as u64 * args.seeds + found.len() as u64;
    let bar = progress::of_count(count, "walks");
    let mut out = format!(
        "One foot by zero velocity alone, all with the defaults. A contact is a time in which the foot stands flat; of recorded \
         walks one in which it is slower than 0.4 m/s. *Missed* are contacts in which the foot was never taken to stand, *false* are stances \
         that lie whole in a swing. *Held* is the share of the contacts in which the foot is taken to stand, and the speed the true one in all \
         that time, rms. *Rises* is how far the foot truly rises while it is held, on the mean: a filter that holds it does not see that. *Distance* \
         is the error of the path's length where that is known, *height* what the height grows too much by in a contact. *Late* is how long after a sample the engine knows. Simulated CMP10A noise, {} seeds a row. Made by \
         `lodestep evaluate stance --seeds {}`.\n\n\
         | walk | Hz | walks | contacts | missed | false | held, % | speed held, m/s | rises, mm | distance, % | height, mm | late, ms |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|\n",
        args.seeds, args.seeds
    );
    for (name, kind, sole_m) in gaits() {
        for rate_hz in RATES_HZ {
            let mut row = Row::default();
            for seed in 1..=args.seeds {
                simulated(&mut row, &kind, sole_m, seed, rate_hz);
                bar.inc(1);
            }
            row.print(name, rate_hz, &row.distance(), &mut out);
        }
    }
    let walks = found.into_iter().map(Recorded::read).collect::<Result<Vec<_>>>()?;
    let mut slowest_m_s = 0.0;
    for (name, fastest_m_s) in RECORDED {
        for every in [1, 2] {
            let mut row = Row::default();
            let mut rates_hz = Vec::new();
            for walk in walks.iter().filter(|walk| (slowest_m_s..fastest_m_s).contains(&walk.fast_m_s)) {
                let samples = walk.thinned(every);
                rates_hz.push(rate_hz(&samples));
                row.take(&walk.truth, &told(&samples, pedestrian::two_feet().gravity_m_s2));
                bar.inc(u64::from(every == 1));
            }
            if let Some(rate_hz) = median(&rates_hz) {
                row.print(&format!("recorded, {name}"), rate_hz, "–", &mut out);
            }
        }
        slowest_m_s = fastest_m_s;
    }
    bar.finish_and_clear();
    print(&out)
}

impl Row {
    fn take(&mut self, truth: &[FootInstant], told: &Told) {
        self.walks += 1;
        self.errors.add(&stances(truth, &told.stands));
        self.told_m += told.distance_m;
        if let [first, .., last] = truth {
            self.height_error_m += told.risen_m - (last.position_m[2] - first.position_m[2]);
        }
        self.late_s.push(told.late_s);
    }

    /// Error of the path's length, percent.
    fn distance(&self) -> String {
        format!("{:+.2}", 100.0 * (self.told_m / self.errors.path_m - 1.0))
    }

    fn print(&self, name: &str, rate_hz: f64, distance: &str, out: &mut String) {
        let errors = &self.errors;
        writeln!(
            out,
            "| {name} | {rate_hz:.0} | {} | {} | {} | {} | {:.0} | {:.3} | {:+.1} | {distance} | {:+.1} | {:.0} |",
            self.walks,
            errors.contacts,
            errors.missed,
            errors.false_stances,
            errors.held_percent(),
            errors.held_speed_m_s(),
            1e3 * errors.risen_m(),
            1e3 * self.height_error_m / errors.contacts as f64,
            1e3 * median(&self.late_s).unwrap_or(f64::NAN),
        )
        .expect("writing to a string cannot fail");
    }
}

fn simulated(row: &mut Row, kind: &WalkKind, sole_m: f64, seed: u64, rate_hz: f64) {
    let site = Site::fast();
    let mut model = SensorModel::cmp10a();
    model.imu.rate_hz = rate_hz;
    let walker = Walker { sole_m, ..Walker::default() };
    let walk = Simulator::with_walker(kind, seed, &site, &model, walker).into_walk();
    let truth: Vec<FootInstant> = walk
        .truth
        .iter()
        .zip(&walk.left)
        .map(|([left, _], sample)| FootInstant {
            t_ns: sample.t_ns,
            position_m: left.position_n_m,
            speed_m_s: left.velocity_n_m_s.iter().map(|v| v * v).sum::<f64>().sqrt(),
            in_contact: left.stance,
        })
        .collect();
    row.take(&truth, &told(&walk.left, site.gravity_m_s2));
}

/// What the engine takes for stances, sample by sample as they come.
fn told(samples: &[ImuSample], gravity_m_s2: f64) -> Told {
    let aids =
        Aids { zupt: true, heading: false, maru: false, separation: false, markers: false, altimeter: false };
    let own = pedestrian::Config { aids, ..Default::default() };
    let config = SessionConfig { gravity_m_s2, ..own.session(&[Side::Left]) };
    let mut session = Session::new(config).expect("a foot is a stream of a walk");
    let mut stands: Vec<(i64, bool)> = Vec::with_capacity(samples.len());
    let (mut late_s, mut events) = (Vec::new(), Vec::new());
    let mut track = Track::default();
    for sample in samples {
        session.push(Side::Left, sample, &mut events);
        events.drain(..).for_each(|event| track.take(event));
        let Some(state) = session.sensors().first().copied() else { continue };
        if stands.last().is_none_or(|(t_ns, _)| *t_ns < state.t_ns) {
            stands.push((state.t_ns, state.stance));
            late_s.push((sample.t_ns - state.t_ns) as f64 * 1e-9);
        }
    }
    session.end(Side::Left, &mut events);
    events.drain(..).for_each(|event| track.take(event));
    let height_m = |point: Option<&TrackPoint>| point.map_or(f64::NAN, |point| point.position_n_m[2]);
    let risen_m = height_m(track.points.last()) - height_m(track.points.first());
    let late_s = median(&late_s).unwrap_or(f64::NAN);
    Told { stands, distance_m: session.summary().distance_m, risen_m, late_s }
}

/// The recordings with motion capture.
fn recorded(paths: &[PathBuf]) -> Result<Vec<(Recording, PathBuf)>> {
    let found: Vec<_> = recordings::find(paths, false)?
        .into_iter()
        .filter_map(|recording| match recording.judge.clone() {
            Judge::MotionCapture(truth) => Some((recording, truth)),
            _ => None,
        })
        .collect();
    if found.is_empty() && !paths.is_empty() {
        return Err(Failure::BadInput(format!(
            "no recording with motion capture in {}: expected NAME.csv beside NAME.truth.csv",
            paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
        ))
        .into());
    }
    Ok(found)
}

/// A recorded walk with its truth.
struct Recorded {
    samples: Vec<ImuSample>,
    truth: Vec<FootInstant>,
    /// 95th percentile of the foot's speed while it is on its way, m/s.
    fast_m_s: f64,
}

impl Recorded {
    fn read((recording, truth): (Recording, PathBuf)) -> Result<Recorded> {
        let places =
            truth_csv::read(&read_small(&truth)?).map_err(|error| Failure::bad_input(&truth, error))?;
        let truth = foot_instants(&places);
        let log = recording.left.or(recording.right);
        let mut samples = Vec::new();
        if let Some(path) = log {
            let mut log = LogFile::open(&path, &ProgressBar::hidden())?;
            while let Readings::Imu(mut piece) = log.next_piece()?
                && !piece.is_empty()
            {
                samples.append(&mut piece);
            }
        }
        let swings: Vec<f64> =
            truth.iter().filter(|instant| !instant.in_contact).map(|instant| instant.speed_m_s).collect();
        Ok(Recorded { samples, truth, fast_m_s: percentile(&swings, 0.95).unwrap_or(0.0) })
    }

    /// As a sensor would give it whose rate is so many times lower: means of neighbours.
    fn thinned(&self, every: usize) -> Vec<ImuSample> {
        let mean = |samples: &[ImuSample], part: fn(&ImuSample) -> [f64; 3]| -> [f64; 3] {
            std::array::from_fn(|axis| {
                samples.iter().map(|sample| part(sample)[axis]).sum::<f64>() / samples.len() as f64
            })
        };
        self.samples
            .chunks_exact(every)
            .map(|neighbours| ImuSample {
                t_ns: (neighbours[0].t_ns + neighbours[every - 1].t_ns) / 2,
                w_ib_b_rad_s: mean(neighbours, |sample| sample.w_ib_b_rad_s),
                f_b_m_s2: mean(neighbours, |sample| sample.f_b_m_s2),
                ..neighbours[0]
            })
            .collect()
    }
}

fn rate_hz(samples: &[ImuSample]) -> f64 {
    match (samples.first(), samples.last()) {
        (Some(first), Some(last)) if last.t_ns > first.t_ns => {
            (samples.len() - 1) as f64 / ((last.t_ns - first.t_ns) as f64 * 1e-9)
        }
        _ => f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_contact_of_a_simulated_walk_is_seen_and_no_swing_is_held() {
        for (_, kind) in [
            ("walking", WalkKind::Line { metres: 15.0 }),
            ("slow", WalkKind::Slow { metres: 8.0 }),
            ("running", WalkKind::Run { metres: 40.0 }),
            ("crawling", WalkKind::Crawl { metres: 8.0 }),
        ] {
            let mut row = Row::default();
            simulated(&mut row, &kind, 0.0, 1, 100.0);
            let errors = row.errors;
            assert!(errors.contacts > 8, "{kind:?}: {errors:?}");
            assert_eq!(errors.missed, 0, "{kind:?}: {errors:?}");
            // A foot that is dragged evenly looks like one that stands: the table tells how often.
            if !matches!(kind, WalkKind::Crawl { .. }) {
                assert_eq!(errors.false_stances, 0, "{kind:?}: {errors:?}");
            }
            assert!(
                (row.told_m / errors.path_m - 1.0).abs() < 0.05,
                "{kind:?}: {} m, {errors:?}",
                row.told_m
            );
            assert!(row.late_s[0] <= 0.031, "{kind:?}: {} s", row.late_s[0]);
        }
    }
}
