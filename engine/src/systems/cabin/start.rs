//! The first pose: antennas or prisms that are seen at once are fitted by a rigid body, without those that fit no such body.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Something of the body that was seen.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Sighting {
    pub(super) t_ns: i64,
    /// The device that saw it or was seen.
    pub(super) aid: usize,
    pub(super) place_b: Vector3<f64>,
    pub(super) p_n: Vector3<f64>,
}

/// A rigid body through sightings.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    pub(super) p_n: Vector3<f64>,
    pub(super) c_nb: Matrix3<f64>,
    /// The sightings that do not fit, by their place in the list.
    pub(super) left_out: Vec<usize>,
}

/// Neither cabin nor platform leans by more than 60°: antennas read in the wrong order may fit a body upside down.
const UPRIGHT: f64 = 0.5;

/// Position and attitude of a body.
type Posed = (Vector3<f64>, Matrix3<f64>);

/// Points of one body are not farther off it than this, m.
const FITS_M: f64 = 0.06;

/// The rotation and shift that bring places of b onto points of n with the least squares (Wahba's problem, by singular values).
fn rigid(sightings: &[&Sighting]) -> Option<Posed> {
    let count = sightings.len() as f64;
    let centre = |of: fn(&Sighting) -> Vector3<f64>| -> Vector3<f64> {
        sightings.iter().map(|s| of(s)).sum::<Vector3<f64>>() / count
    };
    let (centre_b, centre_n) = (centre(|s| s.place_b), centre(|s| s.p_n));
    let mut product = Matrix3::zeros();
    for s in sightings {
        product += (s.p_n - centre_n) * (s.place_b - centre_b).transpose();
    }
    let svd = product.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let mut order: Vec<f64> = svd.singular_values.iter().copied().collect();
    order.sort_by(f64::total_cmp);
    // Points on one line say nothing of the turn about it.
    if order[1] < 0.05 {
        return None;
    }
    let smallest = svd.singular_values.imin();
    let mut sign = Matrix3::identity();
    sign[(smallest, smallest)] = (u * v_t).determinant().signum();
    let c_nb = u * sign * v_t;
    Some((centre_n - c_nb * centre_b, c_nb))
}

fn worst_m(sightings: &[&Sighting], (p_n, c_nb): &Posed) -> f64 {
    sightings.iter().map(|s| (p_n + c_nb * s.place_b - s.p_n).norm()).fold(0.0, f64::max)
}

/// The body through as many sightings as fit one; at least three, and more than half.
pub(super) fn fit(sightings: &[Sighting]) -> Option<Fit> {
    let count = sightings.len();
    if !(3..=20).contains(&count) {
        return None;
    }
    let fewest = (count / 2 + 1).max(3);
    for kept in (fewest..=count).rev() {
        let mut best: Option<(f64, u32, Posed)> = None;
        for mask in 0_u32..1 << count {
            if mask.count_ones() as usize != kept {
                continue;
            }
            let chosen: Vec<&Sighting> =
                sightings.iter().enumerate().filter(|(k, _)| mask >> k & 1 == 1).map(|(_, s)| s).collect();
            let Some(body) = rigid(&chosen).filter(|(_, c_nb)| c_nb[(2, 2)] > UPRIGHT) else { continue };
            let worst = worst_m(&chosen, &body);
            if worst < FITS_M && best.as_ref().is_none_or(|(least, _, _)| worst < *least) {
                best = Some((worst, mask, body));
            }
        }
        if let Some((_, mask, (p_n, c_nb))) = best {
            let left_out = (0..count).filter(|k| mask >> k & 1 == 0).collect();
            return Some(Fit { p_n, c_nb, left_out });
        }
    }
    None
}

impl Fit {
    /// Whether two sightings that were left out fit with their places exchanged.
    pub(super) fn are_exchanged(&self, a: &Sighting, b: &Sighting) -> bool {
        let fits = |place_b: &Vector3<f64>, p_n: &Vector3<f64>| {
            (self.p_n + self.c_nb * place_b - p_n).norm() < FITS_M
        };
        fits(&a.place_b, &b.p_n) && fits(&b.place_b, &a.p_n)
    }
}
