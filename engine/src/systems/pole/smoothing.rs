//! The way back over a pass.

use nalgebra::{Matrix3, Matrix4, SMatrix, SVector, Vector3};

use super::pass::{Pass, Pose};
use super::states::{BLOCKS, STATES};
use crate::ins::adjoint::Adjoint;
use crate::ins::layout::ErrorState::{Attitude, Position};
use crate::rotation::cayley;

/// The errors that show in a pose.
#[derive(Clone, Copy, Debug)]
struct PoseErrors {
    attitude: Vector3<f64>,
    position: Vector3<f64>,
    antenna: Vector3<f64>,
    tip: Vector3<f64>,
    roundness: f64,
}

impl PoseErrors {
    fn of(errors: &[Vector3<f64>; BLOCKS]) -> PoseErrors {
        let states = STATES.imu;
        PoseErrors {
            attitude: errors[states.block(Attitude)],
            position: errors[states.block(Position)],
            antenna: errors[STATES.antenna.block()],
            tip: errors[STATES.tip.block()],
            roundness: errors[STATES.roundness.block()].x,
        }
    }

    fn between(&self, other: &PoseErrors, share: f64) -> PoseErrors {
        let mix = |a: Vector3<f64>, b: Vector3<f64>| a + (b - a) * share;
        PoseErrors {
            attitude: mix(self.attitude, other.attitude),
            position: mix(self.position, other.position),
            antenna: self.antenna,
            tip: self.tip,
            roundness: self.roundness,
        }
    }

    fn taken_off(&self, pose: &Pose) -> Pose {
        Pose {
            c_nb: cayley(&self.attitude) * pose.c_nb,
            p_n: pose.p_n - self.position,
            antenna_b_m: pose.antenna_b_m + self.antenna,
            tip_b_m: pose.tip_b_m.map(|tip_b_m| tip_b_m + self.tip),
            roundness_m: pose.roundness_m + self.roundness,
            ..*pose
        }
    }
}

/// The errors of the start, as all that came later says.
pub(super) fn errors_at_start(mut pass: Pass) -> Option<[Vector3<f64>; BLOCKS]> {
    let mut way = Adjoint::<BLOCKS>::of_errors_at_the_end();
    while way.go_back(&mut pass.tape) {}
    way.anchor(&pass.start.eskf);
    way.is_finite().then(|| *way.errors())
}

/// A smoothed track.
#[derive(Debug)]
pub(super) struct Smoothed {
    /// Poses.
    pub(super) poses: Vec<Pose>,
    /// Covariance of position and heading at each look.
    pub(super) covariances: Vec<Matrix4<f64>>,
    /// Covariances between the looks that were asked for: of the position there, m², in the order asked for.
    pub(super) between: Vec<Vec<Matrix3<f64>>>,
    /// By how much each doubted island is off: its number, the error (m) and its covariance (m²).
    pub(super) islands: Vec<(usize, Vector3<f64>, Matrix3<f64>)>,
}

/// Goes back over a pass; `asked` are looks, in order of time, whose positions' covariances with each other are wanted.
pub(super) fn smooth(mut pass: Pass, asked: &[usize]) -> Option<Smoothed> {
    let mut way = Adjoint::<BLOCKS>::at_the_end();
    let count = pass.looks.len();
    let mut before: Vec<Option<PoseErrors>> = vec![None; count];
    let mut after: Vec<Option<PoseErrors>> = vec![None; count];
    let mut covariances = vec![Matrix4::zeros(); count];
    let mut between = vec![vec![Matrix3::zeros(); asked.len()]; asked.len()];
    let mut look = count;
    let mut carried: Vec<usize> = Vec::new();
    let mut is_after = true;
    let mut islands = Vec::new();
    while way.go_back(&mut pass.tape) {
        if is_after {
            look = look.checked_sub(1)?;
            after[look] = Some(PoseErrors::of(way.errors()));
            for doubt in pass.doubts.iter().filter(|doubt| doubt.look == look) {
                let off = doubt.slow_n_m + way.errors()[STATES.slow.block()];
                let covariance = doubt.covariance - way.taken_off(&doubt.rows, &SVector::zeros());
                islands.push((doubt.island, off, covariance));
            }
            is_after = false;
            continue;
        }
        is_after = true;
        if let Some((_, kept)) = pass.kept.pop_if(|(at, _)| *at == look) {
            way.anchor(&kept);
        }
        before[look] = Some(PoseErrors::of(way.errors()));
        let Some(rows) = pass.looks[look].rows.take() else { continue };
        let filtered = pass.looks[look].covariance;
        let smoothed = filtered - way.taken_off(&rows, &SVector::zeros());
        covariances[look] = sound(&smoothed, &filtered);
        for (number, _) in asked.iter().enumerate().filter(|(_, at)| **at == look) {
            between[number][number] = covariances[look].fixed_view::<3, 3>(0, 0).into_owned();
            for (later, seen) in carried.iter().zip(way.carried_seen_by(&rows)) {
                let of: SMatrix<f64, 4, 4> = seen;
                let block = of.fixed_view::<3, 3>(0, 0).into_owned();
                between[*later][number] = block;
                between[number][*later] = block.transpose();
            }
            carried.push(number);
        }
        if asked.contains(&look) {
            let shows = std::mem::take(&mut pass.looks[look].shows);
            for _ in asked.iter().filter(|at| **at == look) {
                way.carry(&shows, &rows);
            }
        }
    }
    if !way.is_finite() {
        return None;
    }
    let mut poses = Vec::with_capacity(pass.poses.len());
    for pose in &pass.poses {
        let last = pose.after.checked_sub(1).and_then(|look| Some((pass.looks[look].t_ns, after[look]?)));
        let next = before.get(pose.after).and_then(|errors| Some((pass.looks[pose.after].t_ns, (*errors)?)));
        let errors = match (last, next) {
            (Some((from_ns, from)), Some((to_ns, to))) => {
                let share = (pose.t_ns - from_ns) as f64 / (to_ns - from_ns).max(1) as f64;
                from.between(&to, share.clamp(0.0, 1.0))
            }
            (Some((_, errors)), None) | (None, Some((_, errors))) => errors,
            (None, None) => continue,
        };
        poses.push(errors.taken_off(pose));
    }
    Some(Smoothed { poses, covariances, between, islands })
}

/// A covariance of which rounding leaves the variances positive.
fn sound(smoothed: &Matrix4<f64>, filtered: &Matrix4<f64>) -> Matrix4<f64> {
    let mut sound = (smoothed + smoothed.transpose()) * 0.5;
    for axis in 0..4 {
        sound[(axis, axis)] = sound[(axis, axis)].max(filtered[(axis, axis)] * 1e-9);
    }
    sound
}
