//! What turns the places of a file into those of the table: a shift, a turn, a scale, a mirror. A wrong
//! origin, changed axes, feet for metres or another grid's north show in all rows alike.

use crate::store::markers::Place;

/// Rows that are needed to say anything of all.
const LEAST_PAIRS: usize = 4;
/// The fit has to explain this share of the difference.
const EXPLAINED: f64 = 0.8;

/// The similarity that explains the difference of two sets of places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fit {
    /// Whether east and north run the other way round; then a turn by 90° is a change of the two.
    pub(super) mirrored: bool,
    /// Length in the table for length in the file.
    pub(super) scale: f64,
    /// Turn, anticlockwise, degrees in (−180, 180].
    pub(super) turn_deg: f64,
    /// By how much the middle of the file's places is off: east and north, m.
    pub(super) shift_m: [f64; 2],
}

/// The fit of `(file, table)` places, where it makes them agree that did not: their typical distance is
/// above `tolerance_m` without it, and at most a fifth of that with it.
pub(super) fn explain(pairs: &[(Place, Place)], tolerance_m: f64) -> Option<Fit> {
    if pairs.len() < LEAST_PAIRS {
        return None;
    }
    let before = median(pairs.iter().map(|(file, table)| file.plan_distance_m(table)).collect());
    if before <= tolerance_m {
        return None;
    }
    [false, true]
        .into_iter()
        .filter_map(|mirrored| {
            let points: Vec<_> = pairs
                .iter()
                .map(|(file, table)| {
                    let n = if mirrored { -file.n_m } else { file.n_m };
                    ([file.e_m, n], [table.e_m, table.n_m])
                })
                .collect();
            let (turn, from, to) = robust(&points)?;
            let after = median(points.iter().map(|point| off(point, &turn, from, to)).collect());
            let [a, b] = turn;
            // The middle of the file is compared as it stands in the file.
            let from = if mirrored { [from[0], -from[1]] } else { from };
            let fit = Fit {
                mirrored,
                scale: a.hypot(b),
                turn_deg: b.atan2(a).to_degrees(),
                shift_m: [from[0] - to[0], from[1] - to[1]],
            };
            (after <= (1.0 - EXPLAINED) * before).then_some((after, fit))
        })
        .min_by(|(a, _), (b, _)| a.total_cmp(b))
        .map(|(_, fit)| fit)
}

type Point = ([f64; 2], [f64; 2]);

/// Turn and scale as a complex number, and the two middles, by least squares, of the seven tenths of the
/// points that agree best: a few markers that really moved must not hide what all have in common.
fn robust(points: &[Point]) -> Option<([f64; 2], [f64; 2], [f64; 2])> {
    let mut kept: Vec<Point> = points.to_vec();
    let mut fit = least_squares(&kept)?;
    for _ in 0..3 {
        let mut all: Vec<_> = points.iter().map(|point| (off(point, &fit.0, fit.1, fit.2), *point)).collect();
        all.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        kept = all.into_iter().take((points.len() * 7).div_ceil(10)).map(|(_, point)| point).collect();
        fit = least_squares(&kept)?;
    }
    Some(fit)
}

fn least_squares(points: &[Point]) -> Option<([f64; 2], [f64; 2], [f64; 2])> {
    let count = points.len() as f64;
    let mut middles = [[0.0; 2]; 2];
    for (from, to) in points {
        for axis in 0..2 {
            middles[0][axis] += from[axis] / count;
            middles[1][axis] += to[axis] / count;
        }
    }
    let [from_middle, to_middle] = middles;
    let (mut along, mut across, mut size) = (0.0, 0.0, 0.0);
    for (from, to) in points {
        let [x, y] = [from[0] - from_middle[0], from[1] - from_middle[1]];
        let [u, v] = [to[0] - to_middle[0], to[1] - to_middle[1]];
        along += x * u + y * v;
        across += x * v - y * u;
        size += x * x + y * y;
    }
    (size > 0.0).then(|| ([along / size, across / size], from_middle, to_middle))
}

/// How far the fitted place is from the table's, m.
fn off((from, to): &Point, [a, b]: &[f64; 2], from_middle: [f64; 2], to_middle: [f64; 2]) -> f64 {
    let [x, y] = [from[0] - from_middle[0], from[1] - from_middle[1]];
    let e = to_middle[0] + a * x - b * y - to[0];
    let n = to_middle[1] + b * x + a * y - to[1];
    e.hypot(n)
}

/// The value in the middle; zero of none.
pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places() -> Vec<Place> {
        (0..20)
            .map(|k| {
                let k = f64::from(k);
                Place { e_m: 40.0 * (k * 1.3).sin() + k, n_m: 30.0 * (k * 0.7).cos() - 2.0 * k, u_m: None }
            })
            .collect()
    }

    fn fit(change: impl Fn(f64, f64) -> (f64, f64)) -> Option<Fit> {
        let pairs: Vec<_> = places()
            .into_iter()
            .map(|table| {
                let (e_m, n_m) = change(table.e_m, table.n_m);
                (Place { e_m, n_m, u_m: None }, table)
            })
            .collect();
        explain(&pairs, 1.0)
    }

    #[test]
    fn what_all_rows_have_in_common_is_found() {
        assert_eq!(fit(|e, n| (e + 0.01, n)), None, "nothing to explain");
        let shifted = fit(|e, n| (e + 300.0, n - 20.0)).unwrap();
        assert!((shifted.shift_m[0] - 300.0).abs() < 1e-9 && (shifted.shift_m[1] + 20.0).abs() < 1e-9);
        assert!(!shifted.mirrored && shifted.turn_deg.abs() < 1e-9 && (shifted.scale - 1.0).abs() < 1e-9);
        let swapped = fit(|e, n| (n, e)).unwrap();
        assert!(swapped.mirrored && (swapped.turn_deg - 90.0).abs() < 1e-9);
        let feet = fit(|e, n| (e / 0.3048, n / 0.3048)).unwrap();
        assert!((feet.scale - 0.3048).abs() < 1e-9 && !feet.mirrored);
        let (sin, cos) = 5_f64.to_radians().sin_cos();
        let turned = fit(|e, n| (cos * e + sin * n, cos * n - sin * e)).unwrap();
        assert!((turned.turn_deg - 5.0).abs() < 1e-9);
    }

    #[test]
    fn a_few_that_really_moved_hide_nothing_and_many_are_no_frame() {
        let moved = fit(|e, n| if e > 40.0 { (n + 25.0, e) } else { (n, e) }).unwrap();
        assert!(moved.mirrored && (moved.turn_deg - 90.0).abs() < 1e-6);
        let scattered = fit(|e, n| (e + 30.0 * (17.0 * n).sin(), n + 30.0 * (23.0 * e).cos()));
        assert_eq!(scattered, None);
    }
}
