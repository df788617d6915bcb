//! What goes wrong with the demo's sensors, so that the map has an anomaly to show.

use lodestep_engine::sample::ImuSample;
use lodestep_engine::sim::pedestrian::MarkerVisit;

/// The stop during which the link to the right sensor fails, counted from 0.
const AT_STOP: usize = 1;
/// How long it fails, ns. The inspector stands, so the track does not suffer.
const DROPOUT_NS: i64 = 900_000_000;

/// Samples that are lost between a sensor and its device.
pub(super) struct Trouble {
    from_ns: i64,
    to_ns: i64,
}

impl Trouble {
    /// A dropout in the middle of an early stop of this walk.
    pub(super) fn during(visits: &[MarkerVisit]) -> Trouble {
        let from_ns = visits.get(AT_STOP).map_or(i64::MAX, |visit| (visit.t_start_ns + visit.t_end_ns) / 2);
        Trouble { from_ns, to_ns: from_ns.saturating_add(DROPOUT_NS) }
    }

    /// Takes out what is lost.
    pub(super) fn befall(&self, samples: &mut Vec<ImuSample>) {
        samples.retain(|sample| !(self.from_ns..self.to_ns).contains(&sample.t_ns));
    }
}
