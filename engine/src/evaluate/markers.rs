//! How good candidates are: how often the right marker is first, and whether the probabilities come true.

use crate::event::Stand;

/// Bounds of the bins into which stated probabilities are sorted.
const BIN_BOUNDS: [f64; 8] = [0.0, 0.05, 0.15, 0.35, 0.65, 0.85, 0.95, 1.000_001];

/// Candidates that were told with about the same probability.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CalibrationBin {
    /// How many.
    pub candidates: u64,
    /// Sum of their probabilities.
    pub stated: f64,
    /// How many were right.
    pub right: u64,
}

/// The score of many stands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MarkerScore {
    /// Stands at a marker.
    pub at_marker: u64,
    /// Of these, with the right marker first.
    pub right_first: u64,
    /// Stands at no marker.
    pub elsewhere: u64,
    /// Of these, with "none of them" first.
    pub none_first: u64,
    /// By stated probability, the bounds being 0, 0.05, 0.15, 0.35, 0.65, 0.85, 0.95 and 1.
    pub bins: [CalibrationBin; BIN_BOUNDS.len() - 1],
    /// Visits that were made automatically.
    pub automatic: u64,
    /// Of these, the wrong ones.
    pub automatic_wrong: u64,
}

impl MarkerScore {
    /// Takes a stand of which it is known where it truly was (`None`: at no marker).
    pub fn take(&mut self, stand: &Stand, truth: Option<&str>) {
        let first = stand.candidates.iter().max_by(|a, b| a.probability.total_cmp(&b.probability));
        let is_named =
            stand.candidates.iter().any(|other| other.marker.is_some() && other.marker.as_deref() == truth);
        if truth.is_some() {
            self.at_marker += 1;
            let right = first.is_some_and(|first| first.marker.as_deref() == truth);
            self.right_first += u64::from(right);
        } else {
            self.elsewhere += 1;
            self.none_first += u64::from(first.is_some_and(|first| first.marker.is_none()));
        }
        for candidate in &stand.candidates {
            let right = match &candidate.marker {
                Some(name) => Some(name.as_str()) == truth,
                None => !is_named,
            };
            let bin = BIN_BOUNDS.partition_point(|bound| *bound <= candidate.probability);
            let bin = &mut self.bins[bin.clamp(1, self.bins.len()) - 1];
            bin.candidates += 1;
            bin.stated += candidate.probability;
            bin.right += u64::from(right);
        }
        if let Some(visit) = stand.visit.as_ref().filter(|visit| visit.automatic) {
            self.automatic += 1;
            self.automatic_wrong += u64::from(Some(visit.marker.as_str()) != truth);
        }
    }

    /// Adds another score to this one.
    pub fn add(&mut self, other: &MarkerScore) {
        self.at_marker += other.at_marker;
        self.right_first += other.right_first;
        self.elsewhere += other.elsewhere;
        self.none_first += other.none_first;
        self.automatic += other.automatic;
        self.automatic_wrong += other.automatic_wrong;
        for (mine, theirs) in self.bins.iter_mut().zip(&other.bins) {
            mine.candidates += theirs.candidates;
            mine.stated += theirs.stated;
            mine.right += theirs.right;
        }
    }

    /// The share of stands at a marker that had it first, %.
    pub fn right_first_percent(&self) -> f64 {
        100.0 * self.right_first as f64 / self.at_marker.max(1) as f64
    }

    /// Largest distance between what was stated and what came true, in points of a hundred, over the
    /// bins of at least so many candidates.
    pub fn largest_miscalibration(&self, at_least: u64) -> f64 {
        let bins = self.bins.iter().filter(|bin| bin.candidates >= at_least.max(1));
        bins.map(|bin| 100.0 * (bin.stated - bin.right as f64).abs() / bin.candidates as f64)
            .fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::{MarkerCandidate, StandVisit};

    #[test]
    fn stands_are_counted_by_what_was_first_and_by_what_was_stated() {
        let candidate = |marker: Option<&str>, probability| MarkerCandidate {
            marker: marker.map(str::to_owned),
            probability,
            distance_m: None,
        };
        let stand = Stand {
            number: 1,
            t_start_ns: 0,
            t_end_ns: 0,
            lasts: false,
            position_n_m: [0.0; 3],
            candidates: vec![candidate(Some("A1"), 0.7), candidate(Some("A2"), 0.2), candidate(None, 0.1)],
            visit: Some(StandVisit { marker: "A1".into(), automatic: true }),
        };
        let mut score = MarkerScore::default();
        for truth in [Some("A1"), Some("A1"), Some("A2"), Some("A3"), None] {
            score.take(&stand, truth);
        }
        assert_eq!((score.at_marker, score.right_first, score.elsewhere, score.none_first), (4, 2, 1, 0));
        assert_eq!((score.automatic, score.automatic_wrong), (5, 3));
        assert_eq!((score.bins[4].candidates, score.bins[4].right), (5, 2));
        assert_eq!(
            (score.bins[1].candidates, score.bins[1].right),
            (5, 2),
            "a marker that was not named is none of them"
        );
        assert!((score.largest_miscalibration(1) - 30.0).abs() < 1e-9, "{score:?}");
    }
}
