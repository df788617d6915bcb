//! Anomalies gathered into runs: whatever a log is like, so many rows tell of a kind on a stream, and what fills a walk is one row
//! with its share.

use std::collections::BTreeMap;

use lodestep_engine::anomaly::{Anomaly, AnomalyKind};
use lodestep_engine::stream::StreamId;

use crate::store::anomalies::Gathered;

/// Rows of a kind on a stream: what people look through. More are gathered.
pub(crate) const MOST_ROWS: usize = 20;

/// Gathers what a whole walk was found to have. Of a kind of which there are many on a stream, those that lie nearest to each other
/// in time are one, so that where the kind came and where it did not can still be seen.
pub(crate) fn gathered(found: Vec<Anomaly>) -> Vec<Gathered> {
    let mut kinds: BTreeMap<(AnomalyKind, Option<StreamId>), Vec<Anomaly>> = BTreeMap::new();
    for anomaly in found {
        kinds.entry((anomaly.kind, anomaly.stream)).or_default().push(anomaly);
    }
    let mut rows: Vec<Gathered> = kinds.into_values().flat_map(runs).collect();
    rows.sort_by_key(|row| (row.found.t_start_ns, row.found.kind, row.found.stream));
    rows
}

/// Those of one kind on one stream.
fn runs(mut found: Vec<Anomaly>) -> Vec<Gathered> {
    found.sort_by_key(|anomaly| anomaly.t_start_ns);
    let mut rows: Vec<Gathered> = Vec::new();
    for (anomaly, begins) in
        begins_a_run(&found).into_iter().enumerate().map(|(at, begins)| (&found[at], begins))
    {
        match rows.last_mut() {
            Some(run) if !begins => add(run, anomaly),
            _ => rows.push(Gathered { found: anomaly.clone(), times: 1 }),
        }
    }
    let [first_ns, last_ns] =
        [found.first().map(|first| first.t_start_ns), found.iter().map(|a| a.t_end_ns).max()]
            .map(Option::unwrap_or_default);
    for run in rows.iter_mut().filter(|run| run.times > 1) {
        run.found.detail = in_words(run, (first_ns, last_ns));
    }
    rows
}

/// Of each, whether a run begins with it: where the time since the one before is among the longest.
fn begins_a_run(found: &[Anomaly]) -> Vec<bool> {
    let mut begins = vec![found.len() <= MOST_ROWS; found.len()];
    if found.len() > MOST_ROWS {
        let mut between: Vec<(i64, usize)> = found
            .windows(2)
            .enumerate()
            .map(|(at, pair)| (pair[1].t_start_ns.saturating_sub(pair[0].t_end_ns), at + 1))
            .collect();
        between.sort_unstable_by_key(|&(gap_ns, at)| (std::cmp::Reverse(gap_ns), at));
        // As regular as a clock: one run, not twenty cut at random.
        let regular = between
            .first()
            .zip(between.get(between.len() / 2))
            .is_some_and(|(longest, median)| longest.0 <= median.0.saturating_mul(3));
        let runs = if regular { 0 } else { MOST_ROWS - 1 };
        between.iter().take(runs).for_each(|&(_, at)| begins[at] = true);
    }
    begins
}

/// Takes one into a run.
fn add(run: &mut Gathered, anomaly: &Anomaly) {
    run.times += 1;
    run.found.t_end_ns = run.found.t_end_ns.max(anomaly.t_end_ns);
    run.found.samples = run.found.samples.saturating_add(anomaly.samples);
}

/// How many they are, over which time, and what the first of them says.
fn in_words(run: &Gathered, (first_ns, last_ns): (i64, i64)) -> String {
    let seconds = |ns: i64| ns as f64 * 1e-9;
    let lasts_ns = run.found.t_end_ns.saturating_sub(run.found.t_start_ns);
    let all_ns = last_ns.saturating_sub(first_ns).max(1);
    format!(
        "{} times within {:.3} s, {:.0} % of the time in which it was seen; the first: {}",
        run.times,
        seconds(lasts_ns),
        100.0 * lasts_ns as f64 / all_ns as f64,
        run.found.detail
    )
}

/// The same for a walk that goes on: the first are rows of their own, more are gathered into the last of their kind and stream.
#[derive(Clone, Debug, Default)]
pub(crate) struct Growing(BTreeMap<(AnomalyKind, Option<StreamId>), u64>);

/// What a walk that goes on has to store.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Grown {
    /// New rows.
    pub(crate) rows: Vec<Anomaly>,
    /// What goes into the last row of its kind and stream.
    pub(crate) more: Vec<Gathered>,
}

impl Growing {
    /// Of a walk that has so many rows of each kind and stream.
    pub(crate) fn with(rows: Vec<(AnomalyKind, Option<StreamId>, u64)>) -> Growing {
        Growing(rows.into_iter().map(|(kind, stream, rows)| ((kind, stream), rows)).collect())
    }

    /// Sorts what was found next.
    pub(crate) fn take(&mut self, found: Vec<Anomaly>) -> Grown {
        let mut grown = Grown::default();
        for anomaly in found {
            let rows = self.0.entry((anomaly.kind, anomaly.stream)).or_default();
            if *rows < MOST_ROWS as u64 {
                *rows += 1;
                grown.rows.push(anomaly);
                continue;
            }
            let same =
                |run: &&mut Gathered| (run.found.kind, run.found.stream) == (anomaly.kind, anomaly.stream);
            match grown.more.iter_mut().find(same) {
                Some(run) => add(run, &anomaly),
                None => grown.more.push(Gathered { found: anomaly, times: 1 }),
            }
        }
        grown
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gap(t_start_ns: i64) -> Anomaly {
        Anomaly {
            kind: AnomalyKind::GAP,
            stream: None,
            t_start_ns,
            t_end_ns: t_start_ns + 10,
            samples: 2,
            detail: "a gap".to_owned(),
            figures: None,
        }
    }

    #[test]
    fn few_anomalies_stay_what_they_are() {
        let found: Vec<_> = (0..MOST_ROWS as i64).map(|n| gap(n * 1_000)).collect();
        let rows = gathered(found.clone());
        assert_eq!(rows.iter().map(|row| row.found.clone()).collect::<Vec<_>>(), found);
        assert!(rows.iter().all(|row| row.times == 1));
    }

    #[test]
    fn a_kind_that_fills_a_walk_is_one_row_with_its_share() {
        let rows = gathered((0..200_000).map(|n| gap(n * 1_000)).collect());
        let [row] = &rows[..] else { panic!("expected one row, found {}", rows.len()) };
        assert_eq!((row.times, row.found.samples), (200_000, 400_000));
        assert_eq!((row.found.t_start_ns, row.found.t_end_ns), (0, 199_999_010));
        assert!(row.found.detail.contains("200000 times") && row.found.detail.contains("100 %"), "{row:?}");
    }

    #[test]
    fn bursts_stay_apart_and_none_is_lost() {
        // Three bursts of a hundred, a minute apart, and one of another kind between them.
        let mut found: Vec<_> =
            (0..300).map(|n| gap((n / 100) * 60_000_000_000 + (n % 100) * 1_000 * (1 + n % 7))).collect();
        found.push(Anomaly { kind: AnomalyKind::SATURATION, ..gap(5) });
        let rows = gathered(found);
        assert_eq!(rows.iter().map(|row| row.times).sum::<u64>(), 301);
        assert!(rows.len() <= MOST_ROWS + 1, "{}", rows.len());
        let across = |row: &&Gathered| row.found.t_end_ns - row.found.t_start_ns > 1_000_000_000;
        assert_eq!(rows.iter().filter(across).count(), 0, "a run goes over the time between two bursts");
    }

    #[test]
    fn a_walk_that_goes_on_has_as_few_rows_whatever_it_is_cut_into() {
        let found: Vec<_> = (0..1_000).map(|n| gap(n * 1_000)).collect();
        for piece in [1, 7, 1_000] {
            let mut growing = Growing::default();
            let grown: Vec<Grown> = found.chunks(piece).map(|piece| growing.take(piece.to_vec())).collect();
            assert_eq!(grown.iter().map(|grown| grown.rows.len()).sum::<usize>(), MOST_ROWS);
            let more: u64 = grown.iter().flat_map(|grown| &grown.more).map(|run| run.times).sum();
            assert_eq!(more, 1_000 - MOST_ROWS as u64, "pieces of {piece}");
        }
        // One that is taken up again after a restart has no more than it would have had.
        let mut again = Growing::with(vec![(AnomalyKind::GAP, None, MOST_ROWS as u64)]);
        assert!(again.take(vec![gap(0)]).rows.is_empty());
    }
}
