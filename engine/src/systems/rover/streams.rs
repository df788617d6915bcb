//! The rover's streams and aids by name.

use crate::event::AidKind;
use crate::stream::StreamId;
use crate::word::Word;

/// The rover's observations.
pub const ROVER: StreamId = StreamId::named("rover");
/// The base's.
pub const BASE: StreamId = StreamId::named("base");
/// Ranges of the tag.
pub const RANGES: StreamId = StreamId::named("ranges");
/// Broadcast orbits and clocks: a session may have several, a file each.
pub const NAVIGATION: &str = "navigation";
/// So many at most.
pub const MOST_NAVIGATION: usize = 4;

/// Whether this is a stream of orbits and clocks.
pub fn is_navigation(stream: StreamId) -> bool {
    stream.name().strip_prefix(NAVIGATION).is_some_and(|rest| rest.starts_with('_'))
}

/// Ranges of the tag, as an aid.
pub(super) const RANGING: AidKind = AidKind(Word::declared("ranging", 40));
