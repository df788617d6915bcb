//! A simulated inspector who walks the road, stops at actuators, keys in their numbers, reports what
//! is wrong with some of them, and begins again when the walk is over.

use std::time::Duration;

use anyhow::Result;
use lodestep_engine::sim::pedestrian::{SensorModel, Simulator, WalkKind};
use lodestep_engine::systems::pedestrian::Side;
use tokio::time::{Instant, sleep_until};
use uuid::Uuid;

use super::device::Device;
use super::diary::Diary;
use super::trouble::Trouble;
use super::{Role, TRY_AGAIN_AFTER};
use crate::api::sessions::{NewSession, NewStart, begin};
use crate::auth::Caller;
use crate::state::App;
use crate::store::sessions::{self, Filter, SessionState};
use crate::utc;

/// Epochs in a batch while the past is caught up with, and in real time (at 100 Hz: 0.5 s and 0.1 s).
const EPOCHS_CATCHING_UP: usize = 50;
const EPOCHS_IN_REAL_TIME: usize = 10;
/// Between two walks the inspector rests.
const REST: Duration = Duration::from_secs(30);
/// A walk that is further than this behind the clock catches up, ns.
const BEHIND_NS: i64 = 2_000_000_000;

/// Walks until the server stops.
pub(super) async fn walk_for_ever(app: App, url: String, role: Role, inspector_id: Uuid) {
    if let Err(error) = end_left_over(&app, &url, inspector_id).await {
        tracing::warn!(%error, "{}: a walk of the last run could not be ended: {error}", role.name);
    }
    let (mut number, mut history_s) = match past_walks(&app, role, inspector_id).await {
        Ok(past) => past,
        Err(error) => {
            tracing::error!(%error, "{}: the walks before could not be read: {error}", role.name);
            return;
        }
    };
    while !app.stopping.is_cancelled() {
        let walk = Walk { role, number, history_s, inspector_id };
        let pause = tokio::select! {
            walked = walk.walk(&app, &url) => match walked {
                Ok(()) => REST,
                Err(error) => {
                    tracing::warn!(%error, "{}: the walk broke off: {error}", role.name);
                    TRY_AGAIN_AFTER
                }
            },
            () = app.stopping.cancelled() => return,
        };
        tokio::select! {
            () = tokio::time::sleep(pause) => {}
            () = app.stopping.cancelled() => return,
        }
        number += 1;
        history_s = 0.0;
    }
}

/// How many walks this inspector has made, and how long ago the next one may have begun without
/// overlapping the last, s: a demo that is started again goes on, it does not repeat itself.
async fn past_walks(app: &App, role: Role, inspector_id: Uuid) -> Result<(u64, f64)> {
    let filter = Filter { inspector_id: Some(inspector_id), state: None };
    let walks = sessions::list(app.store.read(), filter).await?;
    let now = utc::now();
    let last_end = walks.iter().map(|walk| walk.ended_at.unwrap_or(now)).max();
    let free_s = last_end.map_or(role.history_s, |end| (now - end).as_seconds_f64() - REST.as_secs_f64());
    Ok((walks.len() as u64, free_s.clamp(0.0, role.history_s)))
}

/// Finishes walks that were live when the server stopped: their device is gone for good.
async fn end_left_over(app: &App, url: &str, inspector_id: Uuid) -> Result<()> {
    let filter = Filter { inspector_id: Some(inspector_id), state: Some(SessionState::Live) };
    for session in sessions::list(app.store.read(), filter).await? {
        Device::connect(url, app.auth.own_token(), session.id).await?.finish().await?;
    }
    Ok(())
}

struct Walk {
    role: Role,
    /// Walks of this inspector before it.
    number: u64,
    history_s: f64,
    inspector_id: Uuid,
}

impl Walk {
    async fn walk(&self, app: &App, url: &str) -> Result<()> {
        let seed = self.role.seed + 100 * self.number;
        let site = app.site.clone();
        let mut simulator = tokio::task::spawn_blocking(move || {
            Simulator::new(&WalkKind::Spiral, seed, &site, &SensorModel::cmp10a())
        })
        .await?;
        let clock = Clock::started_before(self.history_s);
        let new = NewSession {
            started_at: Some(utc::now() - Duration::from_secs_f64(self.history_s)),
            title: "Spiral road (demo)".to_owned(),
            start: Some(NewStart::PositionM(simulator.start_n_m())),
            ..NewSession::of(self.inspector_id)
        };
        let session = begin(app, &Caller::itself("demo"), new, SessionState::Created).await?;
        let mut device = Device::connect(url, app.auth.own_token(), session.id).await?;
        let mut diary = Diary::new(simulator.visits(), seed);
        let trouble = Trouble::during(simulator.visits());
        let mut t_ns = 0;
        loop {
            let catching_up = clock.now_ns() - t_ns > BEHIND_NS;
            let epochs = if catching_up { EPOCHS_CATCHING_UP } else { EPOCHS_IN_REAL_TIME };
            let (mut left, mut right) = (Vec::with_capacity(epochs), Vec::with_capacity(epochs));
            for epoch in std::iter::from_fn(|| simulator.next_epoch()).take(epochs) {
                t_ns = epoch.t_ns;
                left.push(epoch.samples[0]);
                right.push(epoch.samples[1]);
            }
            if left.is_empty() {
                break;
            }
            trouble.befall(&mut right);
            sleep_until(clock.at(t_ns)).await;
            device.send(Side::Left, left).await?;
            device.send(Side::Right, right).await?;
            for message in diary.due(t_ns) {
                device.tell(&message).await?;
            }
        }
        device.finish().await
    }
}

/// The walk's clock beside the machine's.
struct Clock {
    /// The instant of now, and what the walk's clock shows then, ns.
    now: Instant,
    now_ns: i64,
}

impl Clock {
    /// A walk that began so long ago.
    fn started_before(seconds: f64) -> Clock {
        Clock { now: Instant::now(), now_ns: (seconds * 1e9) as i64 }
    }

    fn now_ns(&self) -> i64 {
        self.now_ns + self.now.elapsed().as_nanos() as i64
    }

    /// When the walk's clock shows this time; a time of the past is now.
    fn at(&self, t_ns: i64) -> Instant {
        self.now + Duration::from_nanos(u64::try_from(t_ns - self.now_ns).unwrap_or(0))
    }
}
