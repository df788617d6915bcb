//! A standing foot. It is not perfectly still: skin, shoe and balance let it roll by fractions of a
//! degree, the sole gives, and it does not stand up as it stood down.

use super::gait::{Foothold, rigid_foot};
use crate::sim::jet::Jet;
use crate::sim::motion::Kinematics;
use crate::sim::random::Random;

/// A smooth to and fro.
#[derive(Clone, Copy, Debug, Default)]
struct Sway {
    amplitude: f64,
    rate_rad_s: f64,
    phase: f64,
}

impl Sway {
    fn at(self, t_s: f64) -> Jet {
        let angle =
            Jet { value: self.phase + self.rate_rad_s * t_s, rate: self.rate_rad_s, acceleration: 0.0 };
        angle.sin_cos().0 * self.amplitude
    }
}

/// The small motion of one stance.
#[derive(Clone, Debug)]
struct MicroMotion {
    /// Yaw, pitch, roll, rad.
    angles: [Sway; 3],
    /// East, north, up, m.
    position: [Sway; 3],
}

/// A foot that stands from one time to another.
#[derive(Clone, Debug)]
pub(crate) struct Rest {
    pub(crate) from: Foothold,
    /// As it stands at the end.
    pub(crate) to: Foothold,
    pub(crate) t_from_s: f64,
    pub(crate) t_to_s: f64,
    micro: Option<Box<MicroMotion>>,
}

/// 1σ of the change of yaw, pitch and roll in the course of a stance, rad.
const SETTLING_RAD: [f64; 3] = [0.0010, 0.0040, 0.0035];
/// How long it takes the sole to give, s,
const SINKING_S: f64 = 0.15;
/// but at most this share of the stance.
const SINKING_SHARE: f64 = 0.45;
/// Longer stances are standing: slow sway of the whole body, rather than the roll of a step.
const STANDING_S: f64 = 1.5;

impl Rest {
    /// A foot that stands; `micro_motion` scales the small motion, and zero leaves it perfectly still but for
    /// the sole, which gives by `sole_m`.
    pub(crate) fn new(
        from: Foothold,
        (t_from_s, t_to_s): (f64, f64),
        micro_motion: f64,
        sole_m: f64,
        random: &mut Random,
    ) -> Rest {
        let duration_s = t_to_s - t_from_s;
        let standing = duration_s > STANDING_S;
        let (hz, angle_rad, position_m) =
            if standing { ((0.15, 1.2), 0.0007, 0.00025) } else { ((1.5, 5.0), 0.0018, 0.00020) };
        // Drawn even when not used: the streams do not depend on the setting.
        let mut sway = |amplitude: f64| Sway {
            amplitude: amplitude * micro_motion * random.uniform(0.4, 1.6),
            rate_rad_s: std::f64::consts::TAU * random.uniform(hz.0, hz.1),
            phase: random.uniform(0.0, std::f64::consts::TAU),
        };
        let angles = [0.5 * angle_rad, angle_rad, angle_rad].map(&mut sway);
        let position = [position_m; 3].map(&mut sway);
        let mut to = from;
        for (angle, sigma) in to.angles.iter_mut().zip(SETTLING_RAD) {
            *angle += sigma * micro_motion * random.normal();
        }
        to.origin_n_m.z -= sole_m;
        let micro = (micro_motion > 0.0).then(|| Box::new(MicroMotion { angles, position }));
        Rest { from, to, t_from_s, t_to_s, micro }
    }

    pub(crate) fn at(&self, t_s: f64) -> Kinematics {
        let origin = self.from.origin_n_m;
        let mut position = [origin.x, origin.y, origin.z].map(Jet::constant);
        let sinking_s = SINKING_S.min(SINKING_SHARE * (self.t_to_s - self.t_from_s));
        let sunk = Jet::progress(t_s, self.t_from_s, self.t_from_s + sinking_s).ramp();
        position[2] = position[2] + sunk * (self.to.origin_n_m.z - origin.z);
        let mut angles = self.from.angles.map(Jet::constant);
        if let Some(micro) = &self.micro {
            // In and out within a fifth of a second, or a third of a short stance.
            let edge_s = (0.2_f64).min((self.t_to_s - self.t_from_s) / 3.0);
            let window = Jet::progress(t_s, self.t_from_s, self.t_from_s + edge_s).ramp()
                * Jet::progress(t_s, self.t_to_s, self.t_to_s - edge_s).ramp();
            let settled = Jet::progress(t_s, self.t_from_s, self.t_to_s).ramp();
            for i in 0..3 {
                position[i] = position[i] + window * micro.position[i].at(t_s);
                angles[i] = angles[i]
                    + window * micro.angles[i].at(t_s)
                    + settled * (self.to.angles[i] - self.from.angles[i]);
            }
        }
        rigid_foot(position, Jet::default(), angles)
    }
}
