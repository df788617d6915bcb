//! What a simulated inspector tells on the way: the numbers of visited actuators, and findings.

use lodestep_engine::parse::live_message::{DeviceMessage, FaultMessage, VisitMessage};
use lodestep_engine::sim::pedestrian::MarkerVisit;

/// How long after leaving a marker its number is keyed in, ns.
const KEYED_IN_AFTER_NS: i64 = 4_000_000_000;
/// At every which stop there is something to report.
const FINDING_EVERY: usize = 3;

/// Something that is wrong with an actuator.
struct Finding {
    kind: &'static str,
    severity: &'static str,
    text: &'static str,
    /// Whether the inspector names the actuator, or leaves it to the server to say which it may be.
    named: bool,
}

/// Invented classes of findings; the site's own are not public.
const FINDINGS: [Finding; 6] = [
    Finding { kind: "hydraulic_leak", severity: "high", text: "oil below the cylinder (demo)", named: true },
    Finding {
        kind: "communication_loss",
        severity: "medium",
        text: "no answer on the bus (demo)",
        named: false,
    },
    Finding {
        kind: "tie_down_cable_wear",
        severity: "low",
        text: "strands worn at the clamp (demo)",
        named: true,
    },
    Finding {
        kind: "motor_over_temperature",
        severity: "medium",
        text: "72 °C at the housing (demo)",
        named: false,
    },
    Finding { kind: "anchor_bolt", severity: "low", text: "one nut loose, tightened (demo)", named: true },
    Finding {
        kind: "stroke_limit",
        severity: "medium",
        text: "stands at its upper stop (demo)",
        named: false,
    },
];

/// Messages that are still to be sent, the next one last.
pub(super) struct Diary {
    entries: Vec<(i64, DeviceMessage)>,
}

impl Diary {
    /// The diary of a walk with these stops.
    pub(super) fn new(visits: &[MarkerVisit], seed: u64) -> Diary {
        let mut entries = Vec::new();
        for (number, visit) in visits.iter().enumerate() {
            if number % FINDING_EVERY == seed as usize % FINDING_EVERY {
                let finding = &FINDINGS[(number + seed as usize) % FINDINGS.len()];
                let t_ns = (visit.t_start_ns + visit.t_end_ns) / 2;
                let fault = FaultMessage {
                    kind: finding.kind.to_owned(),
                    severity: finding.severity.to_owned(),
                    text: Some(finding.text.to_owned()),
                    marker: finding.named.then(|| visit.marker.clone()),
                    t_ns,
                };
                entries.push((t_ns, DeviceMessage::Fault(fault)));
            }
            let told = VisitMessage {
                marker: visit.marker.clone(),
                t_start_ns: visit.t_start_ns,
                t_end_ns: visit.t_end_ns,
            };
            entries.push((visit.t_end_ns + KEYED_IN_AFTER_NS, DeviceMessage::Visit(told)));
        }
        entries.sort_by_key(|(t_ns, _)| std::cmp::Reverse(*t_ns));
        Diary { entries }
    }

    /// What is to be told by this time.
    pub(super) fn due(&mut self, t_ns: i64) -> Vec<DeviceMessage> {
        let from = self.entries.partition_point(|(at_ns, _)| *at_ns > t_ns);
        self.entries.drain(from..).rev().map(|(_, message)| message).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_entry_is_told_once_and_at_its_time() {
        let stop = |number: i64| MarkerVisit {
            marker: format!("A{number}"),
            position_n_m: [0.0; 3],
            t_start_ns: number * 100_000_000_000,
            t_end_ns: number * 100_000_000_000 + 10_000_000_000,
        };
        let visits: Vec<_> = (1..=6).map(stop).collect();
        let mut diary = Diary::new(&visits, 1);
        assert!(diary.due(113_999_999_999).is_empty());
        let first = diary.due(114_000_000_000);
        assert!(matches!(&first[..], [DeviceMessage::Visit(visit)] if visit.marker == "A1"));
        let rest = diary.due(i64::MAX);
        assert_eq!(rest.len(), 5 + 2);
        assert!(diary.due(i64::MAX).is_empty());
    }
}
