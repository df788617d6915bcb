//! Random streams: one for each (seed, stream, purpose), so that a change of one draw moves nothing else.

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;

/// What a stream is for. Its number goes into the stream: new purposes come last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    Course = 1,
    Timing,
    Gait,
    MicroMotion,
    Calibration,
    GyroNoise,
    AccelNoise,
    MagneticNoise,
    BarometerNoise,
    BiasWalk,
    MagneticAnomalies,
    Weather,
    Fault,
    WhiteNoise,
    Pauses,
    FixNoise,
    FixSlowError,
    RoverSky,
    RoverWorld,
    RoverReceiver,
    RoverTag,
    Survey,
    StationNoise,
    StationSlowError,
    EncoderNoise,
    PoleWorld,
}

/// A stream of random numbers.
#[derive(Clone, Debug)]
pub(crate) struct Random(Pcg64Mcg);

impl Random {
    /// The stream of what all sensors of a carrier share.
    pub(crate) const COMMON: usize = 2;

    /// The stream of a seed for a purpose; sensors of one kind have streams of their own: 0, 1, and from 3 to 15.
    pub(crate) fn new(seed: u64, stream: usize, purpose: Purpose) -> Random {
        let word = mix(seed ^ mix(((stream as u64) << 32) | purpose as u64));
        Random(Pcg64Mcg::new((u128::from(mix(word)) << 64) | u128::from(word)))
    }

    /// Standard normal.
    pub(crate) fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// Three standard normals.
    pub(crate) fn normal_3(&mut self) -> [f64; 3] {
        [self.normal(), self.normal(), self.normal()]
    }

    /// Uniform between two numbers.
    pub(crate) fn uniform(&mut self, from: f64, to: f64) -> f64 {
        const STEP: f64 = 1.0 / (1u64 << 53) as f64;
        from + (to - from) * ((self.0.next_u64() >> 11) as f64 * STEP)
    }
}

/// Independent standard normals, the same for the same seed: for noise that belongs to no sensor.
pub fn white_noise(seed: u64) -> impl FnMut() -> f64 {
    let mut random = Random::new(seed, Random::COMMON, Purpose::WhiteNoise);
    move || random.normal()
}

/// The finalizer of SplitMix64: neighbouring seeds give unrelated streams.
fn mix(word: u64) -> u64 {
    let mut z = word.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_repeat_and_do_not_resemble_each_other() {
        let draws = |seed, stream, purpose| {
            let mut random = Random::new(seed, stream, purpose);
            (0..2000).map(|_| random.normal()).collect::<Vec<f64>>()
        };
        let a = draws(1, 0, Purpose::GyroNoise);
        assert_eq!(a, draws(1, 0, Purpose::GyroNoise));
        for b in [
            draws(2, 0, Purpose::GyroNoise),
            draws(1, 1, Purpose::GyroNoise),
            draws(1, 0, Purpose::AccelNoise),
        ] {
            let correlation = a.iter().zip(&b).map(|(x, y)| x * y).sum::<f64>() / 2000.0;
            assert!(correlation.abs() < 0.1, "{correlation}");
        }
        let variance = a.iter().map(|x| x * x).sum::<f64>() / 2000.0;
        assert!((variance - 1.0).abs() < 0.15, "{variance}");
    }
}
