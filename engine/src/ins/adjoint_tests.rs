//! The smoother against batch least squares: everything that is random as one long vector, every
//! measurement a row, one dense solution.

use nalgebra::{DMatrix, DVector, Matrix3, RowVector3, SMatrix, SVector, Vector3};

use super::*;
use crate::ins::earth_map::{EarthMap, rows};
use crate::ins::earth_transition::EarthPropagation;
use crate::ins::error_model::Transition;
use crate::ins::eskf::Eskf;
use crate::ins::mechanization::Increment;
use crate::ins::observation::Observation;
use crate::ins::process_noise::{BiasesKept, Growth, ProcessNoise};
use crate::rotation::{cayley, skew};

const B: usize = 5;
const N: usize = 3 * B;

/// Numbers that look like nothing, the same in every run.
struct Odd(u32);

impl Odd {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(self.0 >> 8) / f64::from(1 << 23) - 1.0
    }

    fn vector(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.next())
    }
}

/// A noise that grows with the time and with the motion, differently for each error.
struct TestNoise;

impl ProcessNoise for TestNoise {
    fn biases_kept(&self, dt_s: f64) -> BiasesKept {
        BiasesKept { gyro: 1.0 - dt_s / 5.0, accelerometer: 1.0 - dt_s / 7.0 }
    }

    fn growth(&self, transition: &Transition) -> Growth {
        let dt_s = transition.dt_s();
        let white = Vector3::repeat(dt_s);
        Growth {
            attitude: white * 0.04 + transition.rate_squared_dt() * 0.02,
            gyro_bias: white * 0.01,
            accelerometer_bias: white * 0.02,
            position: Vector3::new(0.0, 0.0, 0.16 * dt_s),
            velocity: white * 0.09 + transition.acceleration_squared_dt() * 0.01,
            position_share_s: 0.5 * dt_s,
        }
    }
}

/// The filter beside the batch problem that it stands for.
struct Problem {
    filter: Eskf<B>,
    estimate: DVector<f64>,
    /// The state of now as a linear map of all that is random.
    map: DMatrix<f64>,
    /// Variances of what is random, beyond the first N.
    variances: Vec<f64>,
    /// The map of what has been set aside, and its estimate then.
    aside: Option<(DMatrix<f64>, f64)>,
    first: DMatrix<f64>,
    rows: Vec<(DMatrix<f64>, DVector<f64>, DMatrix<f64>)>,
    /// Estimate, covariance and map at every moment marked.
    moments: Vec<(DVector<f64>, Eskf<B>, DMatrix<f64>)>,
    odd: Odd,
}

impl Problem {
    fn new() -> Problem {
        let mut odd = Odd(7);
        let mut filter = Eskf::new();
        let factor = DMatrix::from_fn(N, N, |r, c| odd.next() * 0.3 + if r == c { 1.0 } else { 0.0 });
        let first = &factor * factor.transpose();
        for i in 0..B {
            for j in i..B {
                let block = Matrix3::from_fn(|r, c| {
                    0.5 * (first[(3 * i + r, 3 * j + c)] + first[(3 * j + c, 3 * i + r)])
                });
                filter.covariance.set(i, j, &block);
            }
        }
        filter.tape.set_recording(true);
        Problem {
            filter,
            estimate: DVector::zeros(N),
            map: DMatrix::identity(N, N),
            variances: Vec::new(),
            aside: None,
            first,
            rows: Vec::new(),
            moments: Vec::new(),
            odd,
        }
    }

    fn goes_through(&mut self, t: &DMatrix<f64>) {
        self.map = t * &self.map;
        self.estimate = t * &self.estimate;
    }

    /// A noise that enters the state by `column`.
    fn random(&mut self, column: DVector<f64>, variance: f64) {
        if variance > 0.0 {
            self.map = self.map.clone().insert_column(self.map.ncols(), 0.0);
            self.map.set_column(self.map.ncols() - 1, &column);
            self.variances.push(variance);
        }
    }

    fn unit(&self, blocks: &[usize], axis: usize) -> DVector<f64> {
        DVector::from_fn(N, |k, _| if blocks.contains(&(k / 3)) && k % 3 == axis { 1.0 } else { 0.0 })
    }

    fn random_by_axis(&mut self, blocks: &[usize], variance: &Vector3<f64>) {
        for axis in 0..3 {
            self.random(self.unit(blocks, axis), variance[axis]);
        }
    }

    fn propagate(&mut self) {
        let mut transition = Transition::none();
        let dt_s = 0.1 + 0.05 * self.odd.next();
        let (f_n, c_nb) = (self.odd.vector() * 2.0, cayley(&self.odd.vector()));
        let (w_nb_n, acceleration_n) = (self.odd.vector(), self.odd.vector());
        transition.extend(&Increment { dt_s, f_n, w_nb_n, acceleration_n }, &c_nb);
        let (kept, growth) = (TestNoise.biases_kept(dt_s), TestNoise.growth(&transition));
        self.filter.propagate(&mut transition, 0, &TestNoise);
        let mut t = DMatrix::identity(N, N);
        let mut set = |r: usize, c: usize, block: Matrix3<f64>| {
            t.view_mut((3 * r, 3 * c), (3, 3)).copy_from(&block);
        };
        set(0, 1, -c_nb * dt_s);
        set(2, 3, Matrix3::identity() * dt_s);
        set(2, 0, skew(&(f_n * dt_s)) * (0.5 * dt_s));
        set(2, 4, c_nb * (0.5 * dt_s * dt_s));
        set(3, 0, skew(&(f_n * dt_s)));
        set(3, 4, c_nb * dt_s);
        set(1, 1, Matrix3::identity() * kept.gyro);
        set(4, 4, Matrix3::identity() * kept.accelerometer);
        self.goes_through(&t);
        self.random_by_axis(&[0], &growth.attitude);
        self.random_by_axis(&[1], &growth.gyro_bias);
        self.random_by_axis(&[2], &growth.position);
        self.random_by_axis(&[4], &growth.accelerometer_bias);
        for axis in 0..3 {
            // Noise on one axis is one number: one of the velocity moves the position, too.
            let column = self.unit(&[3], axis) + self.unit(&[2], axis) * growth.position_share_s;
            self.random(column, growth.velocity[axis]);
        }
    }

    /// The same on a turning Earth, by any map.
    fn propagate_on_earth(&mut self) {
        let mut some = |size: f64| rows(&Matrix3::from_fn(|_, _| size * self.odd.next()));
        let (a, b, c, d, e, f) = (some(0.2), some(0.2), some(0.1), some(0.2), some(0.1), some(0.2));
        let (turn, dt_s) = (self.odd.vector() * 0.2, 0.1 + 0.05 * self.odd.next());
        let propagation = EarthPropagation {
            map: EarthMap {
                dt_s,
                velocity_by_attitude: (self.odd.vector() * 0.2).into(),
                position_by_attitude: (self.odd.vector() * 0.1).into(),
                attitude_by_gyro: a,
                velocity_by_gyro: b,
                position_by_gyro: c,
                velocity_by_accelerometer: d,
                position_by_accelerometer: e,
                half_turn: rows(&cayley(&turn)),
                whole_turn: rows(&cayley(&(turn * 2.0))),
                half_gradient_dt: f,
                gyro_bias_kept: 0.95,
                accelerometer_bias_kept: 0.9,
            },
            half_attitude: Vector3::new(0.01, 0.02, 0.03),
            half_velocity: Vector3::new(0.03, 0.01, 0.02),
            gyro_bias: Vector3::new(0.001, 0.002, 0.003),
            accelerometer_bias: Vector3::new(0.02, 0.01, 0.03),
        };
        self.filter.propagate_on_earth(&propagation, 0);
        let mut t = DMatrix::zeros(N, N);
        for k in 0..N {
            let mut unit = [[0.0; 3]; 5];
            unit[k / 3][k % 3] = 1.0;
            t.set_column(k, &DVector::from_column_slice(propagation.map.forward(unit).as_flattened()));
        }
        let white = |problem: &mut Self| {
            problem.random_by_axis(&[0], &propagation.half_attitude);
            problem.random_by_axis(&[3], &propagation.half_velocity);
        };
        white(self);
        self.goes_through(&t);
        white(self);
        self.random_by_axis(&[1], &propagation.gyro_bias);
        self.random_by_axis(&[4], &propagation.accelerometer_bias);
    }

    fn measure<const M: usize>(&mut self, blocks: &[usize]) {
        let mut h = DMatrix::zeros(M, N);
        let z = DVector::from_fn(M, |_, _| 2.0 * self.odd.next());
        let r = SMatrix::<f64, M, M>::from_fn(|i, j| if i == j { 0.3 } else { 0.05 });
        let mut jacobians = Vec::new();
        for block in blocks {
            let jacobian = SMatrix::<f64, M, 3>::from_fn(|_, _| self.odd.next());
            h.view_mut((0, 3 * block), (M, 3)).copy_from(&jacobian);
            jacobians.push((*block, jacobian));
        }
        let innovation = &h * &self.estimate - &z;
        let mut observation = Observation::new(SVector::from_fn(|k, _| innovation[k]), r);
        for (block, jacobian) in jacobians {
            observation = observation.with(block, jacobian);
        }
        let correction = self.filter.update(&observation, f64::INFINITY).correction.unwrap();
        for k in 0..N {
            self.estimate[k] -= correction[k / 3][k % 3];
        }
        self.rows.push((&h * &self.map, z, DMatrix::from_fn(M, M, |i, j| r[(i, j)])));
    }

    /// Sets aside what these blocks make.
    fn set_aside(&mut self, blocks: &[usize]) {
        let mut g = DMatrix::zeros(1, N);
        let mut jacobians = Vec::new();
        for block in blocks {
            let jacobian = RowVector3::from_fn(|_, _| self.odd.next());
            g.view_mut((0, 3 * block), (1, 3)).copy_from(&jacobian);
            jacobians.push((*block, jacobian));
        }
        self.filter.set_aside(&jacobians);
        self.aside = Some((&g * &self.map, (&g * &self.estimate)[0]));
    }

    /// Measures what was set aside together with a block of now.
    fn measure_aside(&mut self, block: usize) {
        let (then, estimate_then) = self.aside.take().unwrap();
        let jacobian = RowVector3::from_fn(|_, _| self.odd.next());
        let mut h = DMatrix::zeros(1, N);
        h.view_mut((0, 3 * block), (1, 3)).copy_from(&jacobian);
        let (z, r) = (2.0 * self.odd.next(), 0.2);
        let nominal = estimate_then - self.filter.corrected_aside().unwrap();
        let innovation = nominal + (&h * &self.estimate)[0] - z;
        let observation =
            Observation::new(SVector::from([innovation]), SMatrix::from([[r]])).with(block, jacobian);
        let correction = self.filter.update_aside(&observation, f64::INFINITY).correction.unwrap();
        for k in 0..N {
            self.estimate[k] -= correction[k / 3][k % 3];
        }
        let mut row = &h * &self.map;
        let mut part = row.view_mut((0, 0), then.shape());
        part += then;
        self.rows.push((row, DVector::from_element(1, z), DMatrix::from_element(1, 1, r)));
    }

    fn isolate(&mut self, block: usize) {
        let variance = Vector3::new(0.5, 0.7, 0.9);
        self.filter.isolate(block, Matrix3::from_diagonal(&variance));
        let mut t = DMatrix::identity(N, N);
        t.view_mut((3 * block, 3 * block), (3, 3)).fill(0.0);
        self.goes_through(&t);
        self.random_by_axis(&[block], &variance);
    }

    fn copy(&mut self, from: usize, to: usize) {
        let variance = Vector3::new(0.3, 0.2, 0.1);
        self.filter.copy(from, to, &variance);
        let mut t = DMatrix::identity(N, N);
        t.view_mut((3 * to, 3 * to), (3, 3)).fill(0.0);
        t.view_mut((3 * to, 3 * from), (3, 3)).fill_with_identity();
        self.goes_through(&t);
        self.random_by_axis(&[to], &variance);
    }

    fn add_multiple(&mut self, a: usize, b: usize) {
        let factor = Matrix3::from_fn(|_, _| self.odd.next());
        self.filter.add_multiple(a, b, &factor);
        let mut t = DMatrix::identity(N, N);
        t.view_mut((3 * a, 3 * b), (3, 3)).copy_from(&factor);
        self.goes_through(&t);
    }

    fn scale(&mut self, block: usize) {
        let by = Vector3::new(0.5, 1.0, 0.9);
        self.filter.scale(block, &by);
        let mut t = DMatrix::identity(N, N);
        t.view_mut((3 * block, 3 * block), (3, 3)).copy_from(&Matrix3::from_diagonal(&by));
        self.goes_through(&t);
    }

    fn common_noise(&mut self, blocks: &[usize]) {
        let variance = Vector3::new(0.2, 0.1, 0.05);
        self.filter.add_noise(blocks, &variance);
        self.random_by_axis(blocks, &variance);
    }

    fn mark(&mut self) {
        self.filter.tape.mark_moment();
        self.moments.push((self.estimate.clone(), self.filter.clone(), self.map.clone()));
    }

    /// Mean and covariance of all that is random, given every measurement.
    fn batch(&self) -> (DVector<f64>, DMatrix<f64>) {
        let size = N + self.variances.len();
        let mut information = DMatrix::zeros(size, size);
        let first = self.first.clone().cholesky().unwrap().inverse();
        information.view_mut((0, 0), (N, N)).copy_from(&first);
        for (k, variance) in self.variances.iter().enumerate() {
            information[(N + k, N + k)] = 1.0 / variance;
        }
        let mut right = DVector::zeros(size);
        for (a, z, r) in &self.rows {
            let mut all = DMatrix::zeros(a.nrows(), size);
            all.view_mut((0, 0), a.shape()).copy_from(a);
            let weight = r.clone().cholesky().unwrap().inverse();
            information += all.transpose() * &weight * &all;
            right += all.transpose() * weight * z;
        }
        let factor = information.cholesky().unwrap();
        (factor.solve(&right), factor.inverse())
    }
}

fn walk() -> Problem {
    let mut problem = Problem::new();
    problem.mark();
    for k in 0..40 {
        if k % 3 == 1 {
            problem.propagate_on_earth();
        } else {
            problem.propagate();
        }
        match k % 4 {
            0 => problem.measure::<3>(&[3]),
            1 => problem.measure::<1>(&[0, 2]),
            2 => problem.measure::<2>(&[2, 3, 1]),
            _ => {}
        }
        problem.mark();
        match k {
            11 => problem.isolate(3),
            17 => problem.copy(2, 4),
            23 => problem.common_noise(&[2, 4]),
            26 => problem.add_multiple(2, 0),
            29 => problem.isolate(0),
            33 => problem.scale(1),
            // One that is replaced, one that is used with much between, one that is never used.
            3 => problem.set_aside(&[0, 2]),
            4 | 21 | 30 => problem.set_aside(&[2, 3, 1]),
            9 | 28 | 35 => problem.measure_aside(4),
            36 => problem.set_aside(&[1]),
            _ => {}
        }
        problem.mark();
    }
    problem
}

#[test]
fn smoothed_errors_and_covariances_are_those_of_batch_least_squares() {
    let mut problem = walk();
    let (random, covariance) = problem.batch();
    let mut tape = std::mem::take(&mut problem.filter.tape);
    let mut adjoint = Adjoint::at_the_end();
    let mut last = true;
    while adjoint.go_back(&mut tape) {
        let (estimate, filtered, map) = problem.moments.pop().unwrap();
        let mut all = DMatrix::zeros(N, random.len());
        all.view_mut((0, 0), map.shape()).copy_from(&map);
        let (expected, expected_covariance) = (&all * &random, &all * &covariance * all.transpose());
        let smoothed = DVector::from_fn(N, |k, _| estimate[k] - adjoint.errors()[k / 3][k % 3]);
        let off = (smoothed - &expected).abs().max();
        assert!(off < 1e-9, "{off} with {} moments left", problem.moments.len());
        let mut anchored = adjoint.clone();
        anchored.anchor(&filtered);
        for (a, b) in anchored.errors().iter().zip(adjoint.errors()) {
            assert!((a - b).norm() < 1e-9);
        }
        for block in 0..B {
            let w = filtered.covariance.seen_by(&[(block, Matrix3::identity())]);
            let w_aside = filtered.aside_seen_by(&[(block, Matrix3::identity())]);
            let here = filtered.covariance.block(block, block) - adjoint.taken_off(&w, &w_aside);
            let expected = expected_covariance.fixed_view::<3, 3>(3 * block, 3 * block);
            assert!((here - expected).abs().max() < 1e-9, "block {block}");
            // Never less certain than the filter.
            let taken_off = adjoint.taken_off(&w, &w_aside).symmetric_eigenvalues().min();
            assert!(taken_off > -1e-9, "{taken_off}");
            assert!(!last || taken_off.abs() < 1e-12);
        }
        last = false;
    }
    assert!(problem.moments.is_empty(), "every moment was come by");
    assert!(tape.length() == Default::default());
}

#[test]
fn a_tape_that_was_cut_back_goes_on_as_if_nothing_had_been() {
    let mut straight = walk();
    let mut problem = walk();
    let length = problem.filter.tape.length();
    problem.propagate();
    problem.measure::<2>(&[2, 1]);
    problem.filter.tape.cut_back(length);
    let [a, b]: [Adjoint<B>; 2] = [&mut straight, &mut problem].map(|problem| {
        let mut adjoint = Adjoint::at_the_end();
        while adjoint.go_back(&mut problem.filter.tape) {}
        adjoint
    });
    assert_eq!(a.errors(), b.errors());
}
