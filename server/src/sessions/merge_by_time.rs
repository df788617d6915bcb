//! A session's streams as one sequence: the stream whose next reading is older goes first.

use lodestep_engine::anomaly::Anomaly;
use lodestep_engine::stream::{Reading, Readings, StreamId};

/// Where one stream's readings come from, piece by piece, in the order of its log.
pub(crate) trait StreamReadings {
    /// The next piece; an empty one at the end.
    fn next_piece(&mut self) -> anyhow::Result<Readings>;

    /// What was done to read it, known at its end.
    fn anomalies(&self) -> Vec<Anomaly> {
        Vec::new()
    }
}

/// What happens next in a session.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Merged<'a> {
    /// This stream has a reading.
    Reading(StreamId, Reading<'a>),
    /// This stream has no more.
    End(StreamId),
}

struct Source<S> {
    stream: StreamId,
    readings: S,
    piece: Readings,
    at: usize,
}

impl<S: StreamReadings> Source<S> {
    /// Time of the reading that comes next, with the next piece read where the last one is used up.
    fn next_ns(&mut self) -> anyhow::Result<Option<i64>> {
        if self.at == self.piece.len() {
            self.piece = self.readings.next_piece()?;
            self.at = 0;
        }
        Ok(self.piece.get(self.at).map(|reading| reading.t_ns()))
    }
}

/// The merged sequence. Of equal times the stream goes first whose name does in the alphabet. A stream whose clock steps
/// back keeps its own order; that is for the session to judge.
pub(crate) struct MergedByTime<S> {
    sources: Vec<Source<S>>,
    anomalies: Vec<Anomaly>,
}

impl<S: StreamReadings> MergedByTime<S> {
    pub(crate) fn new(streams: impl IntoIterator<Item = (impl Into<StreamId>, S)>) -> Self {
        let mut sources: Vec<_> = streams
            .into_iter()
            .map(|(stream, readings)| Source {
                stream: stream.into(),
                readings,
                piece: Readings::Imu(Vec::new()),
                at: 0,
            })
            .collect();
        sources.sort_by_key(|source| source.stream);
        MergedByTime { sources, anomalies: Vec::new() }
    }

    /// What was done to read the streams that have ended.
    pub(crate) fn anomalies(&mut self) -> Vec<Anomaly> {
        std::mem::take(&mut self.anomalies)
    }

    /// The next step; `None` when every stream has ended.
    pub(crate) fn next(&mut self) -> anyhow::Result<Option<Merged<'_>>> {
        let mut oldest: Option<(usize, i64)> = None;
        for number in 0..self.sources.len() {
            match self.sources[number].next_ns()? {
                None => {
                    let Source { stream, readings, .. } = self.sources.remove(number);
                    let of_stream = readings.anomalies().into_iter();
                    self.anomalies
                        .extend(of_stream.map(|anomaly| Anomaly { stream: Some(stream), ..anomaly }));
                    return Ok(Some(Merged::End(stream)));
                }
                Some(t_ns) if oldest.is_none_or(|(_, oldest_ns)| t_ns < oldest_ns) => {
                    oldest = Some((number, t_ns));
                }
                Some(_) => {}
            }
        }
        let Some((number, _)) = oldest else { return Ok(None) };
        let source = &mut self.sources[number];
        source.at += 1;
        Ok(source.piece.get(source.at - 1).map(|reading| Merged::Reading(source.stream, reading)))
    }
}

#[cfg(test)]
mod tests {
    use lodestep_engine::stream::Rows;

    use super::*;

    /// Pieces of three samples each.
    struct Times(std::vec::IntoIter<i64>);

    impl StreamReadings for Times {
        fn next_piece(&mut self) -> anyhow::Result<Readings> {
            let mut rows = Rows::new(1);
            self.0.by_ref().take(3).for_each(|t_ns| rows.push(t_ns, [0.0]));
            Ok(Readings::Values(rows))
        }
    }

    fn left() -> StreamId {
        StreamId::named("a")
    }

    fn right() -> StreamId {
        StreamId::named("b")
    }

    fn merged(left: Vec<i64>, right: Vec<i64>) -> Vec<(StreamId, Option<i64>)> {
        let streams = [(self::right(), Times(right.into_iter())), (self::left(), Times(left.into_iter()))];
        let mut order = MergedByTime::new(streams);
        let mut steps = Vec::new();
        while let Some(step) = order.next().unwrap() {
            steps.push(match step {
                Merged::Reading(stream, reading) => (stream, Some(reading.t_ns())),
                Merged::End(stream) => (stream, None),
            });
        }
        steps
    }

    #[test]
    fn the_older_sample_goes_first_and_the_first_stream_of_equals() {
        let (left, right) = (left(), right());
        let steps = merged(vec![0, 10, 20, 30], vec![5, 10]);
        let expected = [
            (left, Some(0)),
            (right, Some(5)),
            (left, Some(10)),
            (right, Some(10)),
            (right, None),
            (left, Some(20)),
            (left, Some(30)),
            (left, None),
        ];
        assert_eq!(steps, expected);
    }

    #[test]
    fn a_clock_that_steps_back_loses_and_reorders_nothing() {
        let steps = merged(vec![0, 100, 50, 60, 70], vec![55, 65]);
        let of_left: Vec<_> = steps.iter().filter(|s| s.0 == left()).filter_map(|s| s.1).collect();
        assert_eq!(of_left, [0, 100, 50, 60, 70]);
        assert_eq!(steps.len(), 9);
    }

    #[test]
    fn streams_without_readings_end_at_once() {
        assert_eq!(merged(vec![], vec![]), [(left(), None), (right(), None)]);
    }
}
