//! The track of a session: events folded into final points, and these written for others to read.

pub mod csv;
