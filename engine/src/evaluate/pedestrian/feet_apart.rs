//! How far apart a track puts the two feet: nobody's are two metres apart.

use serde::Serialize;

use crate::event::TrackPoint;

/// Distances between the feet in plan.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FeetApart {
    /// At the end, m.
    pub at_end_m: f64,
    /// The largest, m.
    pub largest_m: f64,
}

/// Judges a track of two feet; `None` of one.
pub fn feet_apart(points: &[TrackPoint]) -> Option<FeetApart> {
    let apart_m = |point: &TrackPoint| {
        let (left, right) = (point.parts[0]?.position_n_m, point.parts[1]?.position_n_m);
        Some(libm::hypot(left[0] - right[0], left[1] - right[1]))
    };
    Some(FeetApart {
        at_end_m: points.iter().rev().find_map(apart_m)?,
        largest_m: points.iter().filter_map(apart_m).fold(0.0, f64::max),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::tests::points;
    use crate::event::Part;

    #[test]
    fn height_does_not_count() {
        let mut track = points([[0.0; 3]; 3]);
        assert_eq!(feet_apart(&track), None);
        for (point, e) in track.iter_mut().zip([0.3, 0.9, 0.25]) {
            point.parts[0] = Some(Part { position_n_m: [0.0, 0.0, 5.0], stance: true });
            point.parts[1] = Some(Part { position_n_m: [e, 0.0, 0.0], stance: true });
        }
        assert_eq!(feet_apart(&track), Some(FeetApart { at_end_m: 0.25, largest_m: 0.9 }));
    }
}
