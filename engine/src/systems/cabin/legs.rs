//! Readings of the encoders: a seat for the platform, and what a leg reads too much.
//!
//! A bias of a millimetre is an error state of the filter. A leg that leaps by centimetres is no bias: where one leg alone leaps, and
//! stays there, the platform has not moved. What it leapt by is taken off its readings, and the state of its bias is uncertain
//! again. The same is done with a leg that the stations' rays have found (`leg_doubt`).

use std::collections::VecDeque;

use nalgebra::{Matrix3, Vector3, Vector6};
use serde::{Deserialize, Serialize};

use super::covariance::Update;
use super::filter::Filter;
use super::joints::{PlatformInCabin, Seat};
use super::rows::EncoderRow;

/// Legs do not accelerate more, m/s²: in two recordings it is below 0.2.
const ACCELERATION_M_S2: f64 = 2.0;
/// A leg leaps when it is off the line of its last readings by so many of the maker's sigmas, beyond what it can accelerate.
const LEAP_SIGMAS: f64 = 4.0;
/// Readings farther apart say nothing of a leap, ns.
const LONGEST_NS: i64 = 260_000_000;
/// Readings that are kept.
const KEPT: usize = 24;
/// Where the bias of a leg that was off has gone so far, it is taken off, too: a seat changes with a bias to the first order, m.
const CURVED_M: f64 = 0.002;
/// A leg reads wrongly where it is off by so many of the maker's sigmas.
const WRONG_SIGMAS: f64 = 6.0;

/// A bias of so many of the maker's sigmas is none.
const IMPROBABLE_SIGMAS: f64 = 4.5;
/// Of a leg of whose variance less than this share was taken away nothing is known.
const LEARNT: f64 = 0.02;

/// What has become of readings of the encoders.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Seated {
    /// The platform is there.
    Taken,
    /// No pose fits, or the platform would have leapt.
    Refused,
    /// A channel reads the same again and again, or all do.
    Stuck { channels: Vec<usize> },
    /// One angle of the rotator has leapt, by so much, rad.
    Turned { axis: usize, by_rad: f64 },
    /// One leg alone has leapt, by so much, m: whether it stays there the next reading says.
    Leapt { leg: usize, by_m: f64 },
}

/// The legs' readings.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Legs {
    /// What is taken off each reading before a pose is fitted, m.
    off_m: [f64; 6],
    /// Of which legs the bias is no longer taken to be as small as the maker says.
    freed: [bool; 6],
    /// The readings of which there are seats.
    readings: VecDeque<EncoderRow>,
    leapt: Option<(usize, f64)>,
    /// What the stations' rays have found, to be taken off at the next epoch: by how much, and its sigma, m.
    found: Option<(usize, f64, f64)>,
}

impl Legs {
    /// The leg that is off the line of the last readings while no other is, and by how much, m.
    fn leap(&self, row: &EncoderRow, sigma_m: f64) -> Option<(usize, f64)> {
        let count = self.readings.len();
        let (before, last) = (self.readings.get(count.checked_sub(2)?)?, self.readings.get(count - 1)?);
        let (dt_ns, dt_before_ns) = (row.t_ns - last.t_ns, last.t_ns - before.t_ns);
        if dt_ns <= 0 || dt_before_ns <= 0 || dt_ns.max(dt_before_ns) > LONGEST_NS {
            return None;
        }
        let (dt_s, dt_before_s) = (dt_ns as f64 * 1e-9, dt_before_ns as f64 * 1e-9);
        let off_m: [f64; 6] = std::array::from_fn(|leg| {
            let rate_m_s = (last.legs_m[leg] - before.legs_m[leg]) / dt_before_s;
            row.legs_m[leg] - last.legs_m[leg] - rate_m_s * dt_s
        });
        let noise_m = LEAP_SIGMAS * sigma_m * 0.5 * (1.0 + dt_s / dt_before_s);
        let most_m = noise_m + 0.5 * ACCELERATION_M_S2 * dt_s * (dt_s + dt_before_s);
        if let Some((leg, by_m)) = self.leapt
            && off_m[leg] * by_m > 0.5 * by_m * by_m
        {
            return Some((leg, off_m[leg]));
        }
        let largest = (0..6).max_by(|a, b| off_m[*a].abs().total_cmp(&off_m[*b].abs()))?;
        let others = (0..6).filter(|leg| *leg != largest).map(|leg| off_m[leg].abs()).fold(0.0, f64::max);
        (off_m[largest].abs() > most_m && others < 0.5 * most_m).then_some((largest, off_m[largest]))
    }

    fn push(&mut self, row: &EncoderRow) {
        self.readings.push_back(*row);
        while self.readings.len() > KEPT {
            self.readings.pop_front();
        }
    }

    /// The bias of a leg is no longer taken to be as small as the maker says.
    pub(super) fn free(&mut self, leg: usize) {
        self.freed[leg] = true;
    }

    /// A leg that the stations' rays have found to be off by so much, with this sigma, m.
    pub(super) fn found(&mut self, leg: usize, off_m: f64, sigma_m: f64) {
        self.found = Some((leg, off_m, sigma_m));
    }
}

impl Filter {
    /// Takes readings of the encoders.
    pub(super) fn encoders(&mut self, row: &EncoderRow) -> Seated {
        let Some(near) = self.seat else { return Seated::Refused };
        let is_later = self.seats.back().is_none_or(|(t_ns, _)| row.t_ns > *t_ns);
        if !(row.a_rad.abs() < 0.8 && row.b_rad.abs() < 0.8 && is_later) {
            return Seated::Refused;
        }
        if self.tuning.calibration {
            let earlier = self.encoder_watch.before();
            let channels = self.encoder_watch.stuck(row);
            if !channels.is_empty() {
                return Seated::Stuck { channels };
            }
            if let Some(turned) = self.angle_leap(earlier) {
                return turned;
            }
        }
        let [off_a_rad, off_b_rad] = self.encoder_watch.off_rad;
        let row = &EncoderRow { a_rad: row.a_rad - off_a_rad, b_rad: row.b_rad - off_b_rad, ..*row };
        let leap = self.legs.leap(row, self.rig.leg_sigma_m).filter(|_| self.tuning.calibration);
        if let Some((leg, by_m)) = leap {
            if self.legs.leapt.replace((leg, by_m)).is_none_or(|(before, _)| before != leg) {
                return Seated::Leapt { leg, by_m };
            }
            self.shift_leg(leg, by_m, 0.003 + 0.05 * by_m.abs());
            // The seats stay as they are: what the leg read before counts as if it had leapt, too.
            self.legs.readings.iter_mut().for_each(|reading| reading.legs_m[leg] += by_m);
        }
        self.legs.leapt = None;
        let Some((seat, platform)) = self.seated(row, &near) else { return Seated::Refused };
        if let Some((t_ns, last)) = self.seats.back() {
            let dt_s = ((row.t_ns - t_ns) as f64 * 1e-9).max(0.0);
            let leapt_m = (platform.position_b - last.position_b).norm();
            if dt_s < 1.0 && leapt_m > 0.01 + 0.5 * dt_s {
                return Seated::Refused;
            }
        }
        self.seat = Some(seat);
        self.legs.push(row);
        if leap.is_none() {
            self.note_steadiness(row.t_ns, &platform);
        }
        self.seats.push_back((row.t_ns, platform));
        while self.seats.len() > KEPT {
            self.seats.pop_front();
        }
        match leap {
            Some((leg, by_m)) => Seated::Leapt { leg, by_m },
            None => Seated::Taken,
        }
    }

    fn seated(&self, row: &EncoderRow, near: &Seat) -> Option<(Seat, PlatformInCabin)> {
        let joints = self.rig.joints.as_ref()?;
        let legs = Vector6::from(row.legs_m) - Vector6::from(self.legs.off_m);
        let seat = joints.seat(&legs, near)?;
        Some((seat, joints.in_cabin(row.a_rad, row.b_rad, &seat)))
    }

    /// Takes so much, m, off the readings of a leg: its error state is then what is left, which nobody knows better than by this
    /// sigma, m.
    fn shift_leg(&mut self, leg: usize, by_m: f64, sigma_m: f64) {
        self.legs.off_m[leg] += by_m;
        self.legs.freed[leg] = true;
        let state = self.states.legs + leg;
        self.covariance.add(state, state, sigma_m * sigma_m);
    }

    /// The seats of the readings that are kept, as they are with what is taken off now.
    fn seat_again(&mut self) {
        let Some(mut near) = self.seat else { return };
        let readings = self.legs.readings.clone();
        for (place, row) in self.seats.iter_mut().map(|(_, place)| place).zip(&readings) {
            let joints = self.rig.joints.as_ref();
            let legs = Vector6::from(row.legs_m) - Vector6::from(self.legs.off_m);
            if let Some((joints, seat)) = joints.and_then(|joints| Some((joints, joints.seat(&legs, &near)?)))
            {
                *place = joints.in_cabin(row.a_rad, row.b_rad, &seat);
                near = seat;
            }
        }
        self.seat = Some(near);
    }

    /// What was found since the last epoch is taken off; the covariance has to be at the strapdown's time. Whether anything was.
    pub(super) fn put_legs_right(&mut self) -> bool {
        let found = self.legs.found.take();
        if let Some((leg, off_m, sigma_m)) = found {
            self.shift_leg(leg, off_m, sigma_m);
            self.seat_again();
        }
        for leg in 0..6 {
            let state = self.states.legs + leg;
            if self.legs.freed[leg] && self.x[state].abs() > CURVED_M {
                self.legs.off_m[leg] += self.x[state];
                self.x[state] = 0.0;
                self.seat_again();
            }
        }
        found.is_some()
    }

    /// The leg whose bias, by all that was weighed, is none that its maker's sigma allows: what was known of it at the start, that it
    /// is small, is then taken back. Its own bias and what else had to bend for it are put right by the same (the measurement of the
    /// start with its variance negative). Gives the leg and its bias, m; the covariance has to be at the strapdown's time.
    pub(super) fn free_improbable_leg(&mut self) -> Option<(usize, f64)> {
        let stated = self.rig.leg_sigma_m * self.rig.leg_sigma_m;
        let left_out = |leg: usize| {
            let state = self.states.legs + leg;
            // The share of the stated variance that the measurements have taken away.
            let learnt = 1.0 - self.covariance.row(state)[state] / stated;
            (leg, self.x[state] + self.dx[state], learnt)
        };
        let (leg, x_m, learnt) = (0..6)
            .filter(|leg| !self.legs.freed[*leg])
            .map(left_out)
            .filter(|(_, _, learnt)| *learnt > LEARNT)
            .max_by(|(_, a, of_a), (_, b, of_b)| (a * a / of_a).total_cmp(&(b * b / of_b)))?;
        if x_m * x_m / (stated * learnt) < IMPROBABLE_SIGMAS * IMPROBABLE_SIGMAS {
            return None;
        }
        let state = self.states.legs + leg;
        let row = self.covariance.row(state).to_vec();
        let spread = -stated * learnt;
        let gain = [row.iter().map(|p| p / spread).collect(), vec![0.0; row.len()], vec![0.0; row.len()]];
        for (dx, gain) in self.dx.iter_mut().zip(&gain[0]) {
            *dx -= gain * x_m;
        }
        let zero = vec![0.0; row.len()];
        self.covariance.subtract(&gain, &[row, zero.clone(), zero]);
        if let Some(leaf) = &mut self.leaf {
            leaf.updates.push(Update {
                jacobian: vec![(state, [1.0, 0.0, 0.0])],
                innovation: Vector3::new(-x_m, 0.0, 0.0),
                information: Matrix3::from_diagonal(&Vector3::new(1.0 / spread, 0.0, 0.0)),
                gain,
            });
        }
        self.legs.freed[leg] = true;
        Some((leg, x_m / learnt))
    }

    /// The legs that read wrongly, and what each reads too much, m.
    pub(super) fn wrong_legs(&self) -> impl Iterator<Item = (usize, f64)> + use<'_> {
        let most_m = WRONG_SIGMAS * self.rig.leg_sigma_m;
        (0..6).filter(|leg| self.legs.freed[*leg]).filter_map(move |leg| {
            let off_m = self.legs.off_m[leg] + self.x[self.states.legs + leg];
            (off_m.abs() > most_m).then_some((leg, off_m))
        })
    }
}
