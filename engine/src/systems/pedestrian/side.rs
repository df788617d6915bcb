//! Left and right: the two streams of a walk.

use serde::{Deserialize, Serialize};

use crate::stream::{Kind, Stream, StreamId};

/// The left foot's stream.
pub const LEFT: StreamId = StreamId::named("left");
/// The right foot's stream.
pub const RIGHT: StreamId = StreamId::named("right");
/// Both, left first.
pub const BOTH: [StreamId; 2] = [LEFT, RIGHT];

/// Which foot a sensor is worn on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Side {
    /// The left foot.
    Left,
    /// The right foot.
    Right,
}

impl Side {
    /// Both, left first: the order of every array that is indexed by side, and of a point's parts.
    pub const BOTH: [Side; 2] = [Side::Left, Side::Right];

    /// 0 for the left foot, 1 for the right.
    pub const fn index(self) -> usize {
        match self {
            Side::Left => 0,
            Side::Right => 1,
        }
    }

    /// The other one.
    pub const fn other(self) -> Side {
        match self {
            Side::Left => Side::Right,
            Side::Right => Side::Left,
        }
    }

    /// `left` or `right`.
    pub const fn name(self) -> &'static str {
        match self {
            Side::Left => "left",
            Side::Right => "right",
        }
    }

    /// Its stream.
    pub const fn stream(self) -> StreamId {
        BOTH[self.index()]
    }

    /// The side of a stream.
    pub fn of(stream: StreamId) -> Option<Side> {
        Side::BOTH.into_iter().find(|side| side.stream() == stream)
    }
}

impl From<Side> for StreamId {
    fn from(side: Side) -> StreamId {
        side.stream()
    }
}

/// A foot's stream as a session is told of it.
pub fn stream(side: Side) -> Stream {
    Stream {
        id: side.stream(),
        number: side.index() as u8,
        role: ROLES[side.index()].to_owned(),
        kind: Kind::Imu,
        lever_arm_b_m: None,
    }
}

/// What both streams are to the system.
pub(crate) const ROLES: [&str; 2] = ["left_foot", "right_foot"];
