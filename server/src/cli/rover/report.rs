//! What a run of the rover came to, as JSON.

use lodestep_engine::systems::rover::row::{Quality, Row};
use serde_json::{Map, Value, json};

/// An anchor's part of the report.
pub(super) struct AnchorLine {
    pub(super) anchor: String,
    pub(super) bias_m: f64,
    pub(super) sigma_m: f64,
    pub(super) used: u64,
    pub(super) rejected: u64,
}

/// What the report says.
pub(super) struct Report<'a> {
    pub(super) rows: &'a [Row],
    pub(super) process_seconds: f64,
    pub(super) slips: usize,
    pub(super) anchors: Vec<AnchorLine>,
    pub(super) uwb_clock_offset_s: Option<[f64; 2]>,
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
                let count = self.rows.iter().filter(|row| row.quality == *quality).count();
                (count > 0).then(|| format!("{count} {}", quality.word()))
            })
            .collect();
        format!(
            "{} epochs in {:.2} s: {}; track in {}",
            self.rows.len(),
            self.process_seconds,
            counts.join(", "),
            out.display()
        )
    }

    /// The report as JSON.
    pub(super) fn json(&self) -> Value {
        let mut by_quality = Map::new();
        for quality in Quality::ALL {
            let count = self.rows.iter().filter(|row| row.quality == quality).count();
            by_quality.insert(quality.word().to_owned(), count.into());
        }
        let anchors: Vec<Value> = self
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
            "epochs": self.rows.len(),
            "process_seconds": rounded(self.process_seconds, 1e6),
            "estimator": self.estimator,
            "solution": self.solution,
            "quality": by_quality.clone(),
            "slips": self.slips,
            "ranges_rejected": self.anchors.iter().map(|line| line.rejected).sum::<u64>(),
            "anchors": anchors,
            "uwb_clock_offset_s": self.uwb_clock_offset_s.map(|[offset, _]| rounded(offset, 1e5)),
            "uwb_clock_offset_sigma_s": self.uwb_clock_offset_s.map(|[_, sigma]| rounded(sigma, 1e5)),
            "anomalies": self.anomalies,
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
