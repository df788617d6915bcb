//! What only a walker's track is judged by: how far apart its feet are, and which contacts were taken for stances.

mod feet_apart;
mod stances;

pub use feet_apart::{FeetApart, feet_apart};
pub use stances::{FootInstant, StanceErrors, foot_instants, stances};
