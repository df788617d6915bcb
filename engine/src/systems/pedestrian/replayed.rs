//! What late visits and smoothing ask of the pedestrian's filter.

use nalgebra::{SMatrix, Vector3, Vector4};

use super::filter::{Filter, Setting, seconds};
use super::kept_step::KeptStep;
use super::slow_errors::{stride, stride_matrix};
use crate::event::{Event, TrackPoint, VisitOutcome};
use crate::ins::eskf::Eskf;
use crate::ins::layout::ErrorState;
use crate::ins::linear_maps::Rows;
use crate::replay::filter::Replayed;
use crate::rotation::{azimuth, cayley, wrap};
use crate::visit::Visit;

/// What smoothing a point of the feet needs beside the errors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AtPoint {
    /// How much later each sensor's place was given than its covariance stands for, s.
    ahead_s: [f64; 2],
    /// How far each has moved since the stride's error was last brought into that covariance, m.
    moved_n: [Vector3<f64>; 2],
    /// The first sensor's x axis.
    x_n: Vector3<f64>,
}

impl<const B: usize, const F: usize> Replayed<B> for Filter<B, F> {
    type Input = KeptStep;
    type Setting = Setting;
    type AtPoint = AtPoint;

    fn history_s(setting: &Setting) -> f64 {
        setting.tuning.history_s
    }

    fn uses_visits(setting: &Setting) -> bool {
        setting.aids.markers
    }

    fn t_ns(&self) -> i64 {
        self.feet.iter().map(|foot| foot.t_ns).max().unwrap_or(i64::MIN)
    }

    #[inline]
    fn step(&mut self, setting: &Setting, input: &KeptStep, events: &mut Vec<Event>) {
        self.take(setting, &input.step(), events);
    }

    fn weigh(&mut self, setting: &Setting, visit: &Visit, events: &mut Vec<Event>) -> VisitOutcome {
        self.apply_visit(setting, visit, visit.moment_ns(), events)
    }

    fn teach(&self, setting: &Setting, start: &mut Self) -> bool {
        self.teach_north(setting, start)
    }

    fn visits_weighed(&self) -> usize {
        self.visits_weighed
    }

    fn set_visits_weighed(&mut self, number: usize) {
        self.visits_weighed = number;
    }

    fn point(&self, setting: &Setting, t_ns: i64) -> TrackPoint {
        self.middle_point(setting, t_ns)
    }

    /// The places of the sensors are given a little later than their covariance stands for.
    fn at_point(&self, t_ns: i64) -> AtPoint {
        let mut ahead_s = [0.0; 2];
        for (ahead_s, foot) in ahead_s.iter_mut().zip(&self.feet) {
            *ahead_s = foot.transition.dt_s() + Self::carried_on_s(seconds(t_ns - foot.t_ns));
        }
        AtPoint {
            ahead_s,
            moved_n: std::array::from_fn(|sensor| {
                self.feet.get(sensor).map_or_else(Vector3::zeros, |foot| foot.moved_n)
            }),
            x_n: self.feet[0].nav.c_nb.column(0).into_owned(),
        }
    }

    /// Of the middle of the feet, and of the attitude about the vertical of the first sensor.
    fn point_with_errors(&self) -> (Rows<4, B>, Vector4<f64>) {
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

    fn smoothed(
        setting: &Setting,
        filtered: &TrackPoint,
        at: &AtPoint,
        errors: &[Vector3<f64>; B],
    ) -> TrackPoint {
        let mut point = *filtered;
        let (mut sum, mut feet) = (Vector3::zeros(), 0.0);
        for (sensor, side) in setting.feet.iter().enumerate() {
            let Some(place) = &mut point.parts[side.index()] else { continue };
            let off = errors[ErrorState::Position.of(sensor)]
                + errors[ErrorState::Velocity.of(sensor)] * at.ahead_s[sensor]
                + stride_matrix(&at.moved_n[sensor]) * errors[stride(sensor, setting.feet.len())];
            let p_n = Vector3::from(place.position_n_m) - off;
            place.position_n_m = p_n.into();
            sum += p_n;
            feet += 1.0;
        }
        let middle = sum / feet;
        let x_n = cayley(&errors[ErrorState::Attitude.of(0)]) * at.x_n;
        let turned_rad = azimuth(x_n.x, x_n.y) - azimuth(at.x_n.x, at.x_n.y);
        point.position_n_m = middle.into();
        point.heading_rad = wrap(point.heading_rad + turned_rad);
        // A stretch with a NaN or infinity stays as the filter gave it.
        let sound = middle.iter().all(|x| x.is_finite()) && point.heading_rad.is_finite();
        if sound { point } else { *filtered }
    }

    fn eskf(&self) -> &Eskf<B> {
        &self.eskf
    }

    fn eskf_mut(&mut self) -> &mut Eskf<B> {
        &mut self.eskf
    }

    fn is_sound(&self) -> bool {
        self.feet.iter().all(|foot| foot.nav.is_finite()) && self.eskf.covariance.is_sound()
    }

    fn lose_all(&mut self) {
        for foot in &mut self.feet {
            foot.lost = true;
        }
    }
}
