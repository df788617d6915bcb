//! Which marker is it? Where an inspector stands, the markers within reach with their probabilities.
//!
//! Anchors stand 10 m apart, about as far as a track is off, so one stand alone often leaves a doubt;
//! the errors of the track at neighbouring stands have much in common, so the sequence of markers is
//! found as a whole. `track_error` says how a track's error grows between stands, `markers` finds
//! what is near, `likelihood` weighs one place, `hypotheses` the sequences; `stands` listens to a
//! session's events, and tells stands with their candidates, again when hindsight knows better.

mod automatic;
mod candidates;
mod clock_tie;
mod hypotheses;
mod likelihood;
mod markers;
pub(crate) mod stands;
mod track_error;
mod tuning;

pub use automatic::automatic_visits;
pub use clock_tie::{ClockTie, KeyedVisit, LEAST_MATCHED, TrackStand, tie_clocks};
pub use markers::{Marker, Markers};
pub use tuning::{Identification, IdentificationTuning};
