//! Walks whose files were damaged in several ways at once, as many as are asked for: how many are read, what they lose, and how
//! many tracks are wrong without a word.
//!
//!     cargo run -p lodestep-tests --example damaged_files -- 1000

#![allow(clippy::print_stdout, reason = "its output is what it is for")]

use lodestep_engine::event::{Event, TrackPoint};
use lodestep_engine::geo::Site;
use lodestep_engine::session::{Session, SessionConfig};
use lodestep_engine::sim::pedestrian::{SensorModel, Simulator, WalkKind};
use lodestep_engine::systems::pedestrian::{self, Side};
use lodestep_tests::damage::{DAMAGES, Draw, LogText};

/// What came of one walk.
enum Came {
    Refused(String),
    Read { lost_readable: bool, over_sigma: f64, told: bool },
}

fn main() -> anyhow::Result<()> {
    let walks: u64 = std::env::args().nth(1).map_or(Ok(100), |walks| walks.parse())?;
    let (mut read, mut refused, mut lost, mut over, mut denied) = (0_u64, 0_u64, 0_u64, 0_u64, 0_u64);
    for seed in 0..walks {
        let (kinds, came) = walk(seed)?;
        match came {
            Came::Refused(sentence) => {
                refused += 1;
                println!("{seed:5} refused {kinds:?}: {sentence}");
            }
            Came::Read { lost_readable, over_sigma, told } => {
                read += 1;
                lost += u64::from(lost_readable);
                over += u64::from(over_sigma > 5.0);
                denied += u64::from(over_sigma > 5.0 && !told);
                if lost_readable || over_sigma > 5.0 {
                    println!("{seed:5} lost {lost_readable} {over_sigma:.1} sigma, told {told} {kinds:?}");
                }
            }
        }
    }
    println!(
        "{walks} walks, {} kinds: {read} read, {refused} refused, {lost} lost what was readable, {over} over 5 sigma, {denied} of these without an anomaly",
        DAMAGES.len()
    );
    Ok(())
}

fn walk(seed: u64) -> anyhow::Result<(Vec<&'static str>, Came)> {
    let mut draw = Draw::new(seed);
    let site = Site::fast();
    let metres = 15.0 + 60.0 * draw.share();
    let mut simulator = Simulator::new(&WalkKind::Line { metres }, seed, &site, &SensorModel::cmp10a());
    let (mut samples, mut truth) = (Vec::new(), Vec::new());
    while let Some(epoch) = simulator.next_epoch() {
        samples.push(epoch.samples[0]);
        truth.push(epoch.truth[0]);
    }
    let mut log = LogText::of(&samples);
    let mut kinds = Vec::new();
    for _ in 0..1 + draw.below(3) {
        let damage = &DAMAGES[draw.below(DAMAGES.len())];
        (damage.harm)(&mut log, &mut draw);
        kinds.push(damage.name);
    }
    let rows = log.lines.len();
    let (read, told) = match log.read() {
        Ok(read) => read,
        Err(error) => return Ok((kinds, Came::Refused(error.to_string()))),
    };
    let lost_readable = read.len() + log.lost + 3 * kinds.len() < rows;
    let config = SessionConfig {
        initial_position_n_m: truth[0].position_n_m,
        initial_heading_rad: Some(truth[0].heading_rad),
        declination_rad: site.declination_deg.to_radians(),
        site_field: Some(site.field()),
        gravity_m_s2: site.gravity_m_s2,
        ..pedestrian::Config::default().session(&[Side::Left])
    };
    let (mut session, mut events) = (Session::new(config)?, Vec::new());
    for sample in &read {
        session.push(Side::Left, sample, &mut events);
    }
    session.finish(&mut events);
    let (mut last, mut anomalies): (Option<TrackPoint>, usize) = (None, told.len());
    for event in &events {
        match event {
            Event::Point(point) => last = Some(*point),
            Event::Revision { points } => {
                let newest = |point: &&TrackPoint| last.is_none_or(|last| point.t_ns >= last.t_ns);
                last = points.last().filter(newest).copied().or(last);
            }
            Event::Anomaly(_) => anomalies += 1,
            _ => {}
        }
    }
    let Some(last) = last else { return Ok((kinds, Came::Refused("no position".to_owned()))) };
    let end = truth[truth.len() - 1].position_n_m;
    let off_m = (last.position_n_m[0] - end[0]).hypot(last.position_n_m[1] - end[1]);
    let sigma_m = last.sigma_n_m[0].hypot(last.sigma_n_m[1]);
    Ok((kinds, Came::Read { lost_readable, over_sigma: off_m / sigma_m, told: anomalies > 0 }))
}
