//! The points of a survey: several visits of one are combined with their correlation.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::recording::Stop;

/// A visit of a point.
#[derive(Clone, Debug)]
pub(super) struct VisitOfPoint {
    /// The stop's number in the recording.
    pub(super) stop: usize,
    pub(super) p_n_m: Vector3<f64>,
    /// Whether the tip stood there.
    pub(super) stood: bool,
    /// By how much the tip moved there, m; zero where it stayed.
    pub(super) moved_m: f64,
    /// How the pole leans there, rad.
    pub(super) tilt_rad: f64,
}

/// A point of the survey.
#[derive(Clone, Debug)]
pub struct Point {
    /// Its name.
    pub name: String,
    /// Where the tip stood, m.
    pub p_n_m: Vector3<f64>,
    /// Covariance of that, m².
    pub covariance_n_m2: Matrix3<f64>,
    /// When it was visited: starts and ends, ns.
    pub visits: Vec<[i64; 2]>,
    /// Where the tip stood at each of them by itself, m.
    pub places_n_m: Vec<Vector3<f64>>,
    /// Whether the tip was found to stand at every visit.
    pub stood: bool,
    /// By how much the tip moved at one of them while it was held there, m; zero where it stayed.
    pub moved_m: f64,
    /// Largest distance of two visits from each other, m; zero for one.
    pub apart_m: f64,
    /// The same in sigmas of it.
    pub apart_sigmas: f64,
    /// How the pole leaned, on the mean, rad.
    pub tilt_rad: f64,
    /// Since the last fix before it, of its first visit, s; zero where there were fixes.
    pub since_fix_s: f64,
}

/// Combines the visits of each name; `covariance` gives that of two visits' positions, by their numbers in `visits`.
pub(super) fn combine(
    stops: &[Stop],
    visits: &[VisitOfPoint],
    covariance: impl Fn(usize, usize) -> Matrix3<f64>,
) -> Vec<Point> {
    let mut names: Vec<&str> = Vec::new();
    for visit in visits {
        let name = stops[visit.stop].name.as_str();
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
        .into_iter()
        .map(|name| {
            let of: Vec<usize> = (0..visits.len()).filter(|k| stops[visits[*k].stop].name == name).collect();
            let (p_n_m, covariance_n_m2) = mean(&of, visits, &covariance);
            let (mut apart_m, mut apart_sigmas) = (0.0_f64, 0.0_f64);
            for (k, a) in of.iter().enumerate() {
                for b in &of[k + 1..] {
                    let apart = visits[*a].p_n_m - visits[*b].p_n_m;
                    let cross = covariance(*a, *b);
                    let of_apart = covariance(*a, *a) + covariance(*b, *b) - cross - cross.transpose();
                    let nis = of_apart.try_inverse().map_or(0.0, |inverse| apart.dot(&(inverse * apart)));
                    apart_m = apart_m.max(apart.norm());
                    apart_sigmas = apart_sigmas.max((nis / 3.0).max(0.0).sqrt());
                }
            }
            let count = of.len() as f64;
            Point {
                name: name.to_owned(),
                p_n_m,
                covariance_n_m2,
                visits: of
                    .iter()
                    .map(|k| [stops[visits[*k].stop].t_start_ns, stops[visits[*k].stop].t_end_ns])
                    .collect(),
                places_n_m: of.iter().map(|k| visits[*k].p_n_m).collect(),
                moved_m: of.iter().map(|k| visits[*k].moved_m).fold(0.0, f64::max),
                stood: of.iter().all(|k| visits[*k].stood),
                apart_m,
                apart_sigmas,
                tilt_rad: of.iter().map(|k| visits[*k].tilt_rad).sum::<f64>() / count,
                since_fix_s: 0.0,
            }
        })
        .collect()
}

/// The best mean of correlated visits: (A' S⁻¹ A)⁻¹ A' S⁻¹ z, with A one unit matrix a visit.
fn mean(
    of: &[usize],
    visits: &[VisitOfPoint],
    covariance: &impl Fn(usize, usize) -> Matrix3<f64>,
) -> (Vector3<f64>, Matrix3<f64>) {
    let first = (visits[of[0]].p_n_m, covariance(of[0], of[0]));
    if of.len() == 1 {
        return first;
    }
    let n = 3 * of.len();
    let mut s = DMatrix::<f64>::zeros(n, n);
    let mut a = DMatrix::<f64>::zeros(n, 3);
    let mut z = DVector::<f64>::zeros(n);
    for (i, visit) in of.iter().enumerate() {
        for (j, other) in of.iter().enumerate() {
            let block = covariance(*visit, *other);
            s.view_mut((3 * i, 3 * j), (3, 3)).copy_from(&block);
        }
        for axis in 0..3 {
            // Each time the tip is put on the point anew, to a millimetre.
            s[(3 * i + axis, 3 * i + axis)] += 1e-6;
            a[(3 * i + axis, axis)] = 1.0;
            z[3 * i + axis] = visits[*visit].p_n_m[axis];
        }
    }
    let Some(inverse) = s.cholesky().map(|factor| factor.inverse()) else { return first };
    let normal = a.transpose() * &inverse * &a;
    let Some(of_mean) = normal.try_inverse() else { return first };
    let mean = &of_mean * a.transpose() * inverse * z;
    (Vector3::new(mean[0], mean[1], mean[2]), Matrix3::from_fn(|r, c| of_mean[(r, c)]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn visits() -> (Vec<Stop>, Vec<VisitOfPoint>) {
        let stop = |t: i64| Stop { name: "T".to_owned(), t_start_ns: t, t_end_ns: t + 5 };
        let visit = |stop: usize, x: f64| VisitOfPoint {
            stop,
            p_n_m: Vector3::new(x, 0.0, 0.0),
            stood: true,
            moved_m: 0.0,
            tilt_rad: 0.1,
        };
        (vec![stop(0), stop(100)], vec![visit(0, 0.0), visit(1, 0.3)])
    }

    #[test]
    fn the_surer_of_two_visits_counts_for_more() {
        let (stops, visits) = visits();
        let variances = [0.01, 0.04];
        let points = combine(&stops, &visits, |a, b| {
            if a == b { Matrix3::identity() * variances[a] } else { Matrix3::zeros() }
        });
        let [point] = &points[..] else { panic!("{points:?}") };
        assert!((point.p_n_m.x - 0.06).abs() < 1e-4, "{}", point.p_n_m.x);
        assert!((point.covariance_n_m2[(0, 0)] - 0.008).abs() < 1e-5);
        assert!((point.apart_m - 0.3).abs() < 1e-12 && point.visits.len() == 2);
    }

    #[test]
    fn what_two_visits_err_alike_in_does_not_become_less_by_their_mean() {
        let (stops, visits) = visits();
        let points = combine(&stops, &visits, |a, b| Matrix3::identity() * if a == b { 0.05 } else { 0.04 });
        assert!((points[0].covariance_n_m2[(0, 0)] - 0.045).abs() < 1e-5);
    }
}
