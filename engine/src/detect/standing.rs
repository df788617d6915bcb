//! Somebody who stands: all parts on the ground for longer than walking ever has them there.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::event::TrackPoint;

/// After so long it is a stand, ns: well above the moments with both feet down in a slow walk.
const STAND_NS: i64 = 4_000_000_000;
/// A part that is taken to move for less than this has not moved, ns: a shift of weight.
const TWITCH_NS: i64 = 300_000_000;
/// Who has gone less far than this since the last stand still stands there, m; and who has not gone
/// so far since the session began is in the standing start.
const SAME_PLACE_M: f64 = 2.0;

/// What a point means for standing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Standing {
    /// Nothing new.
    Nothing,
    /// By now it is a stand; it began at this time.
    Begun {
        /// When the parts came to rest, ns.
        t_start_ns: i64,
    },
    /// The stand is over; the parts stood until this time.
    Ended {
        /// When the first part lifted, ns.
        t_end_ns: i64,
    },
}

/// Watches the points of one session.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct StandingDetector {
    /// Since when all parts stand, and until when they were last seen to, ns.
    still: Option<(i64, i64)>,
    stands: bool,
    /// Where the last stand, or the start, was.
    last_place_n_m: Option<Vector3<f64>>,
}

impl StandingDetector {
    /// Takes the next point.
    pub(crate) fn take(&mut self, point: &TrackPoint) -> Standing {
        let position_n_m = Vector3::from(point.position_n_m);
        let last_place_n_m = *self.last_place_n_m.get_or_insert(position_n_m);
        let mut parts = point.parts.iter().flatten().peekable();
        let all_stand = parts.peek().is_some() && parts.all(|part| part.stance);
        let (since_ns, seen_ns) = match (self.still, all_stand) {
            (None, false) => return Standing::Nothing,
            (None, true) => (point.t_ns, point.t_ns),
            (Some((since_ns, _)), true) => (since_ns, point.t_ns),
            (Some(still), false) => still,
        };
        if point.t_ns - seen_ns > TWITCH_NS {
            self.still = None;
            if std::mem::take(&mut self.stands) {
                return Standing::Ended { t_end_ns: seen_ns };
            }
            return Standing::Nothing;
        }
        self.still = Some((since_ns, seen_ns));
        if self.stands || !all_stand || seen_ns - since_ns < STAND_NS {
            return Standing::Nothing;
        }
        if (position_n_m - last_place_n_m).xy().norm() < SAME_PLACE_M {
            return Standing::Nothing;
        }
        self.stands = true;
        self.last_place_n_m = Some(position_n_m);
        Standing::Begun { t_start_ns: since_ns }
    }

    /// The track was moved by a correction.
    pub(crate) fn shift(&mut self, by_n_m: &Vector3<f64>) {
        if let Some(place) = &mut self.last_place_n_m {
            *place += by_n_m;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::Part;

    fn point(t_ms: i64, e_m: f64, stance: bool) -> TrackPoint {
        let part = Some(Part { position_n_m: [e_m, 0.0, 0.0], stance });
        TrackPoint {
            t_ns: t_ms * 1_000_000,
            position_n_m: [e_m, 0.0, 0.0],
            heading_rad: 0.0,
            sigma_heading_rad: 0.0,
            sigma_n_m: [0.0; 3],
            covariance_en_m2: 0.0,
            tilt: None,
            parts: [part; 2],
        }
    }

    /// Walks to `e_m` and stands there for some seconds; what was found, in order.
    fn found(legs: &[(f64, i64)]) -> Vec<Standing> {
        let mut detector = StandingDetector::default();
        let (mut t_ms, mut all) = (0, Vec::new());
        let mut push = |t_ms: i64, e_m: f64, stance: bool| match detector.take(&point(t_ms, e_m, stance)) {
            Standing::Nothing => {}
            told => all.push(told),
        };
        for &(e_m, stands_s) in legs {
            for _ in 0..100 {
                push(t_ms, e_m, false);
                t_ms += 10;
            }
            for _ in 0..stands_s * 100 {
                // A twitch now and then.
                push(t_ms, e_m, t_ms % 1_500 >= 100);
                t_ms += 10;
            }
        }
        push(t_ms + 1_000, 0.0, false);
        all
    }

    #[test]
    fn a_stand_is_found_once_and_ends_when_a_part_lifts() {
        let all = found(&[(0.0, 10), (20.0, 10), (21.0, 10), (40.0, 3), (60.0, 8)]);
        assert_eq!(all.len(), 4, "the start, the shuffle and the short stop are none: {all:?}");
        assert!(
            matches!(all[0], Standing::Begun { t_start_ns } if t_start_ns / 1_000_000_000 == 12),
            "{all:?}"
        );
        assert!(matches!(all[1], Standing::Ended { t_end_ns } if t_end_ns / 100_000_000 == 219), "{all:?}");
    }
}
