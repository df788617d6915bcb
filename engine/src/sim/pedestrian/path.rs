//! The line on the ground that a walk follows.

use nalgebra::Vector3;

/// A point of the path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PathPoint {
    /// On the ground, east-north-up, m.
    pub(crate) position_n_m: Vector3<f64>,
    /// Direction in plan, from east, anticlockwise, rad.
    pub(crate) yaw: f64,
    /// Rise over run of what a foot stands on.
    pub(crate) slope: f64,
}

/// A line on the ground, by points that lie close together.
#[derive(Clone, Debug, Default)]
pub(crate) struct Path {
    points_n_m: Vec<Vector3<f64>>,
    along_m: Vec<f64>,
    /// Whether rises are stairs, on which feet stand level.
    stepped: bool,
}

/// Spacing of the points that [`Path`]'s own pieces add, m.
const SPACING_M: f64 = 0.1;

impl Path {
    pub(crate) fn from_points(points_n_m: impl IntoIterator<Item = Vector3<f64>>) -> Path {
        let mut path = Path::default();
        for point in points_n_m {
            path.push(point);
        }
        path
    }

    /// The same line, whose rises are stairs.
    pub(crate) fn with_stairs(mut self) -> Path {
        self.stepped = true;
        self
    }

    fn push(&mut self, point: Vector3<f64>) {
        let along = match self.points_n_m.last() {
            Some(last) => self.length_m() + (point - last).norm(),
            None => 0.0,
        };
        self.points_n_m.push(point);
        self.along_m.push(along);
    }

    /// Straight on to a point.
    pub(crate) fn line_to(&mut self, to: Vector3<f64>) -> &mut Path {
        let from = self.end_n_m();
        let pieces = libm::ceil((to - from).norm() / SPACING_M).max(1.0) as usize;
        for i in 1..=pieces {
            self.push(from + (to - from) * (i as f64 / pieces as f64));
        }
        self
    }

    /// A level turn to the left (angle positive) or right about a centre at this distance, starting in
    /// the direction `yaw`.
    pub(crate) fn arc(&mut self, yaw: f64, radius_m: f64, angle: f64) -> &mut Path {
        let from = self.end_n_m();
        let side = libm::copysign(radius_m, angle);
        let normal = |yaw: f64| Vector3::new(-libm::sin(yaw), libm::cos(yaw), 0.0);
        let centre = from + normal(yaw) * side;
        let pieces = libm::ceil(radius_m * angle.abs() / SPACING_M).max(2.0) as usize;
        for i in 1..=pieces {
            self.push(centre - normal(yaw + angle * i as f64 / pieces as f64) * side);
        }
        self
    }

    /// The same line, moved.
    pub(crate) fn shifted(mut self, by_m: Vector3<f64>) -> Path {
        for point in &mut self.points_n_m {
            *point += by_m;
        }
        self
    }

    fn end_n_m(&self) -> Vector3<f64> {
        self.points_n_m.last().copied().unwrap_or_default()
    }

    pub(crate) fn length_m(&self) -> f64 {
        self.along_m.last().copied().unwrap_or(0.0)
    }

    pub(crate) fn points_n_m(&self) -> &[Vector3<f64>] {
        &self.points_n_m
    }

    /// Length along the path up to one of its points, m.
    pub(crate) fn along_m(&self, index: usize) -> f64 {
        self.along_m[index]
    }

    fn position_n_m(&self, along_m: f64) -> Vector3<f64> {
        let last = self.points_n_m.len() - 1;
        let after = self.along_m.partition_point(|&at| at <= along_m).clamp(1, last);
        let (from, to) = (self.along_m[after - 1], self.along_m[after]);
        let (a, b) = (self.points_n_m[after - 1], self.points_n_m[after]);
        a + (b - a) * ((along_m - from) / (to - from))
    }

    /// The path at a length; before its beginning and past its end it goes straight on.
    pub(crate) fn at(&self, along_m: f64) -> PathPoint {
        // Direction and slope over a foot's length.
        const HALF_FOOT_M: f64 = 0.15;
        let chord = self.position_n_m(along_m + HALF_FOOT_M) - self.position_n_m(along_m - HALF_FOOT_M);
        PathPoint {
            position_n_m: self.position_n_m(along_m),
            yaw: libm::atan2(chord.y, chord.x),
            slope: if self.stepped { 0.0 } else { chord.z / libm::hypot(chord.x, chord.y) },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn lines_and_turns() {
        let mut path = Path::from_points([Vector3::zeros()]);
        path.line_to(Vector3::new(10.0, 0.0, 1.0)).arc(0.0, 2.0, FRAC_PI_2);
        assert!((path.length_m() - (101f64.sqrt() + PI)).abs() < 1e-3, "{}", path.length_m());
        let middle = path.at(5.0);
        assert!(middle.yaw.abs() < 1e-12 && (middle.slope - 0.1).abs() < 1e-12);
        let end = path.at(path.length_m());
        assert!((end.position_n_m - Vector3::new(12.0, 2.0, 1.0)).norm() < 1e-9);
        assert!((end.yaw - FRAC_PI_2).abs() < 0.05);
        // Past both ends it goes straight on.
        assert!((path.at(-1.0).position_n_m.x + 1.0 / 1.01f64.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn a_right_turn_goes_right() {
        let mut path = Path::from_points([Vector3::zeros()]);
        path.line_to(Vector3::new(0.0, 5.0, 0.0)).arc(FRAC_PI_2, 1.5, -FRAC_PI_2);
        assert!((path.at(path.length_m()).position_n_m - Vector3::new(1.5, 6.5, 0.0)).norm() < 1e-9);
    }
}
