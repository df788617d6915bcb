//! The steps of a walk's past: the newest in memory, older ones put away where there is room for them.
//!
//! Only a late visit and the smoother look back. A live session among a thousand holds minutes of steps for that
//! moment; they lie in an [`Attic`], and come back when somebody looks.

use super::kept_step::KeptStep;
use super::numbered::Numbered;

/// Steps that are put away together, about a second of two feet.
const BLOCK: u64 = 256;

/// Where a session may put what it seldom needs. Whatever comes back must be what was put there, or nothing.
pub trait Attic: Send {
    /// Keeps these bytes under a number; `false` where there is no room.
    fn put(&mut self, number: u64, bytes: &[u8]) -> bool;
    /// What was kept under a number; `None` where it cannot be had.
    fn get(&mut self, number: u64) -> Option<Vec<u8>>;
    /// What is kept under lower numbers is not needed any more.
    fn forget_before(&mut self, number: u64);
}

impl std::fmt::Debug for dyn Attic {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Attic")
    }
}

/// Steps by number, without a hole.
#[derive(Debug)]
pub(super) struct Steps {
    in_memory: Numbered<KeptStep>,
    attic: Option<Box<dyn Attic>>,
    /// Steps below this number have been put away.
    put_away: u64,
    /// Steps below this number are not needed any more.
    oldest: u64,
}

impl Steps {
    pub(super) fn new(attic: Option<Box<dyn Attic>>) -> Self {
        Steps { in_memory: Numbered::new(), attic, put_away: 0, oldest: 0 }
    }

    /// The steps from number `first` on; those before it are not needed.
    pub(super) fn restored(attic: Option<Box<dyn Attic>>, first: u64, steps: Vec<KeptStep>) -> Self {
        Steps {
            in_memory: Numbered::from(first, steps),
            attic,
            put_away: first / BLOCK * BLOCK,
            oldest: first,
        }
    }

    /// The steps from number `first` on, where all of them are in memory.
    pub(super) fn from(&self, first: u64) -> Option<Vec<KeptStep>> {
        let steps = first..self.in_memory.end_number();
        steps.map(|number| self.in_memory.get(number).copied()).collect()
    }

    /// A step that is in memory.
    #[inline]
    pub(super) fn get(&self, number: u64) -> Option<&KeptStep> {
        self.in_memory.get(number)
    }

    pub(super) fn last(&self) -> Option<&KeptStep> {
        self.in_memory.last()
    }

    pub(super) fn push(&mut self, step: KeptStep) {
        self.in_memory.push(step);
    }

    /// Steps below this number are not needed any more.
    pub(super) fn forget_before(&mut self, number: u64) {
        self.oldest = number;
        self.in_memory.forget_before(number);
        if let Some(attic) = &mut self.attic {
            attic.forget_before(number / BLOCK);
        }
    }

    /// Puts away all but the newest, as far as there is room; `next` is the step that is taken next.
    pub(super) fn tidy(&mut self, next: u64) {
        let Some(attic) = &mut self.attic else { return };
        while self.put_away + BLOCK < next {
            let block = self.put_away / BLOCK;
            let steps = self.put_away..self.put_away + BLOCK;
            if steps.end > self.oldest {
                let mut bytes = Vec::with_capacity(BLOCK as usize * KeptStep::BYTES);
                for number in steps.clone() {
                    // A block whose beginning is forgotten already is put away with what is left of it behind.
                    match self.in_memory.get(number) {
                        Some(step) => step.write(&mut bytes),
                        None => bytes.extend_from_slice(&[0; KeptStep::BYTES]),
                    }
                }
                if !attic.put(block, &bytes) {
                    return;
                }
            }
            self.put_away = steps.end;
        }
        self.in_memory.forget_before(self.put_away);
    }

    /// Brings back what was put away from this step on, as far as it can be had; says from which step on all are in
    /// memory now.
    pub(super) fn bring_back(&mut self, from: u64) -> u64 {
        let from = from.max(self.oldest);
        while self.in_memory.first_number() > from
            && let Some(attic) = &mut self.attic
        {
            let end = self.in_memory.first_number();
            let block = (end - 1) / BLOCK;
            let Some(bytes) = attic.get(block) else { break };
            let (steps, rest) = bytes.as_chunks::<{ KeptStep::BYTES }>();
            if steps.len() as u64 != BLOCK || !rest.is_empty() {
                break;
            }
            let first = block * BLOCK;
            for number in (first.max(self.oldest)..end).rev() {
                self.in_memory.push_front(KeptStep::read(&steps[(number - first) as usize]));
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

    use nalgebra::Vector3;

    use super::super::foot::Step;
    use super::*;

    /// Room for so many blocks.
    #[derive(Clone, Default)]
    struct Room {
        blocks: Arc<Mutex<BTreeMap<u64, Vec<u8>>>>,
        most: usize,
    }

    impl Attic for Room {
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

    fn step(number: u64) -> KeptStep {
        let step = Step {
            sensor: (number % 2) as usize,
            t_ns: number as i64 * 5_000_000,
            w_ib_b: Vector3::new(number as f64, 0.25, -1.0),
            f_b: Vector3::new(0.0, 0.5, 9.75),
            mag_b_ut: None,
            pressure_hpa: Some(890.0),
            stance: number.is_multiple_of(3),
            zupt_sigma_m_s: 0.25,
            opens_epoch: number.is_multiple_of(2),
        };
        KeptStep::new(&step, number / 2)
    }

    fn filled(most: usize, count: u64) -> (Steps, Room) {
        let room = Room { most, ..Room::default() };
        let mut steps = Steps::new(Some(Box::new(room.clone())));
        for number in 0..count {
            steps.push(step(number));
            steps.tidy(number + 1);
        }
        (steps, room)
    }

    fn is_as_it_was(steps: &Steps, from: u64, to: u64) -> bool {
        (from..to).all(|n| steps.get(n).is_some_and(|found| format!("{found:?}") == format!("{:?}", step(n))))
    }

    #[test]
    fn what_was_put_away_comes_back_as_it_was() {
        let (mut steps, room) = filled(1_000, 5_000);
        assert!(steps.in_memory() <= 2 * BLOCK, "{}", steps.in_memory());
        steps.forget_before(700);
        assert_eq!(room.blocks.lock().unwrap().keys().next(), Some(&(700 / BLOCK)));
        assert!(steps.bring_back(1_000) <= 1_000);
        assert!(is_as_it_was(&steps, 1_000, 5_000));
        assert_eq!(steps.bring_back(0), 700, "what is forgotten stays so");
        assert!(is_as_it_was(&steps, 700, 5_000));
        steps.tidy(5_000);
        assert!(steps.in_memory() <= 2 * BLOCK);
    }

    #[test]
    fn where_there_is_no_room_steps_stay_in_memory() {
        let (mut steps, _) = filled(2, 2_000);
        assert_eq!(steps.in_memory(), 2_000 - 2 * BLOCK);
        assert_eq!(steps.bring_back(0), 0);
        assert!(is_as_it_was(&steps, 0, 2_000));
    }

    #[test]
    fn what_cannot_be_had_again_is_said() {
        let (mut steps, room) = filled(1_000, 5_000);
        room.blocks.lock().unwrap().remove(&7);
        assert_eq!(steps.bring_back(100), 8 * BLOCK);
        assert!(is_as_it_was(&steps, 8 * BLOCK, 5_000));
    }
}
