//! Which batch of a stream comes next: what is taken, what is on disk, what is a repetition or a hole.

/// What to do with a batch that has arrived.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Arrival {
    /// It is the next one: take it.
    Next,
    /// It is on disk already: say so again, change nothing.
    OnDisk,
    /// It is on its way to the disk: its acknowledgement will come, change nothing.
    Underway,
    /// Batches before it are missing; this is the one that was expected.
    Gap {
        /// The sequence number that was expected.
        expected: u64,
    },
}

/// The batches of one stream.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Sequence {
    next: u64,
    next_on_disk: u64,
}

impl Sequence {
    /// A stream of which all batches before `next` are on disk.
    pub(crate) fn resumed_at(next: u64) -> Sequence {
        Sequence { next, next_on_disk: next }
    }

    /// Judges the batch with this number.
    pub(crate) fn judge(&self, sequence: u64) -> Arrival {
        if sequence < self.next_on_disk {
            Arrival::OnDisk
        } else if sequence < self.next {
            Arrival::Underway
        } else if sequence == self.next {
            Arrival::Next
        } else {
            Arrival::Gap { expected: self.next }
        }
    }

    /// The next batch has been taken and handed to the writer.
    pub(crate) fn taken(&mut self) {
        self.next += 1;
    }

    /// Every batch up to this one is on disk.
    pub(crate) fn on_disk(&mut self, sequence: u64) {
        self.next_on_disk = self.next_on_disk.max(sequence + 1);
    }

    /// The first batch that has not been taken yet.
    pub(crate) fn next_taken(&self) -> u64 {
        self.next
    }

    /// The first batch that is not on disk yet.
    pub(crate) fn next_on_disk(&self) -> u64 {
        self.next_on_disk
    }

    /// The last batch that is on disk, if there is one.
    pub(crate) fn last_on_disk(&self) -> Option<u64> {
        self.next_on_disk.checked_sub(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn batches_are_taken_in_order_and_repetitions_are_told_apart_by_where_they_are() {
        let mut stream = Sequence::resumed_at(5);
        assert_eq!(stream.judge(4), Arrival::OnDisk);
        assert_eq!(stream.judge(5), Arrival::Next);
        stream.taken();
        stream.taken();
        assert_eq!(stream.judge(5), Arrival::Underway);
        stream.on_disk(5);
        assert_eq!(stream.judge(5), Arrival::OnDisk);
        assert_eq!(stream.judge(6), Arrival::Underway);
        assert_eq!(stream.judge(9), Arrival::Gap { expected: 7 });
        assert_eq!(stream.next_on_disk(), 6);
        assert_eq!(stream.last_on_disk(), Some(5));
    }

    #[test]
    fn nothing_is_on_disk_at_the_start() {
        let stream = Sequence::default();
        assert_eq!(stream.last_on_disk(), None);
        assert_eq!(stream.judge(0), Arrival::Next);
        assert_eq!(stream.judge(1), Arrival::Gap { expected: 0 });
    }
}
