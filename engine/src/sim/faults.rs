//! Sensor trouble on purpose: what happens to a log between the sensor and the filter.

use super::random::{Purpose, Random};
use crate::sample::ImuSample;

/// One of a sample's triads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Angular rate.
    Gyro,
    /// Specific force.
    Accel,
    /// Magnetic field; a sample without it is left alone.
    Mag,
}

/// Something that goes wrong with one sensor's log. Times are those of the log, ns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// The clock runs fast (positive) or slow by parts per million, and is ahead by an offset.
    Clock {
        /// Drift, parts per million.
        ppm: f64,
        /// Offset at the start, ns.
        offset_ns: i64,
    },
    /// No samples from one time to before another.
    Dropout {
        /// First time that is missing, ns.
        from_ns: i64,
        /// First time that is there again, ns.
        to_ns: i64,
    },
    /// Single samples are lost at random.
    LostSamples {
        /// Share that is lost.
        share: f64,
    },
    /// A triad cannot show more than this.
    Saturation {
        /// Which triad.
        channel: Channel,
        /// The largest magnitude on an axis, in the triad's own unit.
        limit: f64,
    },
    /// An axis shows its last value from one time to before another.
    StuckAxis {
        /// Which triad.
        channel: Channel,
        /// 0, 1, 2 for x, y, z.
        axis: usize,
        /// From, ns.
        from_ns: i64,
        /// To, ns.
        to_ns: i64,
    },
    /// An axis shows something else from one time to before another: NaN, infinity, nonsense.
    Value {
        /// Which triad.
        channel: Channel,
        /// 0, 1, 2 for x, y, z.
        axis: usize,
        /// What it shows.
        value: f64,
        /// From, ns.
        from_ns: i64,
        /// To, ns.
        to_ns: i64,
    },
    /// A triad is off by a constant from one time to before another: a bias that jumps, iron nearby.
    Offset {
        /// Which triad.
        channel: Channel,
        /// By how much on each axis, in the triad's own unit.
        by: [f64; 3],
        /// From, ns.
        from_ns: i64,
        /// To, ns.
        to_ns: i64,
    },
    /// From this time on, every n-th sample bears the time of the one before.
    RepeatedTime {
        /// From, ns.
        from_ns: i64,
        /// Every how many samples.
        every: usize,
    },
    /// The first sample at or after this time bears an earlier time.
    BackwardTime {
        /// At, ns.
        at_ns: i64,
        /// By how much too early, ns.
        by_ns: i64,
    },
    /// The sensor turns where it is mounted at this time and stays so: half a turn about its z axis.
    HalfTurn {
        /// At, ns.
        at_ns: i64,
    },
    /// The magnetometer and the barometer are not in the log.
    InertialOnly,
}

fn triad(sample: &mut ImuSample, channel: Channel) -> Option<&mut [f64; 3]> {
    match channel {
        Channel::Gyro => Some(&mut sample.w_ib_b_rad_s),
        Channel::Accel => Some(&mut sample.f_b_m_s2),
        Channel::Mag => sample.mag_b_ut.as_mut(),
    }
}

/// Lets a fault happen to a log. `seed` matters only where samples are lost at random.
///
/// # Panics
///
/// When an axis is not 0, 1 or 2, or `every` is 0.
pub fn inject(log: &mut Vec<ImuSample>, fault: &Fault, seed: u64) {
    let within = |sample: &ImuSample, from_ns: i64, to_ns: i64| (from_ns..to_ns).contains(&sample.t_ns);
    match *fault {
        Fault::Clock { ppm, offset_ns } => {
            for sample in log {
                sample.t_ns += offset_ns + libm::round(sample.t_ns as f64 * ppm * 1e-6) as i64;
            }
        }
        Fault::Dropout { from_ns, to_ns } => log.retain(|sample| !within(sample, from_ns, to_ns)),
        Fault::LostSamples { share } => {
            let mut random = Random::new(seed, Random::COMMON, Purpose::Fault);
            log.retain(|_| random.uniform(0.0, 1.0) >= share);
        }
        Fault::Saturation { channel, limit } => {
            for triad in log.iter_mut().filter_map(|sample| triad(sample, channel)) {
                *triad = triad.map(|value| value.clamp(-limit, limit));
            }
        }
        Fault::StuckAxis { channel, axis, from_ns, to_ns } => {
            let mut last = None;
            for sample in log {
                let stuck = within(sample, from_ns, to_ns);
                let Some(triad) = triad(sample, channel) else { continue };
                match last {
                    Some(value) if stuck => triad[axis] = value,
                    _ => last = Some(triad[axis]),
                }
            }
        }
        Fault::Value { channel, axis, value, from_ns, to_ns } => {
            for sample in log.iter_mut().filter(|sample| within(sample, from_ns, to_ns)) {
                if let Some(triad) = triad(sample, channel) {
                    triad[axis] = value;
                }
            }
        }
        Fault::Offset { channel, by, from_ns, to_ns } => {
            for sample in log.iter_mut().filter(|sample| within(sample, from_ns, to_ns)) {
                if let Some(triad) = triad(sample, channel) {
                    *triad = std::array::from_fn(|axis| triad[axis] + by[axis]);
                }
            }
        }
        Fault::RepeatedTime { from_ns, every } => {
            let first = log.partition_point(|sample| sample.t_ns < from_ns).max(1);
            for index in (first..log.len()).step_by(every) {
                log[index].t_ns = log[index - 1].t_ns;
            }
        }
        Fault::BackwardTime { at_ns, by_ns } => {
            let at = log.partition_point(|sample| sample.t_ns < at_ns);
            if let Some(sample) = log.get_mut(at) {
                sample.t_ns -= by_ns;
            }
        }
        Fault::HalfTurn { at_ns } => {
            for sample in log.iter_mut().filter(|sample| sample.t_ns >= at_ns) {
                for channel in [Channel::Gyro, Channel::Accel, Channel::Mag] {
                    if let Some([x, y, _]) = triad(sample, channel) {
                        (*x, *y) = (-*x, -*y);
                    }
                }
            }
        }
        Fault::InertialOnly => {
            for sample in log {
                sample.mag_b_ut = None;
                sample.pressure_hpa = None;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_NS: i64 = 10_000_000;

    /// Half a minute in which every axis goes up and down at a pace of its own.
    fn log() -> Vec<ImuSample> {
        (0..3000)
            .map(|k| {
                let swings =
                    |per_sample: f64| [1.0, 1.3, 1.7].map(|pace| libm::sin(f64::from(k) * per_sample * pace));
                ImuSample {
                    t_ns: i64::from(k) * PERIOD_NS,
                    w_ib_b_rad_s: swings(0.05),
                    f_b_m_s2: swings(0.07).map(|swing| 20.0 * swing),
                    mag_b_ut: Some(swings(0.01).map(|swing| 50.0 * swing)),
                    pressure_hpa: Some(900.0),
                }
            })
            .collect()
    }

    fn with(fault: Fault) -> Vec<ImuSample> {
        let mut log = log();
        inject(&mut log, &fault, 1);
        log
    }

    #[test]
    fn clocks_drift() {
        let log = with(Fault::Clock { ppm: 100.0, offset_ns: 5_000 });
        assert_eq!(log[0].t_ns, 5_000);
        assert_eq!(log[1000].t_ns, 10_000_000_000 + 1_000_000 + 5_000);
    }

    #[test]
    fn samples_go_missing() {
        let whole = log().len();
        let log = with(Fault::Dropout { from_ns: 100 * PERIOD_NS, to_ns: 150 * PERIOD_NS });
        assert_eq!(log.len(), whole - 50);
        assert_eq!(log[100].t_ns, 150 * PERIOD_NS);
        let kept = with(Fault::LostSamples { share: 0.1 }).len() as f64 / whole as f64;
        assert!((kept - 0.9).abs() < 0.03, "{kept}");
    }

    #[test]
    fn readings_saturate_stick_jump_and_break() {
        let (from_ns, to_ns) = (1300 * PERIOD_NS, 1400 * PERIOD_NS);
        let saturated = with(Fault::Saturation { channel: Channel::Accel, limit: 15.0 });
        assert!(saturated.iter().flat_map(|s| s.f_b_m_s2).all(|v| v.abs() <= 15.0));
        assert!(saturated.iter().flat_map(|s| s.f_b_m_s2).any(|v| v.abs() == 15.0));

        let stuck = with(Fault::StuckAxis { channel: Channel::Gyro, axis: 1, from_ns, to_ns });
        assert!((1300..1400).all(|i| stuck[i].w_ib_b_rad_s[1] == stuck[1299].w_ib_b_rad_s[1]));
        assert_ne!(stuck[1400].w_ib_b_rad_s[1], stuck[1399].w_ib_b_rad_s[1]);

        let broken = with(Fault::Value { channel: Channel::Mag, axis: 2, value: f64::NAN, from_ns, to_ns });
        let count = broken.iter().filter(|s| s.mag_b_ut.unwrap()[2].is_nan()).count();
        assert_eq!(count, 100);

        let jumped = with(Fault::Offset { channel: Channel::Gyro, by: [0.1, 0.0, 0.0], from_ns, to_ns });
        let clean = log();
        assert_eq!(jumped[1299], clean[1299]);
        assert!((jumped[1300].w_ib_b_rad_s[0] - clean[1300].w_ib_b_rad_s[0] - 0.1).abs() < 1e-12);
    }

    #[test]
    fn times_repeat_and_go_back() {
        let repeated = with(Fault::RepeatedTime { from_ns: 0, every: 4 });
        let equal = repeated.windows(2).filter(|w| w[0].t_ns == w[1].t_ns).count();
        assert_eq!(equal, repeated.len().div_ceil(4) - usize::from(repeated.len() % 4 == 1));
        let backward = with(Fault::BackwardTime { at_ns: 50 * PERIOD_NS, by_ns: 3 * PERIOD_NS });
        assert_eq!(backward.windows(2).filter(|w| w[1].t_ns < w[0].t_ns).count(), 1);
        assert_eq!(backward[50].t_ns, 47 * PERIOD_NS);
    }

    #[test]
    fn sensors_turn_and_lose_their_extras() {
        let clean = log();
        let turned = with(Fault::HalfTurn { at_ns: 10 * PERIOD_NS });
        assert_eq!(turned[9], clean[9]);
        assert_eq!(turned[10].f_b_m_s2[0], -clean[10].f_b_m_s2[0]);
        assert_eq!(turned[10].f_b_m_s2[2], clean[10].f_b_m_s2[2]);
        let bare = with(Fault::InertialOnly);
        assert!(bare.iter().all(|s| s.mag_b_ut.is_none() && s.pressure_hpa.is_none()));
    }
}
