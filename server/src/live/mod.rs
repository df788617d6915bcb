//! Walks as they happen: the device socket in, the feed out.
//!
//! In the order of the data: [`device_socket`] speaks with a device; [`registry`] knows the actor of
//! each live session; an [`actor`] owns one [`live_session`] (the engine's session), numbers its batches with
//! [`sequence`], weighs each [`visit`], computes the track anew ([`recompute`]) when one is taken back, chooses by [`thinning`]
//! what is stored and shown, and can be made again from the stored log by [`rebuild`]; what it seldom needs lies in the [`input_file`]. What is on disk goes as [`changes`] to the [`hub`], which keeps the [`snapshot`] with its
//! [`trail`]s and is what the [`feed`] sends to dashboards. A control system cannot wait for the disk: to it the [`pose_hub`] tells each
//! pose at once, by the [`pose_socket`].

use crate::http::{Needs, Routes};
use crate::rights::Right;

pub mod hub;
pub mod registry;
pub mod snapshot;
pub mod trail;

mod actor;
mod changes;
mod device;
mod device_socket;
mod feed;
mod hello;
mod input_file;
mod live_session;
mod pace;
mod pose_frame;
mod pose_hub;
mod pose_socket;
mod rebuild;
mod recompute;
mod sequence;
mod snapshot_from_store;
mod thinning;
mod to_disk;
mod visit;

pub(crate) use input_file::InputFile;
pub(crate) use pose_hub::PoseHub;
pub use snapshot_from_store::{session_changes, snapshot_from_store};

/// The routes below `/api/v1`.
pub(crate) fn routes() -> Routes {
    Routes::new()
        .get("/live", Needs::Socket(Right::Walk), device_socket::open)
        .about("open_device_socket", "The websocket of a device: docs/wire.md")
        .get("/feed", Needs::Socket(Right::Read), feed::open)
        .about("open_feed", "The websocket of a dashboard: docs/wire.md")
        .get("/sessions/{id}/poses", Right::Read, pose_socket::open)
        .about("open_poses", "The poses of a live session for a control system: docs/poses.md")
}
