//! The turn and shift in plan that lay one set of points best upon another.

/// A rigid motion in plan: a turn, then a shift. No scale, no mirror.
#[derive(Clone, Copy, Debug)]
pub(super) struct RigidFit {
    cos: f64,
    sin: f64,
    shift_m: [f64; 2],
}

impl RigidFit {
    /// The least-squares fit of `from` to `to`, pair by pair; `None` of fewer than two pairs.
    pub(super) fn new(pairs: &[([f64; 2], [f64; 2])]) -> Option<RigidFit> {
        if pairs.len() < 2 {
            return None;
        }
        let n = pairs.len() as f64;
        let mean = |pick: fn(&([f64; 2], [f64; 2])) -> f64| pairs.iter().map(pick).sum::<f64>() / n;
        let from = [mean(|p| p.0[0]), mean(|p| p.0[1])];
        let to = [mean(|p| p.1[0]), mean(|p| p.1[1])];
        let (mut dot, mut cross) = (0.0, 0.0);
        for (a, b) in pairs {
            let (ax, ay, bx, by) = (a[0] - from[0], a[1] - from[1], b[0] - to[0], b[1] - to[1]);
            dot += ax * bx + ay * by;
            cross += ax * by - ay * bx;
        }
        let length = libm::hypot(dot, cross);
        let (cos, sin) = if length > 0.0 { (dot / length, cross / length) } else { (1.0, 0.0) };
        let shift_m = [to[0] - (cos * from[0] - sin * from[1]), to[1] - (sin * from[0] + cos * from[1])];
        Some(RigidFit { cos, sin, shift_m })
    }

    pub(super) fn apply(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.cos * x - self.sin * y + self.shift_m[0], self.sin * x + self.cos * y + self.shift_m[1]]
    }
}
