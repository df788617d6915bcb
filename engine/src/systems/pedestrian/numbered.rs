//! A queue whose members keep their number.

use std::collections::VecDeque;

/// A queue whose members keep their number when the oldest are forgotten.
#[derive(Clone, Debug)]
pub(super) struct Numbered<T> {
    first: u64,
    members: VecDeque<T>,
}

impl<T> Numbered<T> {
    pub(super) fn new() -> Self {
        Numbered { first: 0, members: VecDeque::new() }
    }

    /// A queue whose first member has this number.
    pub(super) fn from(first: u64, members: impl IntoIterator<Item = T>) -> Self {
        Numbered { first, members: members.into_iter().collect() }
    }

    pub(super) fn first_number(&self) -> u64 {
        self.first
    }

    #[inline]
    pub(super) fn get(&self, number: u64) -> Option<&T> {
        number.checked_sub(self.first).and_then(|k| self.members.get(k as usize))
    }

    pub(super) fn last(&self) -> Option<&T> {
        self.members.back()
    }

    pub(super) fn push(&mut self, member: T) {
        self.members.push_back(member);
    }

    /// Puts a member before the oldest.
    pub(super) fn push_front(&mut self, member: T) {
        self.first -= 1;
        self.members.push_front(member);
    }

    pub(super) fn forget_before(&mut self, number: u64) {
        while self.first < number && self.members.pop_front().is_some() {
            self.first += 1;
        }
        // What once took much room does not keep it.
        if self.members.capacity() > 8 * self.members.len().max(256) {
            self.members.shrink_to(2 * self.members.len());
        }
    }

    /// The number of the next member.
    pub(super) fn end_number(&self) -> u64 {
        self.first + self.members.len() as u64
    }

    pub(super) fn forget_from(&mut self, number: u64) {
        self.members.truncate(number.saturating_sub(self.first) as usize);
    }
}
