//! Each row by all observations: what the filter went through is kept, and corrected from the end to the beginning (Rauch, Tung and
//! Striebel). Whole cycles are known by then; float ambiguities are not smoothed, only what they say at their time.

use nalgebra::{DMatrix, DVector};

use super::state::{POSITION, State, VELOCITY};

/// How the state came from one time to the next.
#[derive(Clone, Debug, Default)]
pub struct Transition {
    /// Seconds that position moved by velocity.
    pub dt_s: f64,
    /// The upward velocity began anew.
    pub level: bool,
    /// States that were multiplied by a factor.
    pub factors: Vec<(usize, f64)>,
}

#[derive(Clone, Debug)]
struct Knot {
    transition: Transition,
    before: Moments,
    after: Option<Moments>,
}

#[derive(Clone, Debug)]
struct Moments {
    x: DVector<f64>,
    p: DMatrix<f64>,
}

/// What the filter went through.
#[derive(Clone, Debug)]
pub struct Tape {
    size: usize,
    knots: Vec<Knot>,
}

/// A smoothed position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoothed {
    /// East, north, up, m.
    pub p_n: [f64; 3],
    /// Standard deviations, m.
    pub sigma_n: [f64; 3],
    /// Covariance of east and north, m².
    pub covariance_en_m2: f64,
}

impl Tape {
    /// A tape of the first `size` states.
    pub fn new(size: usize) -> Tape {
        Tape { size, knots: Vec::new() }
    }

    /// The number of times on it.
    pub fn len(&self) -> usize {
        self.knots.len()
    }

    /// Whether nothing is on it.
    pub fn is_empty(&self) -> bool {
        self.knots.is_empty()
    }

    fn moments(&self, state: &State) -> Moments {
        let n = self.size;
        Moments {
            x: DVector::from_fn(n, |i, _| state.x[i]),
            p: DMatrix::from_fn(n, n, |i, j| state.covariance(i, j)),
        }
    }

    /// The state as it leaves a time, with all that was measured then.
    pub fn leave(&mut self, state: &State) {
        let moments = self.moments(state);
        match self.knots.last_mut() {
            Some(knot) => knot.after = Some(moments),
            None => self.knots.push(Knot {
                transition: Transition::default(),
                before: moments.clone(),
                after: Some(moments),
            }),
        }
    }

    /// The state as it arrives at the next time.
    pub fn arrive(&mut self, state: &State, transition: Transition) {
        let before = self.moments(state);
        self.knots.push(Knot { transition, before, after: None });
    }

    /// All times smoothed, in their order.
    pub fn smoothed(&self) -> Vec<Smoothed> {
        let mut all = Vec::with_capacity(self.knots.len());
        let mut later: Option<(&Knot, Moments)> = None;
        for knot in self.knots.iter().rev() {
            let own = knot.after.as_ref().unwrap_or(&knot.before);
            let moments = match &later {
                None => own.clone(),
                Some((next, smoothed)) => corrected(own, next, smoothed).unwrap_or_else(|| own.clone()),
            };
            all.push(Smoothed {
                p_n: std::array::from_fn(|axis| moments.x[POSITION + axis]),
                sigma_n: std::array::from_fn(|axis| {
                    moments.p[(POSITION + axis, POSITION + axis)].max(0.0).sqrt()
                }),
                covariance_en_m2: moments.p[(POSITION, POSITION + 1)],
            });
            later = Some((knot, moments));
        }
        all.reverse();
        all
    }
}

/// One step back; none where the prediction's covariance is none.
fn corrected(own: &Moments, next: &Knot, smoothed: &Moments) -> Option<Moments> {
    let n = own.x.len();
    let mut f = DMatrix::<f64>::identity(n, n);
    for axis in 0..3 {
        f[(POSITION + axis, VELOCITY + axis)] = next.transition.dt_s;
    }
    if next.transition.level {
        f[(POSITION + 2, VELOCITY + 2)] = 0.0;
        f[(VELOCITY + 2, VELOCITY + 2)] = 0.0;
    }
    for &(index, factor) in &next.transition.factors {
        f[(index, index)] = factor;
    }
    // States that are known for certain after the step say nothing of those before.
    let alive: Vec<usize> = (0..n).filter(|&i| next.before.p[(i, i)] > 1e-14).collect();
    let p = next.before.p.select_rows(&alive).select_columns(&alive);
    let cross = (&own.p * f.transpose()).select_columns(&alive);
    let gain = p.clone().cholesky()?.solve(&cross.transpose()).transpose();
    let off = (&smoothed.x - &next.before.x).select_rows(&alive);
    let spread = (&smoothed.p - &next.before.p).select_rows(&alive).select_columns(&alive);
    let x = &own.x + &gain * off;
    let p = &own.p + &gain * spread * gain.transpose();
    Some(Moments { x, p: 0.5 * (&p + p.transpose()) })
}
