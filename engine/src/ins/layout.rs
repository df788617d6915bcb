//! Where each error state stands in the error vector of a filter, whatever its sensors.
//!
//! The error vector is made of three-vectors, the blocks. Those of the strapdowns come first, five for each
//! sensor in the order of paper 1, §2.2; behind them stand the variables that a system adds: scale factors,
//! lever arms, delays, whatever it estimates besides. A variable has an index, its first block, and a size.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Error states of one strapdown, as three-vectors.
pub const BLOCKS_A_SENSOR: usize = 5;

/// The five three-vectors of one strapdown's error state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorState {
    /// Attitude error φ in n, rad: true rotation = (I + [φ×]) · estimated.
    Attitude = 0,
    /// Residual gyro bias in b, rad/s: true − estimated.
    GyroBias = 1,
    /// Position error in n, m: estimated − true.
    Position = 2,
    /// Velocity error in n, m/s: estimated − true.
    Velocity = 3,
    /// Residual accelerometer bias in b, m/s²: true − estimated.
    AccelerometerBias = 4,
}

impl ErrorState {
    /// The block of this state of sensor number `sensor`.
    #[inline]
    pub const fn of(self, sensor: usize) -> usize {
        sensor * BLOCKS_A_SENSOR + self as usize
    }
}

/// A state variable of some numbers. It begins a block of its own; what it leaves over of its last block is no
/// error of anything and has no variance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StateVariable {
    block: usize,
    size: usize,
}

impl StateVariable {
    /// Its first block; for a variable of up to three numbers the only one.
    pub const fn block(self) -> usize {
        self.block
    }

    /// How many numbers it has.
    pub const fn size(self) -> usize {
        self.size
    }

    /// Block and axis of its number `k`, counted from 0.
    pub const fn at(self, k: usize) -> (usize, usize) {
        (self.block + k / 3, k % 3)
    }

    /// Its blocks.
    pub const fn blocks(self) -> std::ops::Range<usize> {
        self.block..self.block + self.size.div_ceil(3)
    }
}

/// The states of one strapdown: its five blocks, and its scale factors where they are estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SensorStates {
    sensor: usize,
    gyro_scale: Option<StateVariable>,
    accelerometer_scale: Option<StateVariable>,
}

impl SensorStates {
    /// The strapdown's number among those of the filter.
    pub const fn sensor(&self) -> usize {
        self.sensor
    }

    /// The block of one of its five error states.
    pub const fn block(&self, state: ErrorState) -> usize {
        state.of(self.sensor)
    }

    /// Residual scale factors of the gyro by axis of b, of 1: true − estimated.
    pub const fn gyro_scale(&self) -> Option<StateVariable> {
        self.gyro_scale
    }

    /// Residual scale factors of the accelerometer by axis of b, of 1: true − estimated.
    pub const fn accelerometer_scale(&self) -> Option<StateVariable> {
        self.accelerometer_scale
    }
}

/// Hands out the places of a filter's error vector. It works at compile time, so that the number of blocks can
/// be the filter's parameter:
///
/// ```
/// use lodestep_engine::ins::eskf::Eskf;
/// use lodestep_engine::ins::layout::{Layout, SensorStates, StateVariable};
///
/// struct States {
///     imu: SensorStates,
///     lever_arm: StateVariable,
///     blocks: usize,
/// }
///
/// const STATES: States = {
///     let mut layout = Layout::of_strapdowns(1);
///     let imu = layout.with_scale_factors(0);
///     let lever_arm = layout.add(3);
///     States { imu, lever_arm, blocks: layout.blocks() }
/// };
///
/// let filter = Eskf::<{ STATES.blocks }>::new();
/// assert_eq!(filter.covariance.dense().nrows(), 15 + 6 + 3);
/// assert_eq!(STATES.imu.gyro_scale().map(StateVariable::block), Some(5));
/// assert_eq!(STATES.lever_arm.block(), 7);
/// ```
#[derive(Clone, Debug)]
pub struct Layout {
    strapdowns: usize,
    blocks: usize,
}

impl Layout {
    /// A filter of so many strapdowns, and nothing else yet.
    pub const fn of_strapdowns(strapdowns: usize) -> Layout {
        Layout { strapdowns, blocks: strapdowns * BLOCKS_A_SENSOR }
    }

    /// Adds a variable of `size` numbers.
    pub const fn add(&mut self, size: usize) -> StateVariable {
        let variable = StateVariable { block: self.blocks, size };
        self.blocks += size.div_ceil(3);
        variable
    }

    /// The states of strapdown number `sensor` without scale factors.
    ///
    /// # Panics
    /// When the filter has no strapdown of that number.
    pub const fn without_scale_factors(&self, sensor: usize) -> SensorStates {
        assert!(sensor < self.strapdowns, "the filter has fewer strapdowns");
        SensorStates { sensor, gyro_scale: None, accelerometer_scale: None }
    }

    /// The states of strapdown number `sensor`, with scale factors of gyro and accelerometer.
    ///
    /// # Panics
    /// When the filter has no strapdown of that number.
    pub const fn with_scale_factors(&mut self, sensor: usize) -> SensorStates {
        let states = self.without_scale_factors(sensor);
        let (gyro, accelerometer) = (self.add(3), self.add(3));
        SensorStates { gyro_scale: Some(gyro), accelerometer_scale: Some(accelerometer), ..states }
    }

    /// How many blocks there are so far: the parameter of the filter.
    pub const fn blocks(&self) -> usize {
        self.blocks
    }
}

/// The estimated error of a variable of up to three numbers, of a filter's whole correction.
pub fn correction_of<const B: usize>(
    correction: &[Vector3<f64>; B],
    variable: Option<StateVariable>,
) -> Vector3<f64> {
    variable.map_or_else(Vector3::zeros, |variable| correction[variable.block()])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_of_every_variable_has_a_place_of_its_own() {
        let mut layout = Layout::of_strapdowns(2);
        let sensors = [layout.with_scale_factors(0), layout.without_scale_factors(1)];
        let others = [layout.add(1), layout.add(4), layout.add(6), layout.add(3)];
        let mut blocks: Vec<usize> = Vec::new();
        for sensor in sensors {
            blocks.extend(
                [
                    ErrorState::Attitude,
                    ErrorState::GyroBias,
                    ErrorState::Position,
                    ErrorState::Velocity,
                    ErrorState::AccelerometerBias,
                ]
                .map(|state| sensor.block(state)),
            );
        }
        let scales = [sensors[0].gyro_scale(), sensors[0].accelerometer_scale()];
        for variable in scales.into_iter().flatten().chain(others) {
            blocks.extend(variable.blocks());
            let last = variable.at(variable.size() - 1);
            assert!(variable.blocks().contains(&last.0) && last.0 + 1 == variable.blocks().end);
        }
        assert_eq!(blocks, (0..layout.blocks()).collect::<Vec<_>>());
        assert_eq!(others[1].at(3), (others[1].block() + 1, 0));
        assert!(sensors[1].gyro_scale().is_none());
    }
}
