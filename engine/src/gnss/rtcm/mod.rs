//! RTCM 3: what receivers and casters send, as observations, orbits and a station's place (RTCM 10403.3).
//!
//! Bytes come as they come ([`Decoder::push`]): frames are found among whatever lies between, and one whose checksum is wrong costs
//! no other. Read are MSM4 to 7 of GPS, BeiDou, Galileo and QZSS, 1005 and 1006, and the orbits 1019, 1042 and 1046. Nothing that
//! comes can make it panic.

mod bits;
mod decoder;
mod frames;
mod msm;
mod orbits;
mod signals;
mod station;

pub use decoder::{Counts, Decoder, Message};
pub use station::Station;
