//! Random choices that can be made again: every campaign prints its seed.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// A stream of random numbers (SplitMix64).
#[derive(Clone, Debug)]
pub struct Random {
    seed: u64,
    state: u64,
}

impl Random {
    /// The stream of the seed in `LODESTEP_FAULT_SEED`; without it of one from the clock, so that no two runs are
    /// alike.
    pub fn new() -> Random {
        let given = std::env::var("LODESTEP_FAULT_SEED").ok();
        let given = given.map(|text| text.parse().expect("LODESTEP_FAULT_SEED is a whole number"));
        let by_clock = || {
            let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
            now.as_nanos() as u64 ^ u64::from(std::process::id()) << 40
        };
        Random::of(given.unwrap_or_else(by_clock))
    }

    /// The stream of this seed.
    pub fn of(seed: u64) -> Random {
        Random { seed, state: seed }
    }

    /// What it was begun with.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// Any number.
    pub fn word(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// One of `0..end`.
    pub fn below(&mut self, end: u64) -> u64 {
        self.word() % end.max(1)
    }

    /// True this often in a hundred.
    pub fn percent(&mut self, share: u64) -> bool {
        self.below(100) < share
    }

    /// A time up to this one.
    pub fn within(&mut self, longest: Duration) -> Duration {
        longest.mul_f64((self.word() >> 11) as f64 / (1u64 << 53) as f64)
    }
}

impl Default for Random {
    fn default() -> Self {
        Random::new()
    }
}
