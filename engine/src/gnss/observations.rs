//! What a receiver observed, epoch by epoch.

use super::satellite::Satellite;
use super::time::GpsTime;

/// One signal of a satellite at one epoch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signal {
    /// The band, as RINEX 3 numbers it.
    pub band: u8,
    /// The way of tracking, as RINEX 3 spells it.
    pub attribute: u8,
    /// Pseudorange, m; 0 where there is none.
    pub code_m: f64,
    /// Carrier phase, cycles; 0 where there is none.
    pub phase_cycles: f64,
    /// Signal strength, dB·Hz; 0 where there is none.
    pub strength_db_hz: f32,
    /// Lock was lost since the epoch before.
    pub lost_lock: bool,
    /// The phase may be off by half a cycle now.
    pub half_cycle: bool,
}

/// The signals of one satellite: a part of [`Epoch::signals`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tracked {
    /// The satellite.
    pub satellite: Satellite,
    /// Its first signal.
    pub first: u32,
    /// One beyond its last signal.
    pub end: u32,
}

/// All that was observed at one time tag.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Epoch {
    /// The time tag by the receiver's clock.
    pub time: GpsTime,
    /// The receiver had no power since the epoch before.
    pub power_failure: bool,
    /// The satellites, none twice.
    pub satellites: Vec<Tracked>,
    /// Their signals.
    pub signals: Vec<Signal>,
}

impl Epoch {
    /// The signals of one of its satellites.
    pub fn signals_of(&self, tracked: &Tracked) -> &[Signal] {
        &self.signals[tracked.first as usize..tracked.end as usize]
    }
}

/// A file of observations.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Observations {
    /// Position of the marker, Earth-centred, m, where the header has one.
    pub approximate_position_m: Option<[f64; 3]>,
    /// The antenna above, east and north of the marker, m.
    pub antenna_delta_hen_m: [f64; 3],
    /// The epochs, in order of time, no time twice.
    pub epochs: Vec<Epoch>,
    /// What was passed over, a sentence each.
    pub notes: Vec<String>,
}

impl Observations {
    /// The usual time between epochs, s: the median; none of fewer than two epochs.
    pub fn interval_s(&self) -> Option<f64> {
        let mut steps: Vec<i64> =
            self.epochs.windows(2).map(|pair| pair[1].time.ns - pair[0].time.ns).collect();
        steps.sort_unstable();
        steps.get(steps.len() / 2).map(|ns| *ns as f64 * 1e-9)
    }

    /// Whether some satellite has phases on two bands.
    pub fn has_two_bands(&self) -> bool {
        self.epochs.iter().take(50).any(|epoch| {
            epoch.satellites.iter().any(|tracked| {
                let mut with_phase =
                    epoch.signals_of(tracked).iter().filter(|signal| signal.phase_cycles != 0.0);
                with_phase.next().is_some_and(|first| with_phase.any(|other| other.band != first.band))
            })
        })
    }
}
