//! Does the magnetic field turn with the foot? In a swing the foot pitches far out of its stance, and the field in its
//! axes has to turn back by as much as the gyro says, if both have the same axes.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::contradictions::Contradiction;
use super::filter::{Filter, Setting};
use super::foot::Step;
use crate::event::Event;
use crate::rotation::skew;

/// Slower than this the readings of a slow magnetometer are still those of now, rad/s.
const SLOW_RAD_S: f64 = 1.5;
/// The cosine of the turn from the stance from which on the field's direction says something: 25°.
const TURNED_COS: f64 = 0.906;
/// After so many swings it is decided,
const SWINGS: u32 = 6;
/// by a mean over about so many.
const SWINGS_OF_A_MEAN: f64 = 16.0;
/// Off by less than this share of its strength, squared, the field is not doubted.
const OFF_SHARE2: f64 = 0.04;
/// With other axes it has to be off by less than this share of that, squared.
const BETTER_SHARE2: f64 = 0.2;
/// Ways in which the axes of a chip can lie in a case: proper turns by quarters. Mirrored ones turn a field as their
/// opposites do.
const WAYS: usize = 24;

/// A way that a wrong field has turned may end off by this share of it.
const BENT_SHARE: f64 = 0.3;
/// Turns about the vertical of the stance, by so many equal angles, in which a magnetometer of its own may be tied.
const TURNS: usize = 12;

/// What the swings have said of the field.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct FieldTurn {
    /// Field in the body's axes, µT, and attitude when the foot left the ground.
    at_lift_off: Option<(Vector3<f64>, Matrix3<f64>)>,
    last_mag_b_ut: Vector3<f64>,
    readings: u32,
    /// Sum over the readings of their squares and that of the stance's field.
    squares: f64,
    /// Sum over the readings of the turn since lift-off times each of their components.
    turned: [Matrix3<f64>; 3],
    /// Sum of how far the readings are from that field with no turn at all, squared.
    unturned: f64,
    swings: u32,
    /// What the field is off by, squared, as a share of its strength, with each way of the axes: the first is the log's.
    off_share2: [f64; WAYS],
    /// With a turn of the magnetometer about the vertical.
    tied_share2: [f64; TURNS],
    /// With no turn at all.
    unturned_share2: f64,
}

impl Default for FieldTurn {
    fn default() -> Self {
        FieldTurn {
            at_lift_off: None,
            last_mag_b_ut: Vector3::zeros(),
            readings: 0,
            squares: 0.0,
            turned: [Matrix3::zeros(); 3],
            unturned: 0.0,
            swings: 0,
            off_share2: [0.0; WAYS],
            tied_share2: [0.0; TURNS],
            unturned_share2: 0.0,
        }
    }
}

/// The turns from the log's axes to those of the other sensors, with each way; the first is none.
fn ways() -> impl Iterator<Item = Matrix3<f64>> {
    const ORDERS: [([usize; 3], f64); 6] = [
        ([0, 1, 2], 1.0),
        ([1, 2, 0], 1.0),
        ([2, 0, 1], 1.0),
        ([0, 2, 1], -1.0),
        ([1, 0, 2], -1.0),
        ([2, 1, 0], -1.0),
    ];
    ORDERS.into_iter().flat_map(|(order, hand)| {
        [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)].map(|(first, second)| {
            let signs = [first, second, hand * first * second];
            Matrix3::from_fn(|axis, from| if order[axis] == from { signs[axis] } else { 0.0 })
        })
    })
}

/// The turn about an axis of length 1 by an angle, rad.
fn about(axis: &Vector3<f64>, rad: f64) -> Matrix3<f64> {
    let (sin, cos) = libm::sincos(rad);
    Matrix3::identity() * cos + skew(axis) * sin + axis * axis.transpose() * (1.0 - cos)
}

/// How far the readings of a swing lie along the stance's field, with this turn of the magnetometer, summed, µT².
fn along(way: &Matrix3<f64>, stance_b_ut: &Vector3<f64>, turned: &[Matrix3<f64>; 3]) -> f64 {
    let stance_ut = way * stance_b_ut;
    (0..3).map(|from| stance_ut.dot(&(turned[from] * way.column(from)))).sum()
}

impl FieldTurn {
    /// Turns what is written in n about the vertical.
    pub(super) fn turn(&mut self, r: &Matrix3<f64>) {
        if let Some((_, c_nb)) = &mut self.at_lift_off {
            *c_nb = r * *c_nb;
        }
    }

    /// The foot leaves the ground, where its field was this, if it is known.
    fn begin(&mut self, at_lift_off: Option<(Vector3<f64>, Matrix3<f64>)>) {
        self.at_lift_off = at_lift_off;
        self.readings = 0;
        self.squares = 0.0;
        self.turned = [Matrix3::zeros(); 3];
        self.unturned = 0.0;
    }

    fn take(&mut self, mag_b_ut: Vector3<f64>, c_nb: &Matrix3<f64>) {
        let Some((stance_b_ut, stance_c_nb)) = &self.at_lift_off else { return };
        if 0.5 * (stance_c_nb.component_mul(c_nb).sum() - 1.0) > TURNED_COS {
            return;
        }
        let turn = stance_c_nb.transpose() * c_nb;
        for (sum, component) in self.turned.iter_mut().zip(&mag_b_ut) {
            *sum += turn * *component;
        }
        self.squares += mag_b_ut.norm_squared() + stance_b_ut.norm_squared();
        self.unturned += (mag_b_ut - stance_b_ut).norm_squared();
        self.readings += 1;
    }

    /// The foot comes down: takes the swing into the means.
    fn end(&mut self) {
        let Some((stance_b_ut, stance_c_nb)) = self.at_lift_off.take() else { return };
        if self.readings == 0 {
            return;
        }
        self.swings += 1;
        let strength2 = f64::from(self.readings) * stance_b_ut.norm_squared().max(1.0);
        let count = f64::from(self.swings).min(SWINGS_OF_A_MEAN);
        for (mean, way) in self.off_share2.iter_mut().zip(ways()) {
            *mean +=
                ((self.squares - 2.0 * along(&way, &stance_b_ut, &self.turned)) / strength2 - *mean) / count;
        }
        let up_b = stance_c_nb.row(2).transpose();
        for (k, mean) in self.tied_share2.iter_mut().enumerate() {
            let turn = about(&up_b, k as f64 * std::f64::consts::TAU / TURNS as f64);
            *mean +=
                ((self.squares - 2.0 * along(&turn, &stance_b_ut, &self.turned)) / strength2 - *mean) / count;
        }
        self.unturned_share2 += (self.unturned / strength2 - self.unturned_share2) / count;
    }

    /// By how much the field is off, as a share of its strength, where other axes fit it far better, or it does not turn at all.
    fn contradicts(&self) -> Option<f64> {
        let own = self.off_share2[0];
        let others = self.off_share2[1..].iter().chain(&self.tied_share2[1..]).copied();
        let best = others.fold(self.unturned_share2, f64::min);
        (self.swings >= SWINGS && own > OFF_SHARE2 && best < BETTER_SHARE2 * own).then(|| own.sqrt())
    }
}

impl<const B: usize, const F: usize> Filter<B, F> {
    /// The foot leaves the ground.
    pub(super) fn note_lift_off(&mut self, sensor: usize) {
        let foot = &mut self.feet[sensor];
        let magnetics = &foot.stance.magnetics;
        let c_nb = foot.nav.c_nb;
        let known =
            magnetics.mean_b_ut().filter(|_| magnetics.readings() >= 3 && !foot.doubts.field_left_out);
        foot.doubts.field_turn.begin(known.map(|mean_b_ut| (mean_b_ut, c_nb)));
    }

    /// The foot swings.
    #[inline]
    pub(super) fn watch_field(&mut self, step: &Step) {
        let Some(mag_b_ut) = step.mag_b_ut else { return };
        let foot = &mut self.feet[step.sensor];
        let turn = &mut foot.doubts.field_turn;
        let fresh = mag_b_ut != turn.last_mag_b_ut;
        turn.last_mag_b_ut = mag_b_ut;
        if fresh && step.w_ib_b.norm_squared() < SLOW_RAD_S * SLOW_RAD_S {
            turn.take(mag_b_ut, &foot.nav.c_nb);
        }
    }

    /// A swing has come to its end: what it says of the field.
    pub(super) fn judge_field(&mut self, setting: &Setting, sensor: usize, told: &mut Vec<Event>) {
        let doubts = &mut self.feet[sensor].doubts;
        doubts.field_turn.end();
        if doubts.field_left_out || !setting.aids.heading {
            return;
        }
        let Some(off_share) = doubts.field_turn.contradicts() else { return };
        doubts.field_left_out = true;
        let off_deg = 2.0 * libm::asin((0.5 * off_share).min(1.0)).to_degrees();
        self.tell(setting, sensor, &Contradiction::FieldAgainstGyro { off_deg }, told);
        // The way since then was bent by the field, nobody knows how far.
        let place_n = self.last_sure_place_n;
        let way_m = (self.middle_p_n() - place_n).xy().norm();
        let sigma_m = setting.tuning.marker_sigma_m + BENT_SHARE * way_m;
        self.lose_north(place_n, sigma_m * sigma_m);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rotation::cayley;

    #[test]
    fn every_way_is_a_proper_turn_and_none_is_there_twice() {
        let all: Vec<_> = ways().collect();
        assert_eq!(all.len(), WAYS);
        for (k, way) in all.iter().enumerate() {
            assert_eq!(way.determinant(), 1.0);
            assert!(!all[..k].contains(way));
        }
        assert_eq!(all[0], Matrix3::identity());
    }

    #[test]
    fn a_field_in_other_axes_is_found_out_in_some_swings_and_its_own_is_not() {
        let field_n = Vector3::new(3.0, 36.0, -31.0);
        let swung = |axes: fn(Vector3<f64>) -> Vector3<f64>| {
            let mut turn = FieldTurn::default();
            for swing in 0..10 {
                let way = cayley(&Vector3::new(0.0, 0.0, 0.1 * f64::from(swing)));
                turn.begin(Some((axes(way.transpose() * field_n), way)));
                for k in 0..5 {
                    let pitched = way * cayley(&Vector3::new(0.05 * f64::from(k), 0.9, 0.1));
                    turn.take(axes(pitched.transpose() * field_n), &pitched);
                }
                turn.end();
            }
            turn.contradicts().is_some()
        };
        assert!(!swung(|b| b));
        assert!(swung(|b| Vector3::new(b.y, b.x, -b.z)));
        assert!(swung(|b| Vector3::new(-b.y, b.x, b.z)));
        assert!(swung(|b| Vector3::new(b.x, b.y, -b.z)));
        assert!(swung(|b| about(&Vector3::z(), 0.5) * b));
        assert!(swung(|_| Vector3::new(20.0, 30.0, -10.0)));
    }
}
