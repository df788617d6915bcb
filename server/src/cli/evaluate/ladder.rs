//! The ladder of paper 1 on simulated walks: what each aid adds, as a Markdown table.

use std::fmt::Write as _;

use anyhow::Result;
use clap::Args;
use lodestep_engine::evaluate::{TruthErrors, VisitErrors, against_truth, visits};
use lodestep_engine::event::TrackPoint;
use lodestep_engine::geo::Site;
use lodestep_engine::parse::truth_csv::KnownPlace;
use lodestep_engine::sample::ImuSample;
use lodestep_engine::session::{SessionConfig, Visit};
use lodestep_engine::sim::pedestrian::{MarkerVisit, SensorModel, Walk, WalkKind, simulate};
use lodestep_engine::stream::Readings;
use lodestep_engine::systems::pedestrian::Side;
use lodestep_engine::systems::pedestrian::{self, Aids};

use crate::cli::print::print;
use crate::cli::progress;
use crate::cli::run::run;
use crate::cli::solution::Solution;
use crate::sessions::merge_by_time::StreamReadings;

/// The arguments of `lodestep evaluate ladder`.
#[derive(Debug, Args)]
pub(super) struct LadderArgs {
    /// How many seeds, from 1 on
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: u64,

    /// Which solution to score: smoothed adds a last rung
    #[arg(long, value_enum, default_value_t)]
    solution: Solution,
}

/// A rung: its name, and the aids on it.
struct Rung {
    name: &'static str,
    aids: Aids,
    solution: Solution,
}

fn rungs(solution: Solution) -> Vec<Rung> {
    let none = Aids {
        zupt: false,
        heading: false,
        maru: false,
        separation: false,
        markers: false,
        altimeter: false,
    };
    let zupt = Aids { zupt: true, ..none };
    let heading = Aids { heading: true, ..zupt };
    let maru = Aids { maru: true, ..heading };
    let separation = Aids { separation: true, ..maru };
    let markers = Aids { markers: true, ..separation };
    let altimeter = Aids { altimeter: true, ..markers };
    let mut rungs: Vec<Rung> = [
        ("ZUPT", zupt),
        ("+ heading", heading),
        ("+ MARU", maru),
        ("+ separation", separation),
        ("+ markers", markers),
        ("+ altimeter", altimeter),
    ]
    .map(|(name, aids)| Rung { name, aids, solution: Solution::Filtered })
    .into();
    if solution == Solution::Smoothed {
        rungs.push(Rung { name: "smoothed", aids: altimeter, solution });
    }
    rungs
}

/// One walk on one rung.
struct Climbed {
    truth: Option<TruthErrors>,
    visits: Option<VisitErrors>,
    /// Largest step at a visit beyond what the truth moved, m.
    jump_m: f64,
}

/// Prints the ladder.
pub(super) fn ladder(args: &LadderArgs) -> Result<()> {
    let site = Site::fast();
    let model = SensorModel::cmp10a();
    let rungs = rungs(args.solution);
    let bar = progress::of_count(args.seeds * 2 * rungs.len() as u64, "runs");
    let mut rectangle: Vec<Vec<Climbed>> = rungs.iter().map(|_| Vec::new()).collect();
    let mut spiral: Vec<Vec<Climbed>> = rungs.iter().map(|_| Vec::new()).collect();
    for seed in 1..=args.seeds {
        for (kind, results) in [(WalkKind::Rectangle, &mut rectangle), (WalkKind::Spiral, &mut spiral)] {
            let walk = simulate(&kind, seed, &site, &model);
            for (rung, results) in rungs.iter().zip(results) {
                results.push(climb(&walk, &site, rung)?);
                bar.inc(1);
            }
        }
    }
    bar.finish_and_clear();

    let mut out = format!(
        "Simulated CMP10A sensors at {}, seeds 1 to {}; figures are the mean over the seeds and, after the stroke, \
         the largest. Made by `lodestep evaluate ladder --seeds {}{}`.\n\n",
        site.name,
        args.seeds,
        args.seeds,
        if args.solution == Solution::Smoothed { " --solution smoothed" } else { "" }
    );
    out.push_str(
        "| aids | rectangle 1.4 km: at the end, % of the path | rms, m | spiral 3.3 km: at the end, % of the path | rms, m \
         | height rms, m | at the markers before correction, m | largest jump at a marker, m |\n|---|---|---|---|---|---|---|---|\n",
    );
    for ((rung, rectangle), spiral) in rungs.iter().zip(&rectangle).zip(&spiral) {
        let truth = |climbed: &[Climbed], pick: fn(&TruthErrors) -> f64| {
            mean_and_largest(climbed.iter().filter_map(|c| c.truth.as_ref()).map(pick))
        };
        let at_markers = {
            let all = || spiral.iter().filter_map(|c| c.visits.as_ref());
            let mean = all().map(|v| v.horizontal.mean_m).sum::<f64>() / all().count() as f64;
            let largest = all().map(|v| v.horizontal.max_m).fold(f64::NAN, f64::max);
            if rung.aids.markers && all().count() > 0 {
                format!("{mean:.2} / {largest:.2}")
            } else {
                "–".to_owned()
            }
        };
        let jump = if rung.aids.markers {
            mean_and_largest(spiral.iter().map(|climbed| climbed.jump_m))
        } else {
            "–".to_owned()
        };
        writeln!(
            out,
            "| {} | {} | {} | {} | {} | {} | {at_markers} | {jump} |",
            rung.name,
            truth(rectangle, |t| t.end_error_percent),
            truth(rectangle, |t| t.horizontal.rms_m),
            truth(spiral, |t| t.end_error_percent),
            truth(spiral, |t| t.horizontal.rms_m),
            truth(spiral, |t| t.height_rms_m),
        )
        .expect("writing to a string cannot fail");
    }
    print(&out)
}

fn mean_and_largest(values: impl Iterator<Item = f64>) -> String {
    let values: Vec<f64> = values.collect();
    if values.is_empty() {
        return "–".to_owned();
    }
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let largest = values.iter().copied().fold(f64::NAN, f64::max);
    format!("{mean:.2} / {largest:.2}")
}

fn climb(walk: &Walk, site: &Site, rung: &Rung) -> Result<Climbed> {
    let config = SessionConfig {
        initial_position_n_m: walk.start_n_m(),
        declination_rad: site.declination_deg.to_radians(),
        site_field: Some(site.field()),
        gravity_m_s2: site.gravity_m_s2,
        solution: rung.solution.into(),
        ..pedestrian::Config { aids: rung.aids, ..Default::default() }.session(&Side::BOTH)
    };
    let told = if rung.aids.markers { visits_of(walk) } else { Vec::new() };
    let feet = [(Side::Left, InMemory(&walk.left)), (Side::Right, InMemory(&walk.right))];
    let walked = run(config, &told, feet)?;
    let known: Vec<KnownPlace> = walk
        .left
        .iter()
        .zip(&walk.truth)
        .map(|(sample, [left, right])| KnownPlace {
            t_ns: sample.t_ns,
            position_m: std::array::from_fn(|axis| {
                0.5 * (left.position_n_m[axis] + right.position_n_m[axis])
            }),
        })
        .collect();
    let points = &walked.track.points;
    Ok(Climbed {
        truth: against_truth(points, &known),
        visits: visits(&walked.track.visits),
        jump_m: largest_jump_m(points, &known, &told),
    })
}

/// The largest step from one epoch to the next beyond what the truth moved, in the seconds about a visit, m.
fn largest_jump_m(points: &[TrackPoint], known: &[KnownPlace], visits: &[Visit]) -> f64 {
    const ABOUT_NS: i64 = 5_000_000_000;
    let at_visit = |t_ns: i64| {
        visits.iter().any(|visit| (visit.t_start_ns - ABOUT_NS..visit.t_end_ns + ABOUT_NS).contains(&t_ns))
    };
    let off = |k: usize| -> [f64; 3] {
        std::array::from_fn(|axis| points[k].position_n_m[axis] - known[k].position_m[axis])
    };
    (1..points.len().min(known.len()))
        .filter(|k| at_visit(points[*k].t_ns))
        .map(|k| {
            let (before, after) = (off(k - 1), off(k));
            (0..3).map(|axis| (after[axis] - before[axis]).powi(2)).sum::<f64>().sqrt()
        })
        .fold(0.0, f64::max)
}

/// The visits of a simulated walk, as a session is told them.
pub(super) fn visits_of(walk: &Walk) -> Vec<Visit> {
    walk.visits.iter().map(as_told).collect()
}

/// A visit of a simulated walk, as a session is told it.
pub(super) fn as_told(visit: &MarkerVisit) -> Visit {
    let [e, n, u] = visit.position_n_m;
    Visit {
        marker: visit.marker.clone(),
        t_start_ns: visit.t_start_ns,
        t_end_ns: visit.t_end_ns,
        position_n_m: (e, n, Some(u)),
    }
}

/// Samples that are there already.
pub(super) struct InMemory<'a>(pub(super) &'a [ImuSample]);

impl StreamReadings for InMemory<'_> {
    fn next_piece(&mut self) -> Result<Readings> {
        const PIECE: usize = 4096;
        let (piece, rest) = self.0.split_at(self.0.len().min(PIECE));
        self.0 = rest;
        Ok(Readings::Imu(piece.to_vec()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_rung_adds_one_aid() {
        let count = |aids: Aids| {
            [aids.zupt, aids.heading, aids.maru, aids.separation, aids.markers, aids.altimeter]
                .into_iter()
                .filter(|on| *on)
                .count()
        };
        let counts: Vec<usize> = rungs(Solution::Filtered).iter().map(|rung| count(rung.aids)).collect();
        assert_eq!(counts, [1, 2, 3, 4, 5, 6]);
    }
}
