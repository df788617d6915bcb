//! What has happened to a filter's errors, taken down so that a smoother can go back over it.
//!
//! A tape is read from its end, like a stack: each entry says how many numbers belong to it.

use nalgebra::{Matrix3, RowVector3, SMatrix, SVector, Vector3};

use super::block_covariance::BlockCovariance;
use super::earth_transition::EarthPropagation;
use super::error_model::Propagation;
use super::linear_maps::Rows;
use super::observation::{MOST_BLOCKS, Observation};

/// Updates of at most this many numbers can be taken down.
pub(super) const MOST_ROWS: usize = 3;

/// One thing that happened.
#[derive(Clone, Copy, Debug)]
pub(super) enum Entry {
    /// The errors of a sensor went through a transition, with its noise.
    Propagation { sensor: u8 },
    /// The same on a turning Earth.
    EarthPropagation { sensor: u8 },
    /// A measurement of `rows` numbers that depends on the first `used` of `blocks` was used. Its
    /// numbers: Jacobians, gain, S⁻¹, S⁻¹m, m; and where an error was set aside, that one's gain.
    Update { rows: u8, used: u8, blocks: [u8; MOST_BLOCKS], aside: AsideTaken },
    /// A linear function of the errors was set aside. Its numbers: the function, as a row.
    SetAside,
    /// A multiple of the error of `b` was added to that of `a`. Its numbers: the factor.
    AddMultiple { a: u8, b: u8 },
    /// The error of `block` was scaled. Its numbers: by how much, axis by axis.
    Scale { block: u8 },
    /// The error of `block` became another that has nothing to do with it. Its numbers: the block's row
    /// of the covariance before.
    Isolate { block: u8 },
    /// The error of `to` became that of `from` and some noise. Its numbers: the row of `to` before.
    Copy { from: u8, to: u8 },
    /// The blocks whose bits are set were given one noise in common. Its numbers: variance by axis.
    CommonNoise { blocks: u64 },
    /// A moment that the recorder wants to look at on the way back.
    Moment,
}

/// What an update has to do with the error that was set aside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AsideTaken {
    /// There was none.
    None,
    /// It was corrected, too.
    Gains,
    /// It was what was measured, beside the blocks.
    Measured,
}

/// The same while it is taken down, with that error's gain.
#[derive(Clone, Copy, Debug)]
pub(super) enum AsideInUpdate<'a, const M: usize> {
    None,
    Gains(&'a SVector<f64, M>),
    Measured,
}

/// The record.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tape {
    recording: bool,
    pub(super) entries: Vec<Entry>,
    pub(super) propagations: Vec<Propagation>,
    pub(super) earth_propagations: Vec<EarthPropagation>,
    pub(super) numbers: Vec<f64>,
}

/// How long a tape is; it can be cut back to it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct TapeLength {
    entries: usize,
    propagations: usize,
    earth_propagations: usize,
    numbers: usize,
}

impl Tape {
    /// Takes down what happens from now on, or does not.
    pub(crate) fn set_recording(&mut self, recording: bool) {
        self.recording = recording;
    }

    /// Marks a moment.
    pub(crate) fn mark_moment(&mut self) {
        if self.recording {
            self.entries.push(Entry::Moment);
        }
    }

    /// Moves all that `newer` holds to the end of this tape.
    pub(crate) fn append(&mut self, newer: &mut Tape) {
        self.entries.append(&mut newer.entries);
        self.propagations.append(&mut newer.propagations);
        self.earth_propagations.append(&mut newer.earth_propagations);
        self.numbers.append(&mut newer.numbers);
    }

    pub(crate) fn length(&self) -> TapeLength {
        TapeLength {
            entries: self.entries.len(),
            propagations: self.propagations.len(),
            earth_propagations: self.earth_propagations.len(),
            numbers: self.numbers.len(),
        }
    }

    /// Forgets what came after the tape was of this length.
    pub(crate) fn cut_back(&mut self, length: TapeLength) {
        self.entries.truncate(length.entries);
        self.propagations.truncate(length.propagations);
        self.earth_propagations.truncate(length.earth_propagations);
        self.numbers.truncate(length.numbers);
    }

    /// Gives back the memory that was taken beforehand.
    pub(crate) fn shrink(&mut self) {
        self.entries.shrink_to_fit();
        self.propagations.shrink_to_fit();
        self.earth_propagations.shrink_to_fit();
        self.numbers.shrink_to_fit();
    }

    /// How much memory it holds.
    pub(crate) fn bytes(&self) -> usize {
        self.entries.capacity() * size_of::<Entry>()
            + self.propagations.capacity() * size_of::<Propagation>()
            + self.earth_propagations.capacity() * size_of::<EarthPropagation>()
            + self.numbers.capacity() * size_of::<f64>()
    }

    #[inline]
    pub(super) fn propagation(&mut self, propagation: &Propagation, sensor: usize) {
        if self.recording {
            self.entries.push(Entry::Propagation { sensor: sensor as u8 });
            self.propagations.push(*propagation);
        }
    }

    pub(super) fn earth_propagation(&mut self, propagation: &EarthPropagation, sensor: usize) {
        if self.recording {
            self.entries.push(Entry::EarthPropagation { sensor: sensor as u8 });
            self.earth_propagations.push(*propagation);
        }
    }

    #[inline]
    pub(super) fn update<const B: usize, const M: usize>(
        &mut self,
        observation: &Observation<M>,
        gain: &Rows<M, B>,
        information: &SMatrix<f64, M, M>,
        weighted: &SVector<f64, M>,
        aside: AsideInUpdate<'_, M>,
    ) {
        const { assert!(M <= MOST_ROWS, "Adjoint::undo has no case for so many numbers") };
        if !self.recording {
            return;
        }
        let mut blocks = [0; MOST_BLOCKS];
        for (place, (block, jacobian)) in blocks.iter_mut().zip(observation.jacobians()) {
            *place = *block as u8;
            self.numbers.extend_from_slice(jacobian.as_slice());
        }
        self.numbers.extend_from_slice(gain.0.as_flattened().as_flattened());
        self.numbers.extend_from_slice(information.as_slice());
        self.numbers.extend_from_slice(weighted.as_slice());
        self.numbers.extend_from_slice(observation.innovation.as_slice());
        let aside = match aside {
            AsideInUpdate::None => AsideTaken::None,
            AsideInUpdate::Measured => AsideTaken::Measured,
            AsideInUpdate::Gains(gain) => {
                self.numbers.extend_from_slice(gain.as_slice());
                AsideTaken::Gains
            }
        };
        let used = observation.jacobians().len() as u8;
        self.entries.push(Entry::Update { rows: M as u8, used, blocks, aside });
    }

    pub(super) fn set_aside<const B: usize>(&mut self, jacobians: &[(usize, RowVector3<f64>)]) {
        if !self.recording {
            return;
        }
        let start = self.numbers.len();
        self.numbers.resize(start + 3 * B, 0.0);
        for (block, jacobian) in jacobians {
            let place = self.numbers[start + 3 * block..].iter_mut();
            place.zip(jacobian.iter()).for_each(|(to, x)| *to += x);
        }
        self.entries.push(Entry::SetAside);
    }

    pub(super) fn add_multiple(&mut self, a: usize, b: usize, factor: &Matrix3<f64>) {
        if self.recording {
            self.numbers.extend_from_slice(factor.as_slice());
            self.entries.push(Entry::AddMultiple { a: a as u8, b: b as u8 });
        }
    }

    pub(super) fn scale(&mut self, block: usize, by: &Vector3<f64>) {
        if self.recording {
            self.numbers.extend_from_slice(by.as_slice());
            self.entries.push(Entry::Scale { block: block as u8 });
        }
    }

    pub(super) fn isolate<const B: usize>(&mut self, covariance: &BlockCovariance<B>, block: usize) {
        if self.recording {
            self.row(covariance, block);
            self.entries.push(Entry::Isolate { block: block as u8 });
        }
    }

    pub(super) fn copy<const B: usize>(&mut self, covariance: &BlockCovariance<B>, from: usize, to: usize) {
        if self.recording {
            self.row(covariance, to);
            self.entries.push(Entry::Copy { from: from as u8, to: to as u8 });
        }
    }

    pub(super) fn common_noise(&mut self, blocks: &[usize], variance: &Vector3<f64>) {
        if self.recording {
            self.numbers.extend_from_slice(variance.as_slice());
            let blocks = blocks.iter().fold(0, |set, block| set | (1u64 << block));
            self.entries.push(Entry::CommonNoise { blocks });
        }
    }

    fn row<const B: usize>(&mut self, covariance: &BlockCovariance<B>, block: usize) {
        for other in 0..B {
            self.numbers.extend_from_slice(covariance.block(block, other).as_slice());
        }
    }
}
