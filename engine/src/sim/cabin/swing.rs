//! How a cabin swings on its cables: a few modes near 0.2 Hz, each of two neighbouring frequencies so that it swells and dies
//! down as in wind, and a faster tremble.

use super::super::jet::Jet;
use super::super::random::Random;

/// Sines of one coordinate.
#[derive(Clone, Debug)]
pub(super) struct Swing(Vec<Sine>);

#[derive(Clone, Copy, Debug)]
struct Sine {
    amplitude: f64,
    rate_rad_s: f64,
    phase_rad: f64,
}

impl Swing {
    /// A swing whose slow modes have about this root mean square together.
    pub(super) fn drawn(rms: f64, random: &mut Random) -> Swing {
        let mut sines = Vec::new();
        for (hz, share) in [
            (random.uniform(0.12, 0.2), 0.85),
            (random.uniform(0.2, 0.32), 0.45),
            (random.uniform(0.6, 1.0), 0.05),
        ] {
            for side in [1.0, 1.0 + random.uniform(0.03, 0.08)] {
                sines.push(Sine {
                    amplitude: rms * share * random.uniform(0.7, 1.3),
                    rate_rad_s: std::f64::consts::TAU * hz * side,
                    phase_rad: random.uniform(0.0, std::f64::consts::TAU),
                });
            }
        }
        Swing(sines)
    }

    pub(super) fn at(&self, t_s: f64) -> Jet {
        self.0.iter().fold(Jet::default(), |sum, sine| {
            let angle = Jet::time(t_s) * sine.rate_rad_s + Jet::constant(sine.phase_rad);
            sum + angle.sin_cos().0 * sine.amplitude
        })
    }
}
