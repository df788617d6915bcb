//! Two feet's samples as one sequence: the foot whose next sample is older goes first.

use lodestep_engine::sample::{Foot, ImuSample};

/// Where one foot's samples come from, piece by piece, in the order of its log.
pub(crate) trait FootSamples {
    /// Replaces `samples` by the next piece; leaves it empty at the end.
    fn next_piece(&mut self, samples: &mut Vec<ImuSample>) -> anyhow::Result<()>;
}

/// What happens next in a session.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Step {
    /// This foot has a sample.
    Sample(Foot, ImuSample),
    /// This foot has no more.
    End(Foot),
}

struct Source<S> {
    foot: Foot,
    samples: S,
    piece: Vec<ImuSample>,
    at: usize,
}

impl<S: FootSamples> Source<S> {
    /// The sample that comes next, with the next piece read where the last one is used up.
    fn peek(&mut self) -> anyhow::Result<Option<ImuSample>> {
        if self.at == self.piece.len() {
            self.samples.next_piece(&mut self.piece)?;
            self.at = 0;
        }
        Ok(self.piece.get(self.at).copied())
    }
}

/// The merged sequence. Of equal times the left foot goes first. A foot whose clock steps back keeps
/// its own order; that is for the session to judge.
pub(crate) struct InTimeOrder<S> {
    sources: Vec<Source<S>>,
}

impl<S: FootSamples> InTimeOrder<S> {
    pub(crate) fn new(feet: impl IntoIterator<Item = (Foot, S)>) -> Self {
        let mut sources: Vec<_> = feet
            .into_iter()
            .map(|(foot, samples)| Source { foot, samples, piece: Vec::new(), at: 0 })
            .collect();
        sources.sort_by_key(|source| source.foot);
        InTimeOrder { sources }
    }

    /// The next step; `None` when every foot has ended.
    pub(crate) fn next(&mut self) -> anyhow::Result<Option<Step>> {
        let mut oldest: Option<(usize, ImuSample)> = None;
        for i in 0..self.sources.len() {
            match self.sources[i].peek()? {
                None => return Ok(Some(Step::End(self.sources.remove(i).foot))),
                Some(sample) if oldest.is_none_or(|(_, old)| sample.t_ns < old.t_ns) => {
                    oldest = Some((i, sample));
                }
                Some(_) => {}
            }
        }
        Ok(oldest.map(|(i, sample)| {
            self.sources[i].at += 1;
            Step::Sample(self.sources[i].foot, sample)
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pieces of three samples each.
    struct Times(std::vec::IntoIter<i64>);

    impl FootSamples for Times {
        fn next_piece(&mut self, samples: &mut Vec<ImuSample>) -> anyhow::Result<()> {
            samples.clear();
            samples.extend(self.0.by_ref().take(3).map(|t_ns| ImuSample {
                t_ns,
                w_ib_b_rad_s: [0.0; 3],
                f_b_m_s2: [0.0; 3],
                mag_b_ut: None,
                pressure_hpa: None,
            }));
            Ok(())
        }
    }

    fn merged(left: Vec<i64>, right: Vec<i64>) -> Vec<(Foot, Option<i64>)> {
        let feet = [(Foot::Right, Times(right.into_iter())), (Foot::Left, Times(left.into_iter()))];
        let mut order = InTimeOrder::new(feet);
        let mut steps = Vec::new();
        while let Some(step) = order.next().unwrap() {
            steps.push(match step {
                Step::Sample(foot, sample) => (foot, Some(sample.t_ns)),
                Step::End(foot) => (foot, None),
            });
        }
        steps
    }

    #[test]
    fn the_older_sample_goes_first_and_the_left_foot_of_equals() {
        use Foot::{Left, Right};
        let steps = merged(vec![0, 10, 20, 30], vec![5, 10]);
        let expected = [
            (Left, Some(0)),
            (Right, Some(5)),
            (Left, Some(10)),
            (Right, Some(10)),
            (Right, None),
            (Left, Some(20)),
            (Left, Some(30)),
            (Left, None),
        ];
        assert_eq!(steps, expected);
    }

    #[test]
    fn a_clock_that_steps_back_loses_and_reorders_nothing() {
        let steps = merged(vec![0, 100, 50, 60, 70], vec![55, 65]);
        let left: Vec<_> = steps.iter().filter(|s| s.0 == Foot::Left).filter_map(|s| s.1).collect();
        assert_eq!(left, [0, 100, 50, 60, 70]);
        assert_eq!(steps.len(), 9);
    }

    #[test]
    fn feet_without_samples_end_at_once() {
        assert_eq!(merged(vec![], vec![]), [(Foot::Left, None), (Foot::Right, None)]);
    }
}
