//! A rover with a satellite receiver and a UWB tag, from the open sky into the hall (paper 5).
//!
//! Everything is in the tangent plane n at the base antenna (east, north, up); position is that of the rover's satellite
//! antenna. Without satellites it is the frame of the anchors, and the position is that of the UWB antenna.
//!
//! # One state, rows of numbers
//!
//! [`state::State`] holds the estimate and its covariance, and knows no sensor. Its first six elements are position and
//! velocity of the satellite antenna. Then comes a block of fixed size for the ranges, then what satellites need: clocks of an
//! epoch and ambiguities, which come and go at the tail, so that the indices before them never move.
//!
//! | from | how many | what | unit |
//! |---|---|---|---|
//! | [`state::POSITION`] = 0 | 3 | position, e n u | m |
//! | [`state::VELOCITY`] = 3 | 3 | velocity | m/s |
//! | [`state::RANGES`] = 6 | 3 · anchors + 1 | for anchor k a slow bias at 6 + 3k, a quick one at 7 + 3k, what a pane adds in sight of satellites at 8 + 3k; last the offset of the ranges' clock | m, s |
//! | after them | changes | clocks of systems and bands, white; single-difference ambiguities | m, cycles |
//!
//! A measurement is a row of (index, coefficient), an innovation *measured − expected*, and a variance:
//! [`state::State::update`]. There is no other way into the state. Rows are scalar, as all noises are independent: clocks are
//! states, so single differences stay so.
//!
//! # How a range enters
//!
//! A range is taken at its own time. The filter moves the state to `t_s − offset` ([`state::State::propagate`]), lets the biases
//! grow, and asks the ranges' part to weigh the reading. With d = position + antenna offset − anchor:
//!
//! range = ‖d‖ + slow + quick (+ pane in sight of satellites) + noise, row: d/‖d‖ at the position, 1 at the biases of this anchor, and at the clock offset
//! −(d/‖d‖)·v, as a range that is stamped late belongs to an earlier place.
//!
//! While the position is vague the second-order term of ‖d‖ (mean and variance) belongs to innovation and noise.
//! Files `ranges*`, `anchors*` and `uwb_alone*` hold this; the rest of the folder does not know what a range is.

pub mod anchors;
pub mod arcs;
pub mod causes;
pub mod computation;
pub mod coupling;
mod declaration;
pub mod differences;
pub mod doubts;
pub mod filter;
pub mod fixing;
pub mod instrument;
mod live;
pub mod lost_tag;
pub mod noise;
pub mod paper;
mod pass;
pub mod ranges;
pub mod ranges_alone;
pub mod ranges_check;
pub mod recording;
pub mod row;
pub mod run;
pub mod satellites;
pub mod smoothing;
pub mod state;
pub mod streams;
mod system;
pub mod told;
pub mod uwb_alone;

pub use declaration::DECLARATION;
