//! The inputs of a session's past: the newest in memory, older ones put away where there is room for them.
//!
//! Only a late visit and the smoother look back. A live session among a thousand holds minutes of inputs for that
//! moment; they lie in an [`InputStore`], and come back when they are needed.

use super::filter::Input;
use super::numbered_queue::NumberedQueue;

/// Inputs that are put away together: about a second of two sensors at 100 Hz.
const BLOCK: u64 = 256;

/// Where a session may put what it seldom needs. Whatever comes back must be what was put there, or nothing.
pub trait InputStore: Send {
    /// Keeps these bytes under a number; `false` where there is no room.
    fn put(&mut self, number: u64, bytes: &[u8]) -> bool;
    /// What was kept under a number; `None` where it cannot be had.
    fn get(&mut self, number: u64) -> Option<Vec<u8>>;
    /// What is kept under lower numbers is not needed any more.
    fn forget_before(&mut self, number: u64);
}

impl std::fmt::Debug for dyn InputStore {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("InputStore")
    }
}

/// Inputs by number, without a hole.
#[derive(Debug)]
pub(super) struct Inputs<I> {
    in_memory: NumberedQueue<I>,
    store: Option<Box<dyn InputStore>>,
    /// Inputs below this number have been put away.
    put_away: u64,
    /// Inputs below this number are not needed any more.
    oldest: u64,
}

impl<I: Input> Inputs<I> {
    pub(super) fn new(store: Option<Box<dyn InputStore>>) -> Self {
        Inputs { in_memory: NumberedQueue::new(), store, put_away: 0, oldest: 0 }
    }

    /// The inputs from number `first` on; those before it are not needed.
    pub(super) fn restored(store: Option<Box<dyn InputStore>>, first: u64, inputs: Vec<I>) -> Self {
        Inputs {
            in_memory: NumberedQueue::from(first, inputs),
            store,
            put_away: first / BLOCK * BLOCK,
            oldest: first,
        }
    }

    /// The inputs from number `first` on, where all of them are in memory.
    pub(super) fn from(&self, first: u64) -> Option<Vec<I>> {
        let numbers = first..self.in_memory.end_number();
        numbers.map(|number| self.in_memory.get(number).copied()).collect()
    }

    /// An input that is in memory.
    #[inline]
    pub(super) fn get(&self, number: u64) -> Option<&I> {
        self.in_memory.get(number)
    }

    pub(super) fn last(&self) -> Option<&I> {
        self.in_memory.last()
    }

    pub(super) fn push(&mut self, input: I) {
        self.in_memory.push(input);
    }

    /// Inputs below this number are not needed any more.
    pub(super) fn forget_before(&mut self, number: u64) {
        self.oldest = number;
        self.in_memory.forget_before(number);
        if let Some(store) = &mut self.store {
            store.forget_before(number / BLOCK);
        }
    }

    /// Puts away all but the newest, as far as there is room; `next` is the input that is taken next.
    pub(super) fn tidy(&mut self, next: u64) {
        let Some(store) = &mut self.store else { return };
        while self.put_away + BLOCK < next {
            let block = self.put_away / BLOCK;
            let numbers = self.put_away..self.put_away + BLOCK;
            if numbers.end > self.oldest {
                let mut bytes = Vec::with_capacity(BLOCK as usize * I::BYTES);
                for number in numbers.clone() {
                    // A block whose beginning is forgotten already is put away with what is left of it behind.
                    match self.in_memory.get(number) {
                        Some(input) => input.write(&mut bytes),
                        None => bytes.resize(bytes.len() + I::BYTES, 0),
                    }
                }
                if !store.put(block, &bytes) {
                    return;
                }
            }
            self.put_away = numbers.end;
        }
        self.in_memory.forget_before(self.put_away);
    }

    /// Brings back what was put away from this input on, as far as it can be had; says from which input on all are in
    /// memory now.
    pub(super) fn bring_back(&mut self, from: u64) -> u64 {
        let from = from.max(self.oldest);
        while self.in_memory.first_number() > from
            && let Some(store) = &mut self.store
        {
            let end = self.in_memory.first_number();
            let block = (end - 1) / BLOCK;
            let Some(bytes) = store.get(block) else { break };
            if bytes.len() != BLOCK as usize * I::BYTES {
                break;
            }
            let input = |place: u64| &bytes[place as usize * I::BYTES..][..I::BYTES];
            let first = block * BLOCK;
            for number in (first.max(self.oldest)..end).rev() {
                self.in_memory.push_front(I::read(input(number - first)));
            }
        }
        self.in_memory.first_number()
    }

    /// How many are in memory.
    #[cfg(test)]
    pub(super) fn in_memory(&self) -> u64 {
        self.in_memory.end_number() - self.in_memory.first_number()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::sync::{Arc, Mutex};

    use super::*;

    /// Room for so many blocks.
    #[derive(Clone, Default)]
    struct Room {
        blocks: Arc<Mutex<BTreeMap<u64, Vec<u8>>>>,
        most: usize,
    }

    impl InputStore for Room {
        fn put(&mut self, number: u64, bytes: &[u8]) -> bool {
            let mut blocks = self.blocks.lock().unwrap();
            let fits = blocks.len() < self.most;
            if fits {
                blocks.insert(number, bytes.to_vec());
            }
            fits
        }

        fn get(&mut self, number: u64) -> Option<Vec<u8>> {
            self.blocks.lock().unwrap().get(&number).cloned()
        }

        fn forget_before(&mut self, number: u64) {
            self.blocks.lock().unwrap().retain(|kept, _| *kept >= number);
        }
    }

    #[derive(Clone, Copy, Debug, PartialEq)]
    struct Reading {
        number: u64,
        value: f64,
    }

    impl Input for Reading {
        const BYTES: usize = 16;

        fn t_ns(&self) -> i64 {
            self.number as i64 * 5_000_000
        }

        fn epoch(&self) -> u64 {
            self.number / 2
        }

        fn opens_epoch(&self) -> bool {
            self.number.is_multiple_of(2)
        }

        fn write(&self, out: &mut Vec<u8>) {
            out.extend_from_slice(&self.number.to_le_bytes());
            out.extend_from_slice(&self.value.to_le_bytes());
        }

        fn read(bytes: &[u8]) -> Self {
            let (words, _) = bytes.as_chunks::<8>();
            Reading { number: u64::from_le_bytes(words[0]), value: f64::from_le_bytes(words[1]) }
        }
    }

    fn reading(number: u64) -> Reading {
        Reading { number, value: number as f64 / 7.0 }
    }

    fn filled(most: usize, count: u64) -> (Inputs<Reading>, Room) {
        let room = Room { most, ..Room::default() };
        let mut inputs = Inputs::new(Some(Box::new(room.clone())));
        for number in 0..count {
            inputs.push(reading(number));
            inputs.tidy(number + 1);
        }
        (inputs, room)
    }

    fn is_as_it_was(inputs: &Inputs<Reading>, from: u64, to: u64) -> bool {
        (from..to).all(|number| inputs.get(number) == Some(&reading(number)))
    }

    #[test]
    fn what_was_put_away_comes_back_as_it_was() {
        let (mut inputs, room) = filled(1_000, 5_000);
        assert!(inputs.in_memory() <= 2 * BLOCK, "{}", inputs.in_memory());
        inputs.forget_before(700);
        assert_eq!(room.blocks.lock().unwrap().keys().next(), Some(&(700 / BLOCK)));
        assert!(inputs.bring_back(1_000) <= 1_000);
        assert!(is_as_it_was(&inputs, 1_000, 5_000));
        assert_eq!(inputs.bring_back(0), 700, "what is forgotten stays so");
        assert!(is_as_it_was(&inputs, 700, 5_000));
        inputs.tidy(5_000);
        assert!(inputs.in_memory() <= 2 * BLOCK);
    }

    #[test]
    fn where_there_is_no_room_inputs_stay_in_memory() {
        let (mut inputs, _) = filled(2, 2_000);
        assert_eq!(inputs.in_memory(), 2_000 - 2 * BLOCK);
        assert_eq!(inputs.bring_back(0), 0);
        assert!(is_as_it_was(&inputs, 0, 2_000));
    }

    #[test]
    fn what_cannot_be_had_again_is_said() {
        let (mut inputs, room) = filled(1_000, 5_000);
        room.blocks.lock().unwrap().remove(&7);
        assert_eq!(inputs.bring_back(100), 8 * BLOCK);
        assert!(is_as_it_was(&inputs, 8 * BLOCK, 5_000));
    }
}
