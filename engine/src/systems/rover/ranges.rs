//! A range from a tag to an anchor: length, direction and bend (paper 5, (8)–(10), and the second order that it leaves out).

/// A range as it is linearised at a position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Length, m.
    pub range_m: f64,
    /// Its derivative by the tag's position: the unit vector from the anchor to the tag.
    pub unit_n: [f64; 3],
}

/// Nearer than this to an anchor a range has no direction, m.
const NEAREST_M: f64 = 0.05;

/// The range from a tag to an anchor; both in one frame, m.
pub fn line(tag_n: &[f64; 3], anchor_n: &[f64; 3]) -> Line {
    let d: [f64; 3] = std::array::from_fn(|k| tag_n[k] - anchor_n[k]);
    let range_m = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
    let over = range_m.max(NEAREST_M);
    Line { range_m, unit_n: d.map(|x| x / over) }
}

/// What the bend of a range adds to a linearised one, for a position that is uncertain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bend {
    /// To its mean, ½ tr(B P), m.
    pub mean_m: f64,
    /// To its variance, ½ tr(B P B P), m².
    pub variance_m2: f64,
}

/// The second-order term of a range (the Hessian is B = (I − u uᵀ) / r) for a covariance of the tag's position, m².
pub fn bend(line: &Line, covariance: &[[f64; 3]; 3]) -> Bend {
    let over = line.range_m.max(NEAREST_M);
    let u = line.unit_n;
    let hessian: [[f64; 3]; 3] =
        std::array::from_fn(|i| std::array::from_fn(|j| (f64::from(u8::from(i == j)) - u[i] * u[j]) / over));
    let bp: [[f64; 3]; 3] = std::array::from_fn(|i| {
        std::array::from_fn(|j| (0..3).map(|k| hessian[i][k] * covariance[k][j]).sum())
    });
    let trace: f64 = (0..3).map(|k| bp[k][k]).sum();
    let mut square = 0.0;
    for (i, row) in bp.iter().enumerate() {
        for (j, value) in row.iter().enumerate() {
            square += value * bp[j][i];
        }
    }
    Bend { mean_m: 0.5 * trace, variance_m2: 0.5 * square }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_derivative_of_a_range_is_its_difference_quotient() {
        let anchor = [3.0, -2.0, 1.5];
        let at = [10.0, 4.0, -1.0];
        let line0 = line(&at, &anchor);
        for k in 0..3 {
            let h = 1e-5;
            let (mut up, mut down) = (at, at);
            up[k] += h;
            down[k] -= h;
            let quotient = (line(&up, &anchor).range_m - line(&down, &anchor).range_m) / (2.0 * h);
            assert!((quotient - line0.unit_n[k]).abs() < 1e-8, "{k}: {quotient}");
        }
    }

    #[test]
    fn the_bend_is_what_many_positions_show() {
        // A tag 4 m from the anchor, 1.5 m unsure across and 0.2 m along.
        let anchor = [0.0; 3];
        let at = [4.0, 0.0, 0.0];
        let covariance = [[0.04, 0.0, 0.0], [0.0, 2.25, 0.0], [0.0, 0.0, 0.0]];
        let told = bend(&line(&at, &anchor), &covariance);
        // Gauss–Hermite in the across direction, five points.
        let points = [
            (0.0, 8.0 / 15.0),
            (1.355_626_179_974_266, 0.222_075_922_005_612_6),
            (2.856_970_013_872_806, 0.011_257_411_327_720_69),
        ];
        let mean: f64 = points
            .iter()
            .map(|(z, w)| {
                let both = if *z == 0.0 { 1.0 } else { 2.0 };
                both * w * line(&[4.0, 1.5 * z, 0.0], &anchor).range_m
            })
            .sum::<f64>()
            - 4.0;
        assert!((told.mean_m - 2.25 / 8.0).abs() < 1e-12);
        assert!((told.mean_m - mean).abs() < 0.05, "{} {mean}", told.mean_m);
        assert!((told.variance_m2 - 0.5 * (2.25 / 4.0) * (2.25 / 4.0)).abs() < 1e-12);
    }
}
