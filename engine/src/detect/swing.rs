//! Where in a swing the swinging foot passes the standing one.

use nalgebra::Vector3;

/// The swing of one foot, as far as it has come.
#[derive(Clone, Debug, Default)]
pub struct Swing {
    /// Where it began, n, m.
    start_p_n: Vector3<f64>,
    /// Square of the smallest horizontal distance to the other foot so far, m²; infinite before the
    /// first.
    smallest_squared_m2: f64,
    /// Square of the first horizontal distance to the other foot, m².
    first_squared_m2: f64,
    /// Velocity of this foot then, n, m/s.
    velocity_then_n: Vector3<f64>,
    under_way: bool,
    used: bool,
}

impl Swing {
    /// The foot has left the ground at `p_n`.
    pub fn begin(&mut self, p_n: &Vector3<f64>) {
        *self = Swing {
            start_p_n: *p_n,
            smallest_squared_m2: f64::INFINITY,
            first_squared_m2: f64::NAN,
            velocity_then_n: Vector3::zeros(),
            under_way: true,
            used: false,
        };
    }

    /// The foot is at `p_n` in its swing while the other stands at `other_p_n`. Says whether it has
    /// never been nearer in this swing.
    #[inline]
    pub fn follow(&mut self, p_n: &Vector3<f64>, v_n: &Vector3<f64>, other_p_n: &Vector3<f64>) -> bool {
        if !self.under_way || self.used {
            return false;
        }
        let (east, north) = (p_n.x - other_p_n.x, p_n.y - other_p_n.y);
        let squared = east * east + north * north;
        if self.first_squared_m2.is_nan() {
            self.first_squared_m2 = squared;
        }
        if squared < self.smallest_squared_m2 {
            self.smallest_squared_m2 = squared;
            self.velocity_then_n = *v_n;
            return true;
        }
        false
    }

    /// The foot has come down at `p_n`, the other stands at `other_p_n`. Says whether the swing
    /// passed the other foot: long enough, with the nearest moment inside the swing and well in
    /// motion, so that the direction across it means something.
    pub fn end(&mut self, p_n: &Vector3<f64>, other_p_n: &Vector3<f64>) -> bool {
        let passed = self.under_way && !self.used && {
            let travelled = (p_n - self.start_p_n).xy().norm();
            let last_squared = (p_n - other_p_n).xy().norm_squared();
            let clear = self.smallest_squared_m2 + 0.03;
            travelled > 0.5
                && self.velocity_then_n.xy().norm() > 0.8
                && self.first_squared_m2 > clear
                && last_squared > clear
        };
        self.under_way = false;
        passed
    }

    /// The moment of the smallest distance has been used: this swing asks for no more.
    pub fn mark_used(&mut self) {
        self.used = true;
    }

    /// Velocity of the swinging foot at the smallest distance, n, m/s.
    pub fn velocity_then_n(&self) -> &Vector3<f64> {
        &self.velocity_then_n
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn swing_past(other: Vector3<f64>) -> (bool, f64) {
        let mut swing = Swing::default();
        swing.begin(&Vector3::zeros());
        let velocity = Vector3::new(3.0, 0.0, 0.0);
        let mut nearest_east = f64::NAN;
        for k in 0..=40 {
            let p = Vector3::new(1.3 * f64::from(k) / 40.0, 0.0, 0.0);
            if swing.follow(&p, &velocity, &other) {
                nearest_east = p.x;
            }
        }
        (swing.end(&Vector3::new(1.3, 0.0, 0.0), &other), nearest_east)
    }

    #[test]
    fn a_stride_past_the_standing_foot_is_found_at_its_nearest_point() {
        let (passed, east) = swing_past(Vector3::new(0.65, -0.12, 0.0));
        assert!(passed && (east - 0.65).abs() < 0.02);
    }

    #[test]
    fn a_step_up_to_the_standing_foot_does_not_pass_it() {
        assert!(!swing_past(Vector3::new(1.3, -0.12, 0.0)).0);
    }
}
