//! Streamed rows whose tags are ahead of the inertial sensor's: they wait until it has come so far.
//!
//! A device whose clock is seconds ahead must not carry the pose into the future, where no inertial sensor has been. Where that sensor
//! is silent nothing waits for it.

use serde::{Deserialize, Serialize};

use super::order::{AnyRow, SOURCES};

/// Rows may be ahead by so much: streams come in pieces, ns.
const AHEAD_NS: i64 = 300_000_000;
/// The inertial sensor is silent when another device's tags have gone on by so much since its last sample, ns.
const SILENT_NS: i64 = 600_000_000;
/// Rows that are farther ahead are left out, ns.
const TOO_FAR_NS: i64 = 10_000_000_000;

/// What waits.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Lead {
    imu_ns: Option<i64>,
    /// By source: its first tag since the last sample of the inertial sensor, ns.
    since_imu_ns: [Option<i64>; SOURCES],
    waiting: Vec<AnyRow>,
    told: [bool; SOURCES],
}

/// What becomes of a row.
#[derive(Debug, PartialEq)]
pub(super) enum Leads {
    /// It is weighed, after what waited for this time.
    Goes,
    /// It waits.
    Waits,
    /// It is so far ahead, ns, that it is left out; whether it is the first such row of its source.
    LeftOut { ahead_ns: i64, is_first: bool },
}

impl Lead {
    /// A row of a source; the cabin's inertial sensor is source 0.
    pub(super) fn judge(&mut self, source: usize, row: &AnyRow) -> Leads {
        let t_ns = row.t_ns();
        if source == 0 {
            self.imu_ns = Some(self.imu_ns.map_or(t_ns, |imu_ns| imu_ns.max(t_ns)));
            self.since_imu_ns = [None; SOURCES];
            return Leads::Goes;
        }
        let Some(imu_ns) = self.imu_ns else { return Leads::Goes };
        let since_ns = *self.since_imu_ns[source].get_or_insert(t_ns);
        let ahead_ns = t_ns - imu_ns;
        if ahead_ns <= AHEAD_NS {
            return Leads::Goes;
        }
        if t_ns - since_ns > SILENT_NS && since_ns - imu_ns <= AHEAD_NS {
            return Leads::Goes;
        }
        if ahead_ns > TOO_FAR_NS {
            let is_first = !std::mem::replace(&mut self.told[source], true);
            return Leads::LeftOut { ahead_ns, is_first };
        }
        self.waiting.push(*row);
        Leads::Waits
    }

    /// The rows that waited for a time, in the order in which they came.
    pub(super) fn due(&mut self, t_ns: i64) -> Vec<AnyRow> {
        if self.waiting.is_empty() {
            return Vec::new();
        }
        self.waiting.extract_if(.., |row| row.t_ns() <= t_ns).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::systems::cabin::rows::{AidRow, EncoderRow, ImuRow};

    fn imu(t_ns: i64) -> AnyRow {
        AnyRow::Imu(ImuRow { t_ns, w_s: [0.0; 3], f_s: [0.0; 3] })
    }

    fn legs(t_ns: i64) -> AnyRow {
        AnyRow::Aid(AidRow::Encoders(EncoderRow { t_ns, a_rad: 0.0, b_rad: 0.0, legs_m: [2.0; 6] }))
    }

    const MS: i64 = 1_000_000;

    #[test]
    fn a_device_whose_clock_is_ahead_waits_and_one_beside_a_silent_sensor_does_not() {
        let mut lead = Lead::default();
        for k in 0..40 {
            let t_ns = k * 50 * MS;
            assert_eq!(lead.judge(0, &imu(t_ns)), Leads::Goes);
            // Two seconds ahead.
            assert_eq!(lead.judge(2, &legs(t_ns + 2000 * MS)), Leads::Waits);
            assert!(lead.due(t_ns).is_empty());
        }
        assert_eq!(lead.due(2100 * MS).len(), 3);
        // The sensor is silent from here on.
        let mut lead = Lead::default();
        assert_eq!(lead.judge(0, &imu(0)), Leads::Goes);
        let judged: Vec<Leads> = (0..40).map(|k| lead.judge(2, &legs(k * 50 * MS))).collect();
        assert_eq!(judged.iter().filter(|one| **one == Leads::Waits).count(), 6, "{judged:?}");
        assert_eq!(judged.last(), Some(&Leads::Goes));
        assert_eq!(lead.due(1000 * MS).len(), 6);
    }

    #[test]
    fn rows_that_are_ahead_by_more_than_seconds_are_left_out_and_told_once() {
        let mut lead = Lead::default();
        let _ = lead.judge(0, &imu(0));
        let ahead_ns = 18_000 * MS;
        assert_eq!(lead.judge(3, &legs(ahead_ns)), Leads::LeftOut { ahead_ns, is_first: true });
        assert_eq!(lead.judge(3, &legs(ahead_ns)), Leads::LeftOut { ahead_ns, is_first: false });
    }
}
