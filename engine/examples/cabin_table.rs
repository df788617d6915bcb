//! Tables 4 to 6 of paper 3 on simulated runs: `cargo run --release --features sim --example cabin_table -- 10 > tables.md`.
//!
//! Runs of 180 s to the source and 600 s on it, of so many seeds: scatter about the mean and, in brackets, about the truth, each as
//! the root mean square over the seeds; then how often errors are within 1.96 stated sigmas.

#[path = "../tests/cabin/run.rs"]
#[expect(dead_code, reason = "the table looks at the poses alone, the tests at what was found and told, too")]
mod run;

use std::error::Error;
use std::io::{self, Write};

use lodestep_engine::sim::cabin::{RunPlan, simulate};

use self::run::{Read, errors, process, spread};

/// A row of the table.
struct Line {
    name: &'static str,
    read: Read,
    platform: bool,
    from_s: f64,
    to_s: f64,
}

/// What a row gathers over the seeds: squares of scatters and totals, errors within their bounds and all of them, and epochs beyond
/// the protection level and all.
#[derive(Default)]
struct Sums {
    scatter: [f64; 6],
    total: [f64; 6],
    inside: [f64; 2],
    beyond: [u64; 2],
}

const SLEW_S: (f64, f64) = (40.0, 220.0);
const TRACK_S: (f64, f64) = (220.0, 820.0);

fn lines() -> Vec<Line> {
    let all = Read { platform_imu: true, ..Read::default() };
    let alone = Read { stations: false, encoders: false, ..Read::default() };
    let paper = Read { paper: true, ..all };
    let smoothed = Read { smoothed: true, ..all };
    let line = |name, read, platform, (from_s, to_s)| Line { name, read, platform, from_s, to_s };
    vec![
        line("cabin on the source, paper's filter", paper, false, TRACK_S),
        line("cabin on the source, antennas alone", alone, false, TRACK_S),
        line("cabin on the source, all aids", all, false, TRACK_S),
        line("cabin on the source, all aids, smoothed", smoothed, false, TRACK_S),
        line("cabin to the source, paper's filter", paper, false, SLEW_S),
        line("cabin to the source, antennas alone", alone, false, SLEW_S),
        line("cabin to the source, all aids", all, false, SLEW_S),
        line("platform on the source, paper's filter", paper, true, TRACK_S),
        line("platform on the source, all aids", all, true, TRACK_S),
        line("platform on the source, all aids, smoothed", smoothed, true, TRACK_S),
        line("platform to the source, paper's filter", paper, true, SLEW_S),
        line("platform to the source, all aids", all, true, SLEW_S),
    ]
}

fn main() -> Result<(), Box<dyn Error>> {
    let seeds: u64 = std::env::args().nth(1).map_or(Ok(10), |text| text.parse())?;
    let lines = lines();
    let mut sums: Vec<Sums> = lines.iter().map(|_| Sums::default()).collect();
    for seed in 0..seeds {
        let run = simulate(&RunPlan::default(), seed);
        let mut found: Vec<(Read, run::Found)> = Vec::new();
        for (line, sums) in lines.iter().zip(&mut sums) {
            let place = match found.iter().position(|(read, _)| *read == line.read) {
                Some(place) => place,
                None => {
                    found.push((line.read, process(&run, &line.read)?));
                    found.len() - 1
                }
            };
            let poses = &found[place].1.poses;
            let rows = if line.platform { &poses.platform } else { &poses.cabin };
            sums.add(&errors(&run, rows, line.platform, line.from_s, line.to_s));
        }
        writeln!(io::stderr(), "seed {seed} done")?;
    }
    let mut out = io::stdout().lock();
    writeln!(
        out,
        "| {seeds} seeds | e n u, mm | (about the truth) | yaw pitch roll, ° | (about the truth) | inside 95 % | beyond the protection level |"
    )?;
    writeln!(out, "|---|---|---|---|---|---|---|")?;
    for (line, sums) in lines.iter().zip(&sums) {
        sums.tell(line.name, seeds, &mut out)?;
    }
    Ok(())
}

impl Sums {
    fn add(&mut self, errors: &[(run::Errors, &lodestep_engine::systems::cabin::Row)]) {
        for (k, [_, scatter, total]) in spread(errors).into_iter().enumerate() {
            self.scatter[k] += scatter * scatter;
            self.total[k] += total * total;
        }
        for (error, row) in errors {
            let sigma = row.sigma_n_m();
            self.inside[0] += (0..3).filter(|k| error[*k].abs() < 1.96 * sigma[*k]).count() as f64;
            self.inside[1] += 3.0;
            let off_m = (error[0] * error[0] + error[1] * error[1] + error[2] * error[2]).sqrt();
            self.beyond[0] += u64::from(off_m > row.protection_level_m());
            self.beyond[1] += 1;
        }
    }

    fn tell(&self, name: &str, seeds: u64, out: &mut impl Write) -> io::Result<()> {
        let three = |sums: &[f64], unit: f64, decimals: usize| {
            let all = sums.iter().map(|sum| format!("{:.decimals$}", (sum / seeds as f64).sqrt() * unit));
            all.collect::<Vec<_>>().join(" ")
        };
        let degrees = 1f64.to_degrees();
        writeln!(
            out,
            "| {name} | {} | {} | {} | {} | {:.2} | {} of {} |",
            three(&self.scatter[..3], 1e3, 2),
            three(&self.total[..3], 1e3, 2),
            three(&self.scatter[3..], degrees, 4),
            three(&self.total[3..], degrees, 4),
            self.inside[0] / self.inside[1].max(1.0),
            self.beyond[0],
            self.beyond[1]
        )
    }
}
