//! What a run of the rover came to, as JSON.

use lodestep_engine::systems::rover::computation::Done;
use lodestep_engine::systems::rover::row::Quality;
use serde_json::{Map, Value, json};

/// What the report says.
pub(super) struct Report<'a> {
    pub(super) done: &'a Done,
    pub(super) process_seconds: f64,
    pub(super) anomalies: &'a [String],
    pub(super) estimator: &'static str,
    pub(super) solution: &'static str,
}

impl Report<'_> {
    /// What was done, for the person who typed the command.
    pub(super) fn sentence(&self, out: &std::path::Path) -> String {
        let counts: Vec<String> = Quality::ALL
            .iter()
            .filter_map(|quality| {
                let count = self.done.rows.iter().filter(|row| row.quality == *quality).count();
                (count > 0).then(|| format!("{count} {}", quality.word()))
            })
            .collect();
        format!(
            "{} epochs in {:.2} s: {}; track in {}",
            self.done.rows.len(),
            self.process_seconds,
            counts.join(", "),
            out.display()
        )
    }

    /// The report as JSON.
    pub(super) fn json(&self, track_sha256: &str) -> Value {
        let mut by_quality = Map::new();
        for quality in Quality::ALL {
            let count = self.done.rows.iter().filter(|row| row.quality == quality).count();
            by_quality.insert(quality.word().to_owned(), count.into());
        }
        let anchors: Vec<Value> = self
            .done
            .anchors
            .iter()
            .map(|line| {
                json!({
                    "anchor": line.anchor,
                    "bias_m": rounded(line.bias_m, 1e4),
                    "sigma_m": rounded(line.sigma_m, 1e4),
                    "used": line.used,
                    "rejected": line.rejected,
                })
            })
            .collect();
        let mut report = json!({
            "epochs": self.done.rows.len(),
            "process_seconds": rounded(self.process_seconds, 1e6),
            "estimator": self.estimator,
            "solution": self.solution,
            "quality": by_quality.clone(),
            "slips": self.done.slips,
            "ranges_rejected": self.done.anchors.iter().map(|line| line.rejected).sum::<usize>(),
            "anchors": anchors,
            "uwb_clock_offset_s": self.done.clock_offset_s.map(|[offset, _]| rounded(offset, 1e5)),
            "uwb_clock_offset_sigma_s": self.done.clock_offset_s.map(|[_, sigma]| rounded(sigma, 1e5)),
            "anomalies": self.anomalies,
            "track_sha256": track_sha256,
        });
        if let Some(report) = report.as_object_mut() {
            report.append(&mut by_quality);
        }
        report
    }
}

fn rounded(value: f64, parts: f64) -> f64 {
    (value * parts).round() / parts
}
