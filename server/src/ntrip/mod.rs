//! Receivers and casters as sources of bytes: RTCM 3 by NTRIP or over plain TCP, with a word within five seconds when nothing
//! useful comes, and a way back without anybody's help.

mod client;
mod head;
mod source;

pub use client::{Told, follow};
pub use head::{Answer, read as read_answer};
pub use source::Source;
