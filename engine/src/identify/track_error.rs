//! How far a track is off, and how that grows from stand to stand: position, heading and length.
//!
//! The filter's own covariance says how sure one place is, not what two places have in common; so the
//! error between stands has a small model of its own, whose figures were measured (`tuning`).

use nalgebra::{SMatrix, SVector, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::tuning::IdentificationTuning;

/// Position (e, n, u), heading (clockwise), length as a share: each estimated − true.
const STATES: usize = 5;
const HEADING: usize = 3;
const SCALE: usize = 4;

/// A heading is unknown where its sigma, or what a visit turns it by, is beyond this, rad.
const UNKNOWN_RAD: f64 = 0.5;
/// How sure it is when markers have just told it, rad.
const JUST_TURNED_RAD: f64 = 0.1;

/// The error of a track as a Gaussian.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TrackError {
    pub(super) mean: SVector<f64, STATES>,
    pub(super) covariance: SMatrix<f64, STATES, STATES>,
}

/// A stretch of the track between two corrections or stands, and the correction at its end.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Stretch {
    /// From its beginning to its end as the track has it, m.
    pub(super) displacement_n_m: Vector3<f64>,
    /// How far was walked, m.
    pub(super) length_m: f64,
    /// What the filter says of the heading at the end, rad.
    pub(super) heading_sigma_rad: f64,
    /// By how much a visit has moved the track at the end of it, m.
    pub(super) jump_n_m: Vector3<f64>,
    /// And turned it, clockwise, rad.
    pub(super) jump_heading_rad: f64,
}

impl TrackError {
    /// At the start of a session.
    pub(super) fn at_start(tuning: &IdentificationTuning) -> TrackError {
        let sigmas = SVector::from([
            tuning.start_sigma_m,
            tuning.start_sigma_m,
            tuning.start_sigma_m,
            tuning.inflation * tuning.heading_sigma_rad,
            tuning.inflation * tuning.scale_sigma,
        ]);
        TrackError {
            mean: SVector::zeros(),
            covariance: SMatrix::from_diagonal(&sigmas.component_mul(&sigmas)),
        }
    }

    /// After another stretch.
    pub(super) fn walk(&mut self, stretch: &Stretch, tuning: &IdentificationTuning) {
        let d = stretch.displacement_n_m;
        let length_m = stretch.length_m.max(d.xy().norm());
        let sigma = |sigma: f64| tuning.inflation * sigma;
        let heading_sigma = sigma(tuning.heading_sigma_rad).max(stretch.heading_sigma_rad);
        let scale_sigma = sigma(tuning.scale_sigma);
        let heading_kept = libm::exp(-length_m / tuning.heading_length_m);
        let scale_kept = libm::exp(-length_m / tuning.scale_length_m);
        if stretch.heading_sigma_rad > UNKNOWN_RAD {
            // Nothing is known of it from the beginning on: the track may end anywhere on a circle.
            let unknown = stretch.heading_sigma_rad * stretch.heading_sigma_rad;
            self.covariance[(HEADING, HEADING)] = self.covariance[(HEADING, HEADING)].max(unknown);
            for axis in 0..2 {
                self.covariance[(axis, axis)] += d.xy().norm_squared();
            }
        }
        // A track that is turned clockwise by ψ goes d + ψ (d_n, −d_e).
        let across = Vector2::new(d.y, -d.x);
        let mut f = SMatrix::<f64, STATES, STATES>::identity();
        for axis in 0..2 {
            f[(axis, HEADING)] = across[axis];
            f[(axis, SCALE)] = d[axis];
        }
        f[(HEADING, HEADING)] = heading_kept;
        f[(SCALE, SCALE)] = scale_kept;
        let heading_grown = heading_sigma * heading_sigma * (1.0 - heading_kept * heading_kept);
        let scale_grown = scale_sigma * scale_sigma * (1.0 - scale_kept * scale_kept);
        let walk = sigma(tuning.walk_sigma_m_rtm);
        let height_walk = sigma(tuning.height_walk_sigma_m_rtm);
        let mut q = SMatrix::<f64, STATES, STATES>::zeros();
        for a in 0..2 {
            for b in 0..2 {
                // What changes evenly on the way counts for a third of what it does from the start.
                q[(a, b)] = (across[a] * across[b] * heading_grown + d[a] * d[b] * scale_grown) / 3.0;
            }
            q[(a, HEADING)] = across[a] * heading_grown / 2.0;
            q[(HEADING, a)] = q[(a, HEADING)];
            q[(a, SCALE)] = d[a] * scale_grown / 2.0;
            q[(SCALE, a)] = q[(a, SCALE)];
            q[(a, a)] += walk * walk * length_m;
        }
        q[(2, 2)] = height_walk * height_walk * length_m;
        q[(HEADING, HEADING)] = heading_grown;
        q[(SCALE, SCALE)] = scale_grown;
        self.mean = f * self.mean;
        self.covariance = f * self.covariance * f.transpose() + q;
        for axis in 0..3 {
            self.mean[axis] += stretch.jump_n_m[axis];
        }
        if stretch.jump_heading_rad.abs() < UNKNOWN_RAD {
            self.mean[HEADING] += stretch.jump_heading_rad;
            return;
        }
        // Markers have told how the walk is turned: what was thought of its heading is about another track.
        self.mean[HEADING] = 0.0;
        for state in 0..STATES {
            self.covariance[(HEADING, state)] = 0.0;
            self.covariance[(state, HEADING)] = 0.0;
        }
        self.covariance[(HEADING, HEADING)] = JUST_TURNED_RAD * JUST_TURNED_RAD;
    }

    /// The track's position was `off` from where it should have been (with this sigma on each axis).
    pub(super) fn learn(&mut self, off_n_m: &Vector3<f64>, sigma_m: &Vector3<f64>) {
        let mut s = self.covariance.fixed_view::<3, 3>(0, 0).into_owned();
        for axis in 0..3 {
            s[(axis, axis)] += sigma_m[axis] * sigma_m[axis];
        }
        let Some(s) = s.cholesky() else { return };
        let p_ht = self.covariance.fixed_columns::<3>(0).into_owned();
        let gain = s.solve(&p_ht.transpose()).transpose();
        self.mean += gain * (off_n_m - self.mean.fixed_rows::<3>(0));
        self.covariance -= gain * p_ht.transpose();
        self.covariance = (self.covariance + self.covariance.transpose()) * 0.5;
    }

    /// One Gaussian of the same mean and covariance as two with these weights.
    pub(super) fn merge(&mut self, own: f64, other: &TrackError, others: f64) {
        let (a, b) = (own / (own + others), others / (own + others));
        let between = other.mean - self.mean;
        self.covariance =
            self.covariance * a + other.covariance * b + between * between.transpose() * (a * b);
        self.mean += between * b;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn north(length_m: f64) -> Stretch {
        Stretch {
            displacement_n_m: Vector3::new(0.0, length_m, 0.0),
            length_m,
            heading_sigma_rad: 0.016,
            jump_n_m: Vector3::zeros(),
            jump_heading_rad: 0.0,
        }
    }

    #[test]
    fn a_turned_track_goes_off_to_the_right_and_a_marker_shows_by_how_much() {
        let tuning = IdentificationTuning::default();
        let mut error = TrackError::at_start(&tuning);
        error.walk(&north(150.0), &tuning);
        let sigma = |k: usize| error.covariance[(k, k)].sqrt();
        assert!(sigma(0) > 1.5 && sigma(0) < 4.0 && sigma(1) < 1.3, "{} {}", sigma(0), sigma(1));
        error.learn(&Vector3::new(2.0, 0.0, 0.0), &Vector3::repeat(0.1));
        assert!((error.mean[0] - 2.0).abs() < 0.1, "{}", error.mean);
        assert!(error.mean[HEADING] > 0.004, "walking north, off to the east: turned clockwise");
        let expected = error.mean[0] + 150.0 * error.mean[HEADING];
        error.walk(&north(150.0), &tuning);
        assert!((error.mean[0] - expected).abs() < 1e-9);
    }

    #[test]
    fn a_correction_that_is_known_moves_the_mean_and_nothing_else() {
        let tuning = IdentificationTuning::default();
        let mut error = TrackError::at_start(&tuning);
        let mut corrected = error.clone();
        error.walk(&north(100.0), &tuning);
        let jump_n_m = Vector3::new(-2.0, 1.0, 0.5);
        corrected.walk(&Stretch { jump_n_m, jump_heading_rad: -0.01, ..north(100.0) }, &tuning);
        assert_eq!(corrected.covariance, error.covariance);
        assert_eq!(corrected.mean[0] - error.mean[0], -2.0);
        assert_eq!(corrected.mean[HEADING] - error.mean[HEADING], -0.01);
    }

    #[test]
    fn a_heading_of_which_nothing_is_known_leaves_the_end_anywhere_on_a_circle_until_it_is_turned() {
        let tuning = IdentificationTuning::default();
        let mut error = TrackError::at_start(&tuning);
        error.walk(&Stretch { heading_sigma_rad: 1.8, ..north(20.0) }, &tuning);
        assert!((0..2).all(|axis| error.covariance[(axis, axis)].sqrt() > 19.0));
        error.walk(&Stretch { jump_heading_rad: 2.0, ..north(0.0) }, &tuning);
        assert_eq!(error.mean[HEADING], 0.0);
        assert!(error.covariance[(HEADING, HEADING)].sqrt() < 0.11);
    }
}
