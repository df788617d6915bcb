//! Where each error state stands: three-vectors in the order of paper 1, §2.2, foot by foot.

/// Error states of one sensor, as three-vectors.
pub const BLOCKS_A_SENSOR: usize = 5;

/// The five three-vectors of one sensor's error state.
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
