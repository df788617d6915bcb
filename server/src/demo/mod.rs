//! The demo: a site with its markers, inspectors who walk it in real time, and a recorded walk.
//!
//! Nothing here reaches past the doors that everybody uses. The inspectors' devices are clients of the
//! websocket on loopback, fed by the simulator; the recorded walk is uploaded through the REST routes.
//! The simulator knows nothing of the filter, so what the map shows is what the filter makes of it.

use std::net::SocketAddr;
use std::time::Duration;

use crate::state::App;

mod device;
mod diary;
mod inspector;
mod recorded;
mod seed;
mod trouble;

/// One simulated inspector.
#[derive(Clone, Copy, Debug)]
struct Role {
    name: &'static str,
    /// Chooses the walk's small accidents: other steps, other stops, other sensor errors.
    seed: u64,
    /// How much of the first walk lies in the past when the demo begins, s.
    history_s: f64,
}

/// Who walks. Their pasts differ, so that they are in different parts of the road.
const ROLES: [Role; 4] = [
    Role { name: "李伟 (demo)", seed: 11, history_s: 900.0 },
    Role { name: "王芳 (demo)", seed: 23, history_s: 620.0 },
    Role { name: "张敏 (demo)", seed: 37, history_s: 1_500.0 },
    Role { name: "刘洋 (demo)", seed: 51, history_s: 280.0 },
];

/// After a failure the demo waits this long before it tries again.
const TRY_AGAIN_AFTER: Duration = Duration::from_secs(5);

/// Seeds an empty database and lets the inspectors walk until the server stops.
pub(crate) async fn run(app: App, address: SocketAddr) {
    let inspectors = match seed::seed(&app).await {
        Ok(inspectors) => inspectors,
        Err(error) => {
            tracing::error!(%error, "the demo could not be set up: {error}");
            return;
        }
    };
    let socket = format!("ws://{address}/api/v1/live");
    for (role, inspector_id) in ROLES.into_iter().zip(inspectors) {
        tokio::spawn(inspector::walk_for_ever(app.clone(), socket.clone(), role, inspector_id));
    }
    if let Err(error) = recorded::upload_once(&app).await {
        tracing::error!(%error, "the demo's recorded walk could not be uploaded: {error}");
    }
}
