//! Several streams as one sequence in time: each waits until it is certain that no earlier item of another will come.

use serde::{Deserialize, Serialize};

/// What a merge has to know of one stream.
pub(crate) trait Queued {
    /// Time of its next item, ns; `None` while it has none.
    fn next_ns(&self) -> Option<i64>;
    /// Time of the newest reading that could be used, ns.
    fn newest_ns(&self) -> Option<i64>;
    /// Whether no more will come.
    fn has_ended(&self) -> bool;
}

/// The stream whose next item is the earliest, when it is certain that no earlier one will come: every other stream has a
/// next item too, or has ended, or this one has run ahead by more than `max_lead_ns`.
pub(crate) fn earliest<Q: Queued>(streams: &[Q], max_lead_ns: Option<i64>) -> Option<usize> {
    let mut earliest: Option<(i64, usize)> = None;
    for (number, stream) in streams.iter().enumerate() {
        if let Some(t_ns) = stream.next_ns()
            && earliest.is_none_or(|(best_ns, _)| t_ns < best_ns)
        {
            earliest = Some((t_ns, number));
        }
    }
    let (t_ns, number) = earliest?;
    let lead_ns = streams[number].newest_ns().map_or(0, |newest_ns| newest_ns - t_ns);
    let waited = max_lead_ns.is_some_and(|longest_ns| lead_ns > longest_ns);
    let certain = waited || streams.iter().all(|stream| stream.next_ns().is_some() || stream.has_ended());
    certain.then_some(number)
}

/// Groups a merged sequence into epochs.
///
/// An epoch is a run of items in which no stream appears twice; but a new one begins only when time
/// has passed, so that no two have the same time, and streams that fell out of step by a lost sample
/// are in step again with the next pair of equal times.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct Epochs<const N: usize> {
    #[serde(with = "crate::array")]
    members: [bool; N],
    last_ns: i64,
}

impl<const N: usize> Default for Epochs<N> {
    fn default() -> Self {
        Epochs { members: [false; N], last_ns: 0 }
    }
}

impl<const N: usize> Epochs<N> {
    /// Takes the next item, of stream number `stream`; says whether it opens a new epoch.
    pub(crate) fn opens(&mut self, stream: usize, t_ns: i64) -> bool {
        let opens = self.members == [false; N] || (self.members[stream] && t_ns > self.last_ns);
        if opens {
            self.members = [false; N];
        }
        self.members[stream] = true;
        self.last_ns = t_ns;
        opens
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Fake(Option<i64>, Option<i64>, bool);

    impl Queued for Fake {
        fn next_ns(&self) -> Option<i64> {
            self.0
        }

        fn newest_ns(&self) -> Option<i64> {
            self.1
        }

        fn has_ended(&self) -> bool {
            self.2
        }
    }

    #[test]
    fn a_stream_goes_when_no_earlier_item_can_come_or_it_has_waited_long_enough() {
        let both = [Fake(Some(10), Some(30), false), Fake(Some(5), Some(5), false)];
        assert_eq!(earliest(&both, None), Some(1));
        let waiting = [Fake(Some(10), Some(30), false), Fake(None, Some(5), false)];
        assert_eq!(earliest(&waiting, None), None);
        assert_eq!(earliest(&waiting, Some(19)), Some(0));
        assert_eq!(earliest(&waiting, Some(20)), None);
        let ended = [Fake(Some(10), Some(30), false), Fake(None, None, true)];
        assert_eq!(earliest(&ended, None), Some(0));
    }

    #[test]
    fn equal_times_belong_to_one_epoch_and_streams_come_back_into_step() {
        let mut epochs = Epochs::<2>::default();
        let opens: Vec<bool> =
            [(0, 0), (1, 0), (0, 10), (1, 10), (1, 20), (0, 30), (1, 30), (0, 40), (1, 40)]
                .map(|(stream, t_ns)| epochs.opens(stream, t_ns))
                .to_vec();
        assert_eq!(opens, [true, false, true, false, true, false, false, true, false]);
    }
}
