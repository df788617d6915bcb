//! What the pole measures with, and its streams, by their words.

use crate::event::AidKind;
use crate::stream::StreamId;
use crate::word::Word;

/// Positions of the antenna.
pub(super) const FIX: AidKind = AidKind(Word::declared("fix", 20));
/// A tip that stands on the ground.
pub(super) const TIP: AidKind = AidKind(Word::declared("tip", 21));

/// The inertial sensor.
pub(super) const IMU: StreamId = StreamId::named("imu");
/// The receiver.
pub(super) const GNSS: StreamId = StreamId::named("gnss");
/// The switch in the tip.
pub(super) const SWITCH: StreamId = StreamId::named("switch");
