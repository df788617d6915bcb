//! How soon a killed server answers again, and how soon a device that comes back is welcomed, after a long walk.

use std::sync::Arc;
use std::time::Duration;

use tempfile::TempDir;
use tokio::time::Instant;

use super::device::Device;
use super::process::Program;
use super::scene::{Scale, Scene};
use super::script::Script;

/// What it took.
#[derive(Clone, Copy, Debug)]
pub struct Restarted {
    /// Samples of both feet that are stored.
    pub samples: u64,
    /// From the start until it answered.
    pub answered_after: Duration,
    /// From the device's first try until its welcome, for which its walk was made again.
    pub welcomed_after: Duration,
}

/// Streams a walk of so many minutes as fast as it is taken, kills the server, starts it and comes back.
pub async fn restart(minutes: f64) -> Restarted {
    // At a usual pace, less the standing start.
    let script = Arc::new(Script::walk((minutes * 60.0 - 14.0) * 1.25, 7));
    let scale = Scale { devices: 1, metres: 0.0, pace: Duration::ZERO, changes: 0 };
    let folder = TempDir::new().expect("a temporary folder can be made");
    let program = Program::on(folder.path());
    let running = program.start().await;
    let scene = Scene::prepare(running.address, &[Arc::clone(&script)], scale).await;
    let (session, promises) = (scene.sessions[0], Arc::clone(&scene.promises));
    let mut device = Device::new(&script, session, scene.address(), Duration::ZERO, &promises);
    device.stream().await;
    running.kill().await;
    let running = program.start().await;
    scene.server_is_at(Some(running.address));
    let begun = Instant::now();
    device.come_back().await;
    let welcomed_after = begun.elapsed();
    let samples = script.samples.iter().map(|samples| samples.len() as u64).sum();
    let answered_after = running.answered_after;
    running.kill().await;
    Restarted { samples, answered_after, welcomed_after }
}
