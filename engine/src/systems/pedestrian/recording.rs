//! What a smoother needs of a stretch of the walk: the tape of its errors, and what the filter told.

use nalgebra::{SMatrix, Vector3, Vector4};

use super::filter::{Filter, Setting, seconds};
use super::slow_errors::{stride, stride_matrix};
use crate::event::TrackPoint;
use crate::ins::adjoint::Adjoint;
use crate::ins::layout::ErrorState;
use crate::ins::rows::Rows;
use crate::ins::tape::{Tape, TapeLength};
use crate::rotation::{azimuth, cayley, wrap};
use crate::sample::Foot;

/// Smoothed covariances are worked out this often, and lie on a line in between: they change slowly,
/// and are the same on both sides of a correction, ns.
const SIGMAS_NS: i64 = 400_000_000;

/// Tape and points, in the order in which they came.
#[derive(Clone, Debug)]
pub(super) struct Recording<const B: usize> {
    tape: Tape,
    points: Vec<Recorded>,
    /// For each point that has it, the covariance of what is told (east, north and up of the middle of
    /// the feet, attitude about the vertical of the first sensor) with all errors, and with one set aside.
    with_errors: Vec<(Rows<4, B>, Vector4<f64>)>,
}

/// How long a recording is; it can be cut back to it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RecordingLength {
    tape: TapeLength,
    points: usize,
    with_errors: usize,
}

/// What the filter told at one epoch.
#[derive(Clone, Copy, Debug)]
struct Recorded {
    epoch: u64,
    point: TrackPoint,
    /// How much later each sensor's place was told than its covariance stands for, s.
    ahead_s: [f64; 2],
    /// How far each has moved since the stride's error was last brought into that covariance, m.
    moved_n: [Vector3<f64>; 2],
    /// The first sensor's x axis.
    x_n: Vector3<f64>,
    has_errors: bool,
}

/// Variances of what is told: east, north, up, the covariance of east and north, heading.
type Told = [f64; 5];

/// The state of the way back.
#[derive(Clone, Debug)]
pub(super) struct WayBack<const B: usize> {
    adjoint: Adjoint<B>,
    /// The covariance that was worked out last, that is, of a later moment.
    later: Option<(i64, Told)>,
}

impl<const B: usize> WayBack<B> {
    /// From the end of what is known.
    pub(super) fn new() -> Self {
        WayBack { adjoint: Adjoint::at_the_end(), later: None }
    }
}

impl<const B: usize> Recording<B> {
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
            + self.points.capacity() * size_of::<Recorded>()
            + self.with_errors.capacity() * size_of::<(Rows<4, B>, Vector4<f64>)>()
    }

    /// Takes what the filter has taken down since it was last asked.
    pub(super) fn gather(&mut self, newer: &mut Tape) {
        self.tape.append(newer);
    }

    /// Takes the point of an epoch, which the filter has just told.
    pub(super) fn point<const F: usize>(
        &mut self,
        filter: &mut Filter<B, F>,
        epoch: u64,
        point: &TrackPoint,
    ) {
        filter.eskf.tape.mark_moment();
        self.gather(&mut filter.eskf.tape);
        let last_ns = self.points.iter().rev().find(|point| point.has_errors).map(|point| point.point.t_ns);
        let has_errors = last_ns.is_none_or(|last_ns| point.t_ns - last_ns >= SIGMAS_NS);
        if has_errors {
            self.with_errors.push(filter.told_with_errors());
        }
        self.points.push(Recorded {
            epoch,
            point: *point,
            ahead_s: filter.told_ahead_s(point.t_ns),
            moved_n: std::array::from_fn(|sensor| {
                filter.feet.get(sensor).map_or_else(Vector3::zeros, |foot| foot.moved_n)
            }),
            x_n: filter.feet[0].nav.c_nb.column(0).into_owned(),
            has_errors,
        });
    }

    /// Goes back over the recording, from its end to its start, where the filter was `start`; gives the
    /// smoothed points, oldest first.
    pub(super) fn go_back<const F: usize>(
        mut self,
        way: &mut WayBack<B>,
        start: &Filter<B, F>,
        setting: &Setting,
    ) -> Vec<TrackPoint> {
        let noise = &setting.tuning.imu_noise;
        let mut smoothed = Vec::with_capacity(self.points.len());
        let mut without_sigmas = 0;
        let mut last_epoch = u64::MAX;
        while way.adjoint.go_back(&mut self.tape, noise) {
            let Some(recorded) = self.points.pop() else { break };
            let with_errors = if recorded.has_errors { self.with_errors.pop() } else { None };
            if recorded.epoch >= last_epoch {
                continue;
            }
            last_epoch = recorded.epoch;
            let t_ns = recorded.point.t_ns;
            smoothed.push(recorded.smoothed(&way.adjoint, setting));
            let filtered = told(&recorded.point);
            let Some((later_ns, later)) = way.later else {
                // At the end the smoother knows what the filter knows.
                set_told(&mut smoothed[without_sigmas], &filtered);
                way.later = Some((t_ns, filtered));
                without_sigmas = smoothed.len();
                continue;
            };
            let Some(with_errors) = with_errors else { continue };
            let here = less(&filtered, &way.adjoint.taken_off(&with_errors.0, &with_errors.1));
            for point in &mut smoothed[without_sigmas..] {
                let share = (point.t_ns - t_ns) as f64 / (later_ns - t_ns) as f64;
                let between = std::array::from_fn(|k| here[k] + (later[k] - here[k]) * share);
                set_told(point, &no_less_sure(&between, &told(point)));
            }
            without_sigmas = smoothed.len();
            way.later = Some((t_ns, here));
        }
        way.adjoint.anchor(&start.eskf);
        if !way.adjoint.is_finite() {
            *way = WayBack::new();
        }
        smoothed.reverse();
        smoothed
    }
}

impl Recorded {
    /// The point with the smoothed errors taken off; its sigmas are the filter's still.
    fn smoothed<const B: usize>(&self, adjoint: &Adjoint<B>, setting: &Setting) -> TrackPoint {
        let errors = adjoint.errors();
        let mut point = self.point;
        let (mut sum, mut feet) = (Vector3::zeros(), 0.0);
        for (sensor, foot) in setting.feet.iter().enumerate() {
            let told = match foot {
                Foot::Left => &mut point.left,
                Foot::Right => &mut point.right,
            };
            let Some(told) = told else { continue };
            let off = errors[ErrorState::Position.of(sensor)]
                + errors[ErrorState::Velocity.of(sensor)] * self.ahead_s[sensor]
                + stride_matrix(&self.moved_n[sensor]) * errors[stride(sensor, setting.feet.len())];
            let p_n = Vector3::from(told.position_n_m) - off;
            told.position_n_m = p_n.into();
            sum += p_n;
            feet += 1.0;
        }
        let middle = sum / feet;
        let x_n = cayley(&errors[ErrorState::Attitude.of(0)]) * self.x_n;
        let turned_rad = azimuth(x_n.x, x_n.y) - azimuth(self.x_n.x, self.x_n.y);
        point.position_n_m = middle.into();
        point.heading_rad = wrap(point.heading_rad + turned_rad);
        // A stretch in which a number was none is left as the filter told it.
        let sound = middle.iter().all(|x| x.is_finite()) && point.heading_rad.is_finite();
        if sound { point } else { self.point }
    }
}

fn told(point: &TrackPoint) -> Told {
    let [e, n, u] = point.sigma_n_m;
    let heading = point.sigma_heading_rad;
    [e * e, n * n, u * u, point.covariance_en_m2, heading * heading]
}

/// The covariance of what is told when `off` is taken off; rounding leaves a variance positive.
fn less(filtered: &Told, off: &SMatrix<f64, 4, 4>) -> Told {
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
fn no_less_sure(between: &Told, filtered: &Told) -> Told {
    const COVARIANCE: usize = 3;
    std::array::from_fn(|k| if k == COVARIANCE { between[k] } else { between[k].min(filtered[k]) })
}

fn set_told(point: &mut TrackPoint, told: &Told) {
    let [e, n, u, en, heading] = told;
    point.sigma_n_m = [e.sqrt(), n.sqrt(), u.sqrt()];
    point.covariance_en_m2 = *en;
    point.sigma_heading_rad = heading.sqrt();
}

impl<const B: usize, const F: usize> Filter<B, F> {
    /// The covariance of what is told with all errors, and with the one set aside.
    fn told_with_errors(&self) -> (Rows<4, B>, Vector4<f64>) {
        let mut jacobians = [(0, SMatrix::zeros()); 3];
        let share = 1.0 / self.present().count() as f64;
        let mut used = 0;
        for sensor in self.present() {
            let mut middle = SMatrix::<f64, 4, 3>::zeros();
            middle.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(share);
            jacobians[used] = (ErrorState::Position.of(sensor), middle);
            used += 1;
        }
        let mut heading = SMatrix::zeros();
        heading[(3, 2)] = 1.0;
        jacobians[used] = (ErrorState::Attitude.of(0), heading);
        let jacobians = &jacobians[..=used];
        (self.eskf.covariance.seen_by(jacobians), self.eskf.aside_seen_by(jacobians))
    }

    /// How much later than its covariance each sensor's place is told at `t_ns`, s.
    fn told_ahead_s(&self, t_ns: i64) -> [f64; 2] {
        let mut ahead_s = [0.0; 2];
        for (ahead_s, foot) in ahead_s.iter_mut().zip(&self.feet) {
            *ahead_s = foot.transition.dt_s() + Self::carried_on_s(seconds(t_ns - foot.t_ns));
        }
        ahead_s
    }
}
