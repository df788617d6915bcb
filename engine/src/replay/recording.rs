//! What a smoother needs of a stretch of a session: the tape of its errors, and the filter's points.

use nalgebra::{SMatrix, Vector4};

use super::filter::Replayed;
use crate::event::TrackPoint;
use crate::ins::adjoint::Adjoint;
use crate::ins::linear_maps::Rows;
use crate::ins::tape::{Tape, TapeLength};

/// Smoothed covariances are worked out this often, and lie on a line in between: they change slowly,
/// and are the same on both sides of a correction, ns.
const SIGMAS_NS: i64 = 400_000_000;

/// Tape and points, in the order in which they came.
#[derive(Clone, Debug)]
pub(super) struct Recording<F: Replayed<B>, const B: usize> {
    tape: Tape,
    points: Vec<Recorded<F::AtPoint>>,
    /// For each point that has it, the covariance of what it says (east, north, up, heading) with all errors, and with
    /// one set aside.
    with_errors: Vec<(Rows<4, B>, Vector4<f64>)>,
}

/// How long a recording is; it can be cut back to it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RecordingLength {
    tape: TapeLength,
    points: usize,
    with_errors: usize,
}

/// The filter's point of one epoch.
#[derive(Clone, Copy, Debug)]
struct Recorded<A> {
    epoch: u64,
    point: TrackPoint,
    /// What smoothing it needs beside the errors.
    at: A,
    has_errors: bool,
}

/// Variances of a point: east, north, up, the covariance of east and north, heading.
type Variances = [f64; 5];

/// The state of the way back.
#[derive(Clone, Debug)]
pub(super) struct WayBack<const B: usize> {
    adjoint: Adjoint<B>,
    /// The covariance that was worked out last, that is, of a later moment.
    later: Option<(i64, Variances)>,
}

impl<const B: usize> WayBack<B> {
    /// From the end of what is known.
    pub(super) fn new() -> Self {
        WayBack { adjoint: Adjoint::at_the_end(), later: None }
    }
}

impl<F: Replayed<B>, const B: usize> Recording<F, B> {
    pub(super) fn new() -> Self {
        Recording { tape: Tape::default(), points: Vec::new(), with_errors: Vec::new() }
    }

    pub(super) fn length(&self) -> RecordingLength {
        RecordingLength {
            tape: self.tape.length(),
            points: self.points.len(),
            with_errors: self.with_errors.len(),
        }
    }

    pub(super) fn cut_back(&mut self, length: RecordingLength) {
        self.tape.cut_back(length.tape);
        self.points.truncate(length.points);
        self.with_errors.truncate(length.with_errors);
    }

    /// Gives back the memory that was taken beforehand.
    pub(super) fn shrink(&mut self) {
        self.tape.shrink();
        self.points.shrink_to_fit();
        self.with_errors.shrink_to_fit();
    }

    /// How much memory it holds.
    pub(super) fn bytes(&self) -> usize {
        self.tape.bytes()
            + self.points.capacity() * size_of::<Recorded<F::AtPoint>>()
            + self.with_errors.capacity() * size_of::<(Rows<4, B>, Vector4<f64>)>()
    }

    /// Takes what the filter has recorded since it was last asked.
    pub(super) fn gather(&mut self, newer: &mut Tape) {
        self.tape.append(newer);
    }

    /// Takes the point of an epoch, which the filter has just given.
    pub(super) fn point(&mut self, filter: &mut F, epoch: u64, point: &TrackPoint) {
        let tape = &mut filter.eskf_mut().tape;
        tape.mark_moment();
        self.gather(tape);
        let last_ns = self.points.iter().rev().find(|point| point.has_errors).map(|point| point.point.t_ns);
        let has_errors = last_ns.is_none_or(|last_ns| point.t_ns - last_ns >= SIGMAS_NS);
        if has_errors {
            self.with_errors.push(filter.point_with_errors());
        }
        self.points.push(Recorded { epoch, point: *point, at: filter.at_point(point.t_ns), has_errors });
    }

    /// Goes back over the recording, from its end to its start, where the filter was `start`; gives the
    /// smoothed points, oldest first.
    pub(super) fn go_back(
        mut self,
        way: &mut WayBack<B>,
        start: &F,
        setting: &F::Setting,
    ) -> Vec<TrackPoint> {
        let mut smoothed = Vec::with_capacity(self.points.len());
        let mut without_sigmas = 0;
        let mut last_epoch = u64::MAX;
        while way.adjoint.go_back(&mut self.tape) {
            let Some(recorded) = self.points.pop() else { break };
            let with_errors = if recorded.has_errors { self.with_errors.pop() } else { None };
            if recorded.epoch >= last_epoch {
                continue;
            }
            last_epoch = recorded.epoch;
            let t_ns = recorded.point.t_ns;
            smoothed.push(F::smoothed(setting, &recorded.point, &recorded.at, way.adjoint.errors()));
            let filtered = variances(&recorded.point);
            let Some((later_ns, later)) = way.later else {
                // At the end the smoother knows what the filter knows.
                set_variances(&mut smoothed[without_sigmas], &filtered);
                way.later = Some((t_ns, filtered));
                without_sigmas = smoothed.len();
                continue;
            };
            let Some(with_errors) = with_errors else { continue };
            let here = less(&filtered, &way.adjoint.taken_off(&with_errors.0, &with_errors.1));
            for point in &mut smoothed[without_sigmas..] {
                let share = (point.t_ns - t_ns) as f64 / (later_ns - t_ns) as f64;
                let between = std::array::from_fn(|k| here[k] + (later[k] - here[k]) * share);
                set_variances(point, &no_less_sure(&between, &variances(point)));
            }
            without_sigmas = smoothed.len();
            way.later = Some((t_ns, here));
        }
        way.adjoint.anchor(start.eskf());
        if !way.adjoint.is_finite() {
            *way = WayBack::new();
        }
        smoothed.reverse();
        smoothed
    }
}

fn variances(point: &TrackPoint) -> Variances {
    let [e, n, u] = point.sigma_n_m;
    let heading = point.sigma_heading_rad;
    [e * e, n * n, u * u, point.covariance_en_m2, heading * heading]
}

/// The covariance of a point when `off` is taken off; rounding leaves a variance positive.
fn less(filtered: &Variances, off: &SMatrix<f64, 4, 4>) -> Variances {
    let variance = |k: usize, axis: usize| {
        let rest = filtered[k] - off[(axis, axis)].max(0.0);
        if rest.is_finite() { rest.max(filtered[k] * 1e-9) } else { filtered[k] }
    };
    let [e, n, u, heading] = [variance(0, 0), variance(1, 1), variance(2, 2), variance(4, 3)];
    let most = (e * n).sqrt();
    let rest = filtered[3] - off[(0, 1)];
    [e, n, u, if rest.is_finite() { rest.max(-most).min(most) } else { filtered[3] }, heading]
}

/// What lies on a line between two moments is never less sure than the filter was.
fn no_less_sure(between: &Variances, filtered: &Variances) -> Variances {
    const COVARIANCE: usize = 3;
    std::array::from_fn(|k| if k == COVARIANCE { between[k] } else { between[k].min(filtered[k]) })
}

fn set_variances(point: &mut TrackPoint, variances: &Variances) {
    let [e, n, u, en, heading] = variances;
    point.sigma_n_m = [e.sqrt(), n.sqrt(), u.sqrt()];
    point.covariance_en_m2 = *en;
    point.sigma_heading_rad = heading.sqrt();
}
