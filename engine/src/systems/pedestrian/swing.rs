//! Where in a swing the swinging foot passes the standing one.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// So much further than at the nearest, and the foot has passed, m² (0.2 m from beside the other).
const PASSED_SQUARED_M2: f64 = 0.04;
/// Feet that are so much further from each other than at the nearest are not beside each other, m².
const APART_SQUARED_M2: f64 = 0.03;
/// A swing is shorter than this where feet only shuffle, m.
const SHORTEST_SWING_M: f64 = 0.4;
/// A foot that passes is at least so fast, m/s: only then the direction across it means something.
const SLOWEST_PASSING_M_S: f64 = 0.8;

/// What following a swing shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Following {
    /// Nothing to do.
    Nothing,
    /// The foot has never been nearer to the other in this swing, and begins to move away.
    Nearest,
    /// The foot has passed the other: the nearest moment is known for good.
    Passed,
}

/// The swing of one foot, as far as it has come.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Swing {
    /// Where it began, n, m.
    start_p_n: Vector3<f64>,
    /// When it began, ns; `None` before the first.
    begun_ns: Option<i64>,
    /// Square of the smallest horizontal distance to the other foot so far, m²; infinite before the
    /// first.
    smallest_squared_m2: f64,
    /// Square of the first horizontal distance to the other foot, m².
    first_squared_m2: f64,
    /// Velocity of this foot then, n, m/s.
    velocity_then_n: Vector3<f64>,
    under_way: bool,
    departing: bool,
}

impl Swing {
    /// The foot has left the ground at `p_n` at the time `t_ns`.
    pub fn begin(&mut self, p_n: &Vector3<f64>, t_ns: i64) {
        *self = Swing {
            start_p_n: *p_n,
            begun_ns: Some(t_ns),
            smallest_squared_m2: f64::INFINITY,
            first_squared_m2: f64::NAN,
            velocity_then_n: Vector3::zeros(),
            under_way: true,
            departing: true,
        };
    }

    /// The foot is at `p_n` in its swing, with the velocity `v_n`, while the other stands at
    /// `other_p_n`.
    ///
    /// The nearest moment is the sample at which the distance begins to grow, which is within one
    /// sample of the true one; across the swing, nothing moves in that time.
    #[inline]
    pub fn follow(&mut self, p_n: &Vector3<f64>, v_n: &Vector3<f64>, other_p_n: &Vector3<f64>) -> Following {
        if !self.under_way {
            return Following::Nothing;
        }
        let (east, north) = (p_n.x - other_p_n.x, p_n.y - other_p_n.y);
        let squared = east * east + north * north;
        if self.first_squared_m2.is_nan() {
            self.first_squared_m2 = squared;
        }
        let departs = east * v_n.x + north * v_n.y >= 0.0;
        let began_to_depart = departs && !self.departing;
        self.departing = departs;
        if began_to_depart
            && squared < self.smallest_squared_m2
            && self.first_squared_m2 > squared + APART_SQUARED_M2
        {
            self.smallest_squared_m2 = squared;
            self.velocity_then_n = *v_n;
            return Following::Nearest;
        }
        let stride = (p_n - self.start_p_n).xy().norm_squared() > SHORTEST_SWING_M * SHORTEST_SWING_M;
        if stride && squared > self.smallest_squared_m2 + PASSED_SQUARED_M2 {
            return self.conclude(p_n);
        }
        Following::Nothing
    }

    /// The foot has come down at `p_n`, the other is at `other_p_n`: on stairs and in short steps it
    /// is not far beyond the other, and still has passed it.
    pub fn end(&mut self, p_n: &Vector3<f64>, other_p_n: &Vector3<f64>) -> Following {
        let squared = (p_n - other_p_n).xy().norm_squared();
        let beyond = squared > self.smallest_squared_m2 + APART_SQUARED_M2;
        if !self.under_way || !beyond {
            return Following::Nothing;
        }
        self.conclude(p_n)
    }

    /// Whether the swing, now at `p_n`, was one whose direction means something.
    fn conclude(&mut self, p_n: &Vector3<f64>) -> Following {
        self.under_way = false;
        let travelled_m = (p_n - self.start_p_n).xy().norm();
        let fast = self.velocity_then_n.xy().norm() > SLOWEST_PASSING_M_S;
        if fast && travelled_m > SHORTEST_SWING_M { Following::Passed } else { Following::Nothing }
    }

    /// Turns it about the vertical through `about_n`.
    pub fn turn(&mut self, r: &Matrix3<f64>, about_n: &Vector3<f64>) {
        self.start_p_n = about_n + r * (self.start_p_n - about_n);
        self.velocity_then_n = r * self.velocity_then_n;
    }

    /// Moves it.
    pub fn shift(&mut self, by_n: &Vector3<f64>) {
        self.start_p_n += by_n;
    }

    /// Whether there has been a swing at all.
    pub fn has_begun(&self) -> bool {
        self.begun_ns.is_some()
    }

    /// When the foot left the ground, ns.
    pub fn begun_ns(&self) -> i64 {
        self.begun_ns.unwrap_or(i64::MIN / 2)
    }

    /// Where the foot left the ground, n, m.
    pub fn start_p_n(&self) -> &Vector3<f64> {
        &self.start_p_n
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn swing_past(other: Vector3<f64>) -> (bool, f64) {
        let mut swing = Swing::default();
        swing.begin(&Vector3::zeros(), 0);
        let velocity = Vector3::new(3.0, 0.0, 0.0);
        let (mut nearest_east, mut passed) = (f64::NAN, false);
        for k in 0..=40 {
            let p = Vector3::new(1.3 * f64::from(k) / 40.0, 0.0, 0.0);
            match swing.follow(&p, &velocity, &other) {
                Following::Nearest => nearest_east = p.x,
                Following::Passed => passed = true,
                Following::Nothing => {}
            }
        }
        (passed, nearest_east)
    }

    #[test]
    fn a_stride_past_the_standing_foot_is_found_at_its_nearest_point() {
        let (passed, east) = swing_past(Vector3::new(0.535, -0.12, 0.0));
        assert!(passed && (east - 0.535).abs() < 0.04, "{passed} {east}");
    }

    #[test]
    fn a_short_step_has_passed_when_the_foot_comes_down() {
        let other = Vector3::new(0.35, -0.12, 0.0);
        let mut swing = Swing::default();
        swing.begin(&Vector3::zeros(), 0);
        for k in 0..=20 {
            let p = Vector3::new(0.53 * f64::from(k) / 20.0, 0.0, 0.0);
            assert_ne!(swing.follow(&p, &Vector3::new(2.0, 0.0, 0.0), &other), Following::Passed);
        }
        assert_eq!(swing.end(&Vector3::new(0.53, 0.0, 0.0), &other), Following::Passed);
    }

    #[test]
    fn a_step_up_to_the_standing_foot_does_not_pass_it() {
        assert!(!swing_past(Vector3::new(1.3, -0.12, 0.0)).0);
    }
}
