//! The live sessions of this server: at most one actor each.

use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard};

use tokio::sync::mpsc;
use tracing::Instrument;
use uuid::Uuid;

use super::actor::{self, Command};
use super::device::Device;
use crate::state::App;
use crate::store::sessions::Session;
use crate::store::visits::Visit;

/// Messages that may wait for a session's actor; a device that sends more is made to wait.
const MOST_COMMANDS_WAITING: usize = 16;

/// Knows the actor of every live session.
#[derive(Debug, Default)]
pub struct Registry {
    actors: Mutex<HashMap<Uuid, mpsc::Sender<Command>>>,
    connections: AtomicU64,
}

impl Registry {
    /// A number for a new connection.
    pub(crate) fn next_connection(&self) -> u64 {
        self.connections.fetch_add(1, Ordering::Relaxed)
    }

    /// Connects a device with its session's actor, which is started when there is none: from the
    /// stored log, when there is one.
    pub(crate) async fn attach(&self, app: &App, session: &Session, device: Device) -> mpsc::Sender<Command> {
        let mut command = Command::Attach(device);
        loop {
            let actor = self.actor_or_new(app, session);
            match actor.send(command).await {
                Ok(()) => return actor,
                // It has just ended: the next round starts another.
                Err(unsent) => {
                    self.forget(session.id, &actor);
                    command = unsent.0;
                }
            }
        }
    }

    /// Gives visits that are on disk to a session that is live on this server; any other will use them
    /// in its next run.
    pub(crate) async fn add_visits(&self, session_id: Uuid, visits: Vec<Visit>) {
        let actor = self.lock().get(&session_id).cloned();
        if let Some(actor) = actor {
            // One that has just ended has no use for them.
            let _ = actor.send(Command::StoredVisits(visits)).await;
        }
    }

    /// A visit of a session was taken back, or its automatic mode was switched: when it is live on this
    /// server, its walk is worked out again.
    pub(crate) async fn work_out_again(&self, session_id: Uuid) {
        let actor = self.lock().get(&session_id).cloned();
        if let Some(actor) = actor {
            // One that has just ended is made from the store when its device comes back.
            let _ = actor.send(Command::Again).await;
        }
    }

    /// Ends a session whose device will not say so; as if it had. What it has sent is worked out by a job.
    pub(crate) async fn finish(&self, app: &App, session: &Session) {
        loop {
            let actor = self.actor_or_new(app, session);
            match actor.send(Command::Finish).await {
                Ok(()) => return,
                // It has just ended: the next round starts another.
                Err(_) => self.forget(session.id, &actor),
            }
        }
    }

    fn actor_or_new(&self, app: &App, session: &Session) -> mpsc::Sender<Command> {
        let mut actors = self.lock();
        let start = || {
            metrics::gauge!("lodestep_live_sessions").increment(1);
            let (actor, inbox) = mpsc::channel(MOST_COMMANDS_WAITING);
            let (app, session, own) = (app.clone(), session.clone(), actor.downgrade());
            tokio::spawn(async move {
                let id = session.id;
                // What is logged about this walk names it and its inspector.
                let span =
                    tracing::info_span!("session", session_id = %id, inspector_id = %session.inspector_id);
                actor::run(app.clone(), session, inbox).instrument(span).await;
                if let Some(own) = own.upgrade() {
                    app.live.forget(id, &own);
                }
            });
            actor
        };
        actors.entry(session.id).or_insert_with(start).clone()
    }

    /// Takes an actor that has ended off the list, unless another is there by now.
    fn forget(&self, session_id: Uuid, ended: &mpsc::Sender<Command>) {
        let mut actors = self.lock();
        if actors.get(&session_id).is_some_and(|actor| actor.same_channel(ended)) {
            actors.remove(&session_id);
            metrics::gauge!("lodestep_live_sessions").decrement(1);
        }
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<Uuid, mpsc::Sender<Command>>> {
        self.actors.lock().expect("nothing panics while it holds the list")
    }
}
