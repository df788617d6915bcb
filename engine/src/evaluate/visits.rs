//! How far off the track was when it came to a marker, before it was corrected: paper 1's measure.

use serde::Serialize;

use crate::evaluate::statistics::Spread;
use crate::event::VisitOutcome;

/// Errors before correction, over all visits that could be compared, used or not.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct VisitErrors {
    /// Distance in plan.
    pub horizontal: Spread,
    /// How many were used.
    pub accepted: usize,
}

/// Judges visits; `None` of none.
pub fn visits(visits: &[VisitOutcome]) -> Option<VisitErrors> {
    let distances: Vec<f64> = visits
        .iter()
        .map(|visit| libm::hypot(visit.before_minus_marker_n_m[0], visit.before_minus_marker_n_m[1]))
        .filter(|distance| distance.is_finite())
        .collect();
    Some(VisitErrors {
        horizontal: Spread::of(&distances)?,
        accepted: visits.iter().filter(|visit| visit.accepted).count(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn height_does_not_count() {
        let visit = |e, n, accepted| VisitOutcome {
            marker: String::new(),
            t_ns: 0,
            before_minus_marker_n_m: [e, n, 100.0],
            after_minus_marker_n_m: [0.0; 3],
            nis: 0.0,
            degrees_of_freedom: 3,
            accepted,
            reason: String::new(),
        };
        let errors =
            visits(&[visit(3.0, 4.0, true), visit(0.0, 1.0, false), visit(f64::NAN, 0.0, false)]).unwrap();
        assert_eq!((errors.horizontal.mean_m, errors.horizontal.max_m), (3.0, 5.0));
        assert_eq!((errors.horizontal.count, errors.accepted), (2, 1));
        assert_eq!(visits(&[]), None);
    }
}
