//! A queue whose members keep their number.

use std::collections::VecDeque;

/// Members that lie together; a queue of a million is never moved as a whole to grow.
const BLOCK: u64 = 256;

/// A queue whose members keep their number when the oldest are forgotten.
#[derive(Clone, Debug)]
pub(super) struct NumberedQueue<T> {
    first: u64,
    end: u64,
    /// Each holds the members whose numbers, divided by [`BLOCK`], are the same.
    blocks: VecDeque<VecDeque<T>>,
}

impl<T> NumberedQueue<T> {
    pub(super) fn new() -> Self {
        NumberedQueue::from(0, [])
    }

    /// A queue whose first member has this number.
    pub(super) fn from(first: u64, members: impl IntoIterator<Item = T>) -> Self {
        let mut numbered = NumberedQueue { first, end: first, blocks: VecDeque::new() };
        members.into_iter().for_each(|member| numbered.push(member));
        numbered
    }

    pub(super) fn first_number(&self) -> u64 {
        self.first
    }

    #[inline]
    pub(super) fn get(&self, number: u64) -> Option<&T> {
        if number < self.first || number >= self.end {
            return None;
        }
        let block = number / BLOCK - self.first / BLOCK;
        let before = if block == 0 { self.first % BLOCK } else { 0 };
        self.blocks.get(block as usize)?.get((number % BLOCK - before) as usize)
    }

    pub(super) fn last(&self) -> Option<&T> {
        self.blocks.back().and_then(VecDeque::back)
    }

    pub(super) fn push(&mut self, member: T) {
        if self.end.is_multiple_of(BLOCK) || self.blocks.is_empty() {
            self.blocks.push_back(VecDeque::new());
        }
        if let Some(block) = self.blocks.back_mut() {
            block.push_back(member);
            self.end += 1;
        }
    }

    /// Puts a member before the oldest.
    pub(super) fn push_front(&mut self, member: T) {
        if self.first.is_multiple_of(BLOCK) || self.blocks.is_empty() {
            self.blocks.push_front(VecDeque::with_capacity(BLOCK as usize));
        }
        if let Some(block) = self.blocks.front_mut() {
            block.push_front(member);
            self.first -= 1;
        }
    }

    pub(super) fn forget_before(&mut self, number: u64) {
        let number = number.min(self.end);
        while self.first < number {
            let within = (number.min((self.first / BLOCK + 1) * BLOCK) - self.first) as usize;
            match self.blocks.front_mut() {
                Some(block) if block.len() > within => drop(block.drain(..within)),
                _ => drop(self.blocks.pop_front()),
            }
            self.first += within as u64;
        }
    }

    /// The number of the next member.
    pub(super) fn end_number(&self) -> u64 {
        self.end
    }

    pub(super) fn forget_from(&mut self, number: u64) {
        let number = number.max(self.first);
        while self.end > number {
            let within = (self.end - number.max((self.end - 1) / BLOCK * BLOCK)) as usize;
            match self.blocks.back_mut() {
                Some(block) if block.len() > within => block.truncate(block.len() - within),
                _ => drop(self.blocks.pop_back()),
            }
            self.end -= within as u64;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::*;

    /// What may be done to its ends, to so many members.
    #[derive(Clone, Copy, Debug)]
    enum Done {
        Push(u64),
        PushFront(u64),
        ForgetBefore(u64),
        ForgetFrom(u64),
    }

    fn done() -> impl Strategy<Value = Done> {
        let many = 0..3 * BLOCK;
        prop_oneof![
            3 => many.clone().prop_map(Done::Push),
            1 => many.clone().prop_map(Done::PushFront),
            1 => many.clone().prop_map(Done::ForgetBefore),
            1 => many.prop_map(Done::ForgetFrom),
        ]
    }

    fn holds(numbered: &NumberedQueue<u64>, first: u64, members: &VecDeque<u64>) -> bool {
        let end = first + members.len() as u64;
        let all = (first..end).zip(members).all(|(number, member)| numbered.get(number) == Some(member));
        let before = first.checked_sub(1).and_then(|before| numbered.get(before));
        let ends = (numbered.first_number(), numbered.end_number(), numbered.last());
        all && before.or(numbered.get(end)).is_none() && ends == (first, end, members.back())
    }

    proptest! {
        #[test]
        fn it_is_a_queue_whatever_is_done_to_its_ends(start in 0..2_000_u64, all in vec(done(), 1..60)) {
            let (mut first, mut members) = (start, VecDeque::new());
            let mut numbered = NumberedQueue::from(first, []);
            for (round, done) in (0_u64..).zip(all) {
                match done {
                    Done::Push(many) => (0..many).for_each(|k| {
                        numbered.push(round * 1_000 + k);
                        members.push_back(round * 1_000 + k);
                    }),
                    Done::PushFront(many) => (0..many.min(first)).for_each(|k| {
                        numbered.push_front(round * 1_000 + k);
                        members.push_front(round * 1_000 + k);
                        first -= 1;
                    }),
                    Done::ForgetBefore(many) => {
                        numbered.forget_before(first + many);
                        let gone = many.min(members.len() as u64);
                        members.drain(..gone as usize);
                        first += gone;
                    }
                    Done::ForgetFrom(many) => {
                        let left = (members.len() as u64).saturating_sub(many);
                        numbered.forget_from(first + left);
                        members.truncate(left as usize);
                    }
                }
                prop_assert!(holds(&numbered, first, &members), "after {round}, {done:?}");
            }
        }
    }
}
