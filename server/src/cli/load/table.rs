//! What came of a run, as a table.

use std::time::Duration;

use super::audit::Audit;
use super::delays::Delays;
use super::device::Outcome;
use super::trouble::Told;
use super::uploads::HandedIn;
use super::{LoadArgs, Seen};
use crate::cli::text_columns::push_aligned;

/// What there is to tell.
pub(super) struct Result<'a> {
    pub(super) args: &'a LoadArgs,
    pub(super) took: Duration,
    pub(super) outcomes: &'a [Outcome],
    pub(super) acknowledged: &'a Delays,
    pub(super) shown: &'a Delays,
    pub(super) seen: &'a Seen,
    pub(super) audit: &'a Audit,
    pub(super) handed_in: Option<&'a [HandedIn]>,
    pub(super) troubles: &'a [Told],
}

impl Result<'_> {
    /// The table.
    pub(super) fn text(&self) -> String {
        let args = self.args;
        let rate = 2 * args.inspectors * args.rate_hz;
        let mut out = format!(
            "{} inspectors, two feet at {} Hz, a frame every {} ms: {rate} samples/s for {} s (all acknowledged after {:.1} s)\n\n",
            args.inspectors,
            args.rate_hz,
            args.frame_ms,
            args.seconds,
            self.took.as_secs_f64()
        );
        let mut rows = vec![row("", ["first half", "second half", "all"].map(str::to_owned))];
        for (name, delays) in [("acknowledged", self.acknowledged), ("on a dashboard", self.shown)] {
            for (label, share) in [("median", 0.5), ("p99", 0.99), ("largest", 1.0)] {
                let values = delays.quantile(share).map(|delay| delay.map_or("–".into(), milliseconds));
                rows.push(row(&format!("{name}, {label}, ms"), values));
            }
        }
        rows.extend(self.process_rows());
        push_aligned(&rows, &mut out);
        out.push('\n');
        push_aligned(&self.count_rows(), &mut out);
        out
    }

    /// Processor and memory, by halves.
    fn process_rows(&self) -> Vec<Vec<String>> {
        let (Some(first), Some(last)) = (self.seen.first(), self.seen.last()) else { return Vec::new() };
        let half_s = self.args.seconds / 2;
        let middle = self.seen.iter().find(|(second, _)| *second >= half_s).unwrap_or(last);
        let cores = |from: &(u32, super::Process), to: &(u32, super::Process)| {
            (to.1.cpu_s - from.1.cpu_s) / f64::from((to.0 - from.0).max(1))
        };
        let shares = [cores(first, middle), cores(middle, last), cores(first, last)];
        let megabytes = |seen: &[(u32, super::Process)]| {
            let most = seen.iter().map(|(_, process)| process.resident_bytes).fold(0.0, f64::max);
            format!("{:.0}", most / 1e6)
        };
        let at = self.seen.iter().position(|seen| seen.0 >= half_s).unwrap_or(0);
        vec![
            row("processor, cores", shares.map(|share| format!("{share:.2}"))),
            row(
                "processor for one inspector, % of a core",
                shares.map(|share| format!("{:.3}", 100.0 * share / f64::from(self.args.inspectors))),
            ),
            row(
                "memory at most, MB",
                [megabytes(&self.seen[..=at]), megabytes(&self.seen[at..]), megabytes(self.seen)],
            ),
        ]
    }

    fn count_rows(&self) -> Vec<Vec<String>> {
        let mut rows = vec![
            vec!["samples acknowledged".to_owned(), self.audit.acknowledged.to_string()],
            vec!["stored".to_owned(), self.audit.stored.to_string()],
            vec!["acknowledged and lost".to_owned(), self.audit.lost.to_string()],
            vec!["stored twice, out of order or altered".to_owned(), self.audit.wrong.to_string()],
            vec![
                "links lost".to_owned(),
                self.outcomes.iter().map(|outcome| outcome.lost_links).sum::<u32>().to_string(),
            ],
        ];
        if self.args.storm.is_some() {
            let after: Vec<_> = self.outcomes.iter().filter_map(|outcome| outcome.caught_up_after).collect();
            rows.push(vec![
                "caught up after the storm".to_owned(),
                format!("{} of {}", after.len(), self.outcomes.len()),
            ]);
            let last = after.iter().max().map_or("–".into(), |after| format!("{:.1}", after.as_secs_f64()));
            rows.push(vec!["the last of them after, s".to_owned(), last]);
        }
        if let Some(handed_in) = self.handed_in {
            for walk in handed_in {
                rows.push(vec![
                    format!("{:.1} MB handed in: accepted, track stored after, s", walk.bytes as f64 / 1e6),
                    format!(
                        "{:.1}, {:.1}",
                        walk.accepted_after.as_secs_f64(),
                        walk.stored_after.as_secs_f64()
                    ),
                ]);
            }
        }
        rows.extend(self.troubles.iter().map(|(what, told)| vec![(*what).to_owned(), told.clone()]));
        rows
    }
}

fn row(name: &str, values: [String; 3]) -> Vec<String> {
    std::iter::once(name.to_owned()).chain(values).collect()
}

fn milliseconds(delay: Duration) -> String {
    format!("{:.0}", delay.as_secs_f64() * 1e3)
}
