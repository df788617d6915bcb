//! Automatic mode: which stands are so nearly certain that they are taken for visits.

use super::tuning::Identification;
use crate::event::Stand;
use crate::visit::Visit;

/// Visits are keyed in by hand: their times may miss the stand by this much, ns.
pub(super) const SLACK_NS: i64 = 2_000_000_000;

/// The visits that a walk's stands amount to, as far as they are nearly certain by all that is known
/// now; not where somebody keyed one in, or took one back.
pub fn automatic_visits(stands: &[Stand], identification: &Identification) -> Vec<Visit> {
    let keyed = |stand: &Stand| stand.visit.as_ref().is_some_and(|visit| !visit.automatic);
    stands
        .iter()
        .filter(|stand| !keyed(stand))
        .filter_map(|stand| nearly_certain(stand, identification))
        .collect()
}

/// The visit that is made of one stand, if there is hardly a doubt and nobody took it back.
pub(super) fn nearly_certain(stand: &Stand, identification: &Identification) -> Option<Visit> {
    let first = stand.candidates.first()?;
    let undone =
        identification.undone_ns.iter().any(|t_ns| t_ns.abs_diff(stand.t_start_ns) <= SLACK_NS as u64);
    if undone || first.probability < identification.tuning.automatic_probability {
        return None;
    }
    let name = first.marker.as_deref()?;
    let marker = identification.markers.all().iter().find(|marker| marker.name == name)?;
    Some(Visit {
        marker: marker.name.clone(),
        t_start_ns: stand.t_start_ns,
        t_end_ns: stand.t_end_ns,
        position_n_m: marker.position_n_m,
    })
}

/// Whether a time belongs to a stand; while that lasts, every later one does: its end is not known.
pub(super) fn holds(stand: &Stand, t_ns: i64) -> bool {
    t_ns >= stand.t_start_ns - SLACK_NS && (stand.lasts || t_ns <= stand.t_end_ns + SLACK_NS)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::event::{MarkerCandidate, StandVisit};
    use crate::identify::Marker;

    #[test]
    fn only_what_is_nearly_certain_and_neither_keyed_nor_undone_is_taken() {
        let stand = |number: u32, probability: f64| Stand {
            number,
            t_start_ns: i64::from(number) * 100_000_000_000,
            t_end_ns: i64::from(number) * 100_000_000_000 + 5_000_000_000,
            lasts: false,
            position_n_m: [0.0; 3],
            candidates: vec![
                MarkerCandidate { marker: Some("A1".into()), probability, distance_m: Some(0.0) },
                MarkerCandidate { marker: None, probability: 1.0 - probability, distance_m: None },
            ],
            visit: None,
        };
        let mut keyed = stand(3, 0.999);
        keyed.visit = Some(StandVisit { marker: "A2".into(), automatic: false });
        let identification = Identification {
            markers: Arc::new(vec![Marker { name: "A1".into(), position_n_m: (1.0, 2.0, None) }].into()),
            undone_ns: vec![201_000_000_000],
            ..Identification::default()
        };
        let stands = [stand(1, 0.999), stand(2, 0.999), keyed, stand(4, 0.9)];
        let visits = automatic_visits(&stands, &identification);
        assert_eq!(visits.len(), 1, "{visits:?}");
        assert_eq!((visits[0].t_start_ns, visits[0].position_n_m), (100_000_000_000, (1.0, 2.0, None)));
    }

    #[test]
    fn the_middle_of_a_visit_may_come_after_the_stand_was_first_told() {
        let mut stand = Stand {
            number: 1,
            t_start_ns: 100_000_000_000,
            t_end_ns: 104_000_000_000,
            lasts: true,
            position_n_m: [0.0; 3],
            candidates: Vec::new(),
            visit: None,
        };
        assert!(holds(&stand, 120_000_000_000) && !holds(&stand, 90_000_000_000));
        stand.lasts = false;
        assert!(holds(&stand, 105_000_000_000) && !holds(&stand, 120_000_000_000));
    }
}
