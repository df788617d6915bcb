//! A simulated run through the cabin's system, and its errors against the truth.

use std::collections::HashMap;

use lodestep_engine::rotation::wrap;
use lodestep_engine::sample::ImuSample;
use lodestep_engine::sim::cabin::SimulatedRun;
use lodestep_engine::systems::cabin::rows::{AidRow, AntennaRow, EncoderRow, ImuRow, RayRow};
use lodestep_engine::systems::cabin::{
    CabinAnomaly, CabinConfig, CabinError, CabinSession, Estimator, Instrument, Poses, Row,
};

/// What is read, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Read {
    pub(crate) stations: bool,
    pub(crate) encoders: bool,
    pub(crate) platform_imu: bool,
    pub(crate) smoothed: bool,
    pub(crate) paper: bool,
    /// Rows after this are not there, ns.
    pub(crate) until_ns: i64,
}

impl Default for Read {
    fn default() -> Read {
        Read {
            stations: true,
            encoders: true,
            platform_imu: false,
            smoothed: false,
            paper: false,
            until_ns: i64::MAX,
        }
    }
}

/// What came out.
#[derive(Debug)]
pub(crate) struct Found {
    pub(crate) poses: Poses,
    pub(crate) anomalies: Vec<CabinAnomaly>,
    /// What was told while the run went on, and at which tag, s.
    pub(crate) told: Vec<(f64, CabinAnomaly)>,
}

enum Event {
    Imu(ImuRow),
    PlatformImu(ImuRow),
    Aid(AidRow),
}

impl Event {
    fn t_ns(&self) -> i64 {
        match self {
            Event::Imu(row) | Event::PlatformImu(row) => row.t_ns,
            Event::Aid(row) => row.t_ns(),
        }
    }
}

/// Runs a session over a run.
pub(crate) fn process(run: &SimulatedRun, read: &Read) -> Result<Found, CabinError> {
    let instrument =
        Instrument::from_toml(&run.instrument).expect("the simulator writes an instrument that is read");
    let sample =
        |sample: &ImuSample| ImuRow { t_ns: sample.t_ns, w_s: sample.w_ib_b_rad_s, f_s: sample.f_b_m_s2 };
    let mut events: Vec<Event> = run.imu.iter().map(|s| Event::Imu(sample(s))).collect();
    if read.platform_imu {
        events.extend(run.platform_imu.iter().map(|s| Event::PlatformImu(sample(s))));
    }
    if read.encoders {
        events.extend(run.encoders.iter().map(|row| {
            let [a_rad, b_rad] = row.angles_rad;
            Event::Aid(AidRow::Encoders(EncoderRow { t_ns: row.t_ns, a_rad, b_rad, legs_m: row.legs_m }))
        }));
    }
    events.extend(run.antennas.iter().map(|row| {
        Event::Aid(AidRow::Antenna(AntennaRow {
            t_ns: row.t_ns,
            antenna: row.antenna,
            position_n: row.position_n_m,
            sigma_n: row.sigma_n_m,
            quality: row.quality,
            velocity_n: Some(row.velocity_n_m_s),
        }))
    }));
    if read.stations {
        events.extend(run.stations.iter().map(|ray| {
            Event::Aid(AidRow::Ray(RayRow {
                t_ns: ray.t_ns,
                station: ray.station,
                target: ray.target,
                azimuth_rad: ray.azimuth_rad,
                zenith_rad: ray.zenith_rad,
                slant_m: ray.slant_m,
            }))
        }));
    }
    events.retain(|event| event.t_ns() <= read.until_ns);
    events.sort_by_key(Event::t_ns);
    let config = CabinConfig {
        estimator: if read.paper { Estimator::Paper } else { Estimator::Own },
        smoothed: read.smoothed,
        rate_hz: 20.0,
        has_stations: read.stations,
        has_encoders: read.encoders,
        has_platform_imu: read.platform_imu,
        platform: read.stations || read.encoders,
    };
    let mut session = CabinSession::new(&instrument, config)?;
    let (mut poses, mut told) = (Poses::default(), Vec::new());
    for event in &events {
        match event {
            Event::Imu(row) => session.push_imu(row, &mut poses)?,
            Event::PlatformImu(row) => session.push_platform_imu(row, &mut poses)?,
            Event::Aid(row) => session.push_aid(row, &mut poses)?,
        }
        told.extend(session.fresh_anomalies().into_iter().map(|found| (event.t_ns() as f64 * 1e-9, found)));
    }
    let anomalies = session.finish(&mut poses)?;
    Ok(Found { poses, anomalies, told })
}

/// Errors of one row: east, north, up (m), yaw, pitch, roll (rad).
pub(crate) type Errors = [f64; 6];

/// The errors of rows between two times, s, with the rows.
pub(crate) fn errors<'a>(
    run: &SimulatedRun,
    rows: &'a [Row],
    platform: bool,
    from_s: f64,
    to_s: f64,
) -> Vec<(Errors, &'a Row)> {
    let truth: HashMap<i64, &[f64; 6]> = (run.truth.iter())
        .map(|truth| (truth.t_ns, if platform { &truth.platform } else { &truth.cabin }))
        .collect();
    let within = |row: &&Row| (from_s..to_s).contains(&(row.t_ns as f64 * 1e-9));
    (rows.iter().filter(within))
        .filter_map(|row| {
            let truth = truth.get(&row.t_ns)?;
            let angles = row.angles();
            let errors = [
                row.p_n.x - truth[0],
                row.p_n.y - truth[1],
                row.p_n.z - truth[2],
                wrap(angles.heading_rad - truth[3]),
                angles.pitch_rad - truth[4],
                wrap(angles.roll_rad - truth[5]),
            ];
            Some((errors, row))
        })
        .collect()
}

/// Mean, scatter about it and root mean square of each error.
pub(crate) fn spread(errors: &[(Errors, &Row)]) -> [[f64; 3]; 6] {
    let count = errors.len().max(1) as f64;
    std::array::from_fn(|k| {
        let mean = errors.iter().map(|(e, _)| e[k]).sum::<f64>() / count;
        let square = errors.iter().map(|(e, _)| e[k] * e[k]).sum::<f64>() / count;
        [mean, (square - mean * mean).max(0.0).sqrt(), square.sqrt()]
    })
}
