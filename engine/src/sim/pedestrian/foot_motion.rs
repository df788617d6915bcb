//! The motion of one foot: stance and swing in turns, without a gap.

use super::plan::Phase;
use crate::sim::motion::{Kinematics, Motion};

/// One foot's whole walk. Its frame, the b of [`Motion`], is the foot's f with the origin where the sensor sits.
#[derive(Clone, Debug)]
pub(crate) struct FootMotion {
    pub(super) phases: Vec<Phase>,
    /// When each phase ends, s.
    ends_s: Vec<f64>,
}

impl FootMotion {
    pub(crate) fn new(phases: Vec<Phase>) -> FootMotion {
        FootMotion { ends_s: phases.iter().map(Phase::t_to_s).collect(), phases }
    }

    /// Whether the foot stands flat on the ground.
    pub(crate) fn is_stance(&self, t_s: f64) -> bool {
        self.phases[self.number_at(t_s)].is_stance()
    }

    /// The number of the phase in which a time lies; the last one after the end.
    fn number_at(&self, t_s: f64) -> usize {
        self.ends_s.partition_point(|end_s| *end_s <= t_s).min(self.phases.len() - 1)
    }
}

impl Motion for FootMotion {
    fn at(&self, t_s: f64) -> Kinematics {
        self.phases[self.number_at(t_s)].at(t_s)
    }

    fn end_s(&self) -> f64 {
        self.ends_s[self.ends_s.len() - 1]
    }

    /// A standing foot moves slowly.
    fn is_slow(&self, from_s: f64, to_s: f64) -> bool {
        let number = self.number_at(to_s);
        self.phases[number].is_stance() && self.number_at(from_s) == number
    }
}
