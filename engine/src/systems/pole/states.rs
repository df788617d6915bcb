//! Where each error of the pole stands in the error vector.

use crate::ins::layout::{Layout, SensorStates, StateVariable};

/// The errors that are estimated.
#[derive(Debug)]
pub(super) struct States {
    /// Strapdown with scale factors.
    pub(super) imu: SensorStates,
    /// What the gyro's axes read of each other's rates, rad/rad: x of y, y of z, z of x; then x of z, y of x, z of y.
    pub(super) cross: [StateVariable; 2],
    /// What the gyro's bias has more while the pole is walked with, rad/s.
    pub(super) walking: StateVariable,
    /// Lever arm of the antenna, m.
    pub(super) antenna: StateVariable,
    /// By how much the phase centre moves in n as the pole leans by one to the east, and to the north, m.
    pub(super) phase: [StateVariable; 2],
    /// The slow error of the GNSS solution, in n, m.
    pub(super) slow: StateVariable,
    /// Lever arm of the tip, m.
    pub(super) tip: StateVariable,
    /// How far the tip moves as the pole leans by one: it is round, m.
    pub(super) roundness: StateVariable,
    /// Where the tip stands, in n, m: drawn anew at each landing.
    pub(super) place: StateVariable,
    /// What the receiver's clock shows more than the sensor's, s.
    pub(super) clock: StateVariable,
    /// How many blocks there are.
    pub(super) blocks: usize,
}

pub(super) const STATES: States = {
    let mut layout = Layout::of_strapdowns(1);
    let imu = layout.with_scale_factors(0);
    let cross = [layout.add(3), layout.add(3)];
    let walking = layout.add(3);
    let antenna = layout.add(3);
    let phase = [layout.add(3), layout.add(3)];
    let slow = layout.add(3);
    let tip = layout.add(3);
    let roundness = layout.add(1);
    let place = layout.add(3);
    let clock = layout.add(1);
    States {
        imu,
        cross,
        walking,
        antenna,
        phase,
        slow,
        tip,
        roundness,
        place,
        clock,
        blocks: layout.blocks(),
    }
};

/// Three-vectors of the error vector.
pub(super) const BLOCKS: usize = STATES.blocks;
