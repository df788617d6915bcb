//! The log of one foot to a track: `cargo run --features parse --example log_to_track -- left.csv > track.csv`.

use std::env::args;
use std::error::Error;
use std::io;

use lodestep_engine::parse::{LogReader, ReadOptions};
use lodestep_engine::systems::pedestrian::{Config, DECLARATION, Side};
use lodestep_engine::{Session, Solution, Track, track};

fn main() -> Result<(), Box<dyn Error>> {
    let path = args().nth(1).ok_or("expected the log of the left foot: log_to_track left.csv")?;
    #[expect(clippy::disallowed_methods, reason = "the engine opens no file, those who use it do")]
    let log = std::fs::read(path)?;
    track::csv::write(&DECLARATION, &track_of(&log)?.points, &mut io::stdout().lock())?;
    Ok(())
}

/// The smoothed track of a log of the left foot.
fn track_of(log: &[u8]) -> Result<Track, Box<dyn Error>> {
    let mut samples = Vec::new();
    let mut reader = LogReader::new(ReadOptions::default());
    reader.push(log, &mut samples)?;
    reader.finish(&mut samples)?;

    let mut config = Config::default().session(&[Side::Left]);
    config.solution = Solution::Smoothed;
    let mut session = Session::new(config)?;
    let (mut events, mut track) = (Vec::new(), Track::default());
    for sample in &samples {
        session.push(Side::Left, sample, &mut events);
    }
    session.finish(&mut events);
    events.into_iter().for_each(|event| track.take(event));
    Ok(track)
}

#[cfg(test)]
mod tests {
    use lodestep_engine::Site;
    use lodestep_engine::parse::imu_csv;
    use lodestep_engine::sim::pedestrian::{SensorModel, WalkKind, simulate};

    #[test]
    fn a_log_of_forty_metres_becomes_a_track_of_forty_metres() {
        let walk = simulate(&WalkKind::Line { metres: 40.0 }, 1, &Site::fast(), &SensorModel::perfect());
        let mut log = String::new();
        imu_csv::write(&walk.left, true, &mut log);
        let track = super::track_of(log.as_bytes()).unwrap();
        let [first, last] = [track.points.first().unwrap(), track.points.last().unwrap()];
        let [east_m, north_m] = [0, 1].map(|axis| last.position_n_m[axis] - first.position_n_m[axis]);
        assert!((east_m.hypot(north_m) - 40.0).abs() < 0.5, "{east_m} east, {north_m} north");
    }
}
