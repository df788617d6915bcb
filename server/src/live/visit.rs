//! A visit in a live session: looked up, given its place in the stream, weighed, stored, told.

use futures_util::future::FutureExt;
use lodestep_engine::parse::live_message::{Answer, VisitMessage};
use uuid::Uuid;

use super::actor::Actor;
use super::device;
use super::live_session::Findings;
use super::to_disk::Then;
use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::markers::checked_name;
use crate::store::dialect::Connection;
use crate::store::stands::{self, Stand};
use crate::store::stream_visits::{self, StreamVisit};
use crate::store::track::{self, Place, TrackKind};
use crate::store::visits::{self, Origin, Visit};
use crate::store::{StoreError, anomalies, audit, markers, webhook_deliveries};
use crate::utc;
use crate::wire::Change;

impl Actor {
    /// A visit that the device tells of.
    pub(super) async fn on_visit(&mut self, message: VisitMessage, caller: &Caller) {
        match self.visit_of(message).await {
            // It was sent again after a lost link.
            Ok(visit) if self.knows(&visit) => self.answer(device::event(&Change::Visit(visit))),
            Ok(visit) => {
                let answer = device::event(&Change::Visit(visit.clone()));
                if let Err(error) = self.take_visit(visit, Some(caller), vec![answer]).await {
                    self.answer(device::told(error.into_problem()));
                }
            }
            Err(error) => self.answer(device::told(error.into_problem())),
        }
    }

    /// Visits that came by another way than the socket.
    pub(super) async fn on_stored_visits(&mut self, visits: Vec<Visit>) {
        for visit in visits {
            if self.knows(&visit) {
                continue;
            }
            if let Err(error) = self.take_visit(visit, None, Vec::new()).await {
                // It is stored: the final run will use it.
                tracing::warn!(%error, "a visit could not be used in the live track: {error}");
            }
        }
    }

    fn knows(&self, visit: &Visit) -> bool {
        self.told.iter().any(|told| is_same(&told.visit, &visit.marker, visit.t_start_ns))
    }

    /// The stored visit that a message repeats, or a new one.
    async fn visit_of(&mut self, message: VisitMessage) -> Result<Visit> {
        let VisitMessage { marker, t_start_ns, t_end_ns } = message;
        if t_end_ns < t_start_ns {
            return Err(Error::invalid(
                "visit_times",
                format!(
                    "expected t_end_ns at or after t_start_ns, found {t_end_ns} before {t_start_ns}: send when the inspector arrived and left"
                ),
            ));
        }
        let known = self.told.iter().map(|told| &told.visit);
        if let Some(known) = known.into_iter().find(|known| is_same(known, &marker, t_start_ns)) {
            return Ok(known.clone());
        }
        let stored = visits::of_session(self.app.store.read(), self.session.id).await?;
        let stored = stored.into_iter().find(|stored| is_same(stored, &marker, t_start_ns));
        Ok(stored.unwrap_or_else(|| Visit {
            id: Uuid::now_v7(),
            session_id: self.session.id,
            marker,
            t_start_ns,
            t_end_ns,
            origin: Origin::Keyed,
            keyed_shift_ns: 0,
            created_at: utc::now(),
            outcome: None,
        }))
    }

    /// Gives the walk a visit that it does not know; what this caller told goes into the log of changes.
    async fn take_visit(
        &mut self,
        visit: Visit,
        caller: Option<&Caller>,
        answers: Vec<Answer>,
    ) -> Result<()> {
        let Some(marker) = markers::get(self.app.store.read(), &visit.marker).await? else {
            return self.keep_new_point(visit, caller, answers);
        };
        let told = StreamVisit {
            visit,
            after_samples: self.walk.samples_taken(),
            marker_position_m: (marker.e_m, marker.n_m, marker.u_m),
        };
        self.told.push(told.clone());
        // What people say stands before what automatic mode thought.
        let contradicted: Vec<Visit> = self
            .automatic
            .iter()
            .filter(|made| {
                made.marker != told.visit.marker
                    && made.t_start_ns <= told.visit.t_end_ns
                    && made.t_end_ns >= told.visit.t_start_ns
            })
            .cloned()
            .collect();
        self.wants_again |= !contradicted.is_empty();
        let mut findings = self.walk.visit(told.for_engine());
        let mut changes = vec![Change::Visit(told.visit.clone())];
        changes.extend(self.changes(&mut findings, utc::now()));
        let entry = caller.map(|caller| entry(caller, &told.visit));
        let writer = self.app.store.writer().clone();
        let run = (TrackKind::Main, self.place);
        let write = async move {
            writer.run(move |db| write_visit(db, (told, run), entry, contradicted, findings).boxed()).await
        };
        self.submit(write, Then { answers, changes, ..Then::default() });
        Ok(())
    }
}

impl Actor {
    /// A visit of a point that is no marker yet: of what surveys. It corrects nothing, and the final run finds its place.
    fn keep_new_point(&mut self, visit: Visit, caller: Option<&Caller>, answers: Vec<Answer>) -> Result<()> {
        if !self.session.declaration().surveys() {
            return Err(Error::not_found("marker", &visit.marker));
        }
        checked_name(&visit.marker)?;
        let entry = caller.map(|caller| entry(caller, &visit));
        let changes = vec![Change::Visit(visit.clone())];
        let writer = self.app.store.writer().clone();
        let write = async move { writer.run(move |db| keep(db, visit, entry).boxed()).await };
        self.submit(write, Then { answers, changes, ..Then::default() });
        Ok(())
    }
}

async fn keep(db: &mut Connection, visit: Visit, entry: Option<audit::Entry>) -> Result<(), StoreError> {
    // It is there already when it came by another way.
    if visits::insert(&mut *db, &visit).await?
        && let Some(entry) = entry
    {
        audit::insert(&mut *db, &entry).await?;
    }
    Ok(())
}

/// In the form that a list of visits has in the log of changes.
fn entry(caller: &Caller, visit: &Visit) -> audit::Entry {
    caller.did("visit.told", visit.session_id, None, serde_json::to_value([visit]).ok())
}

fn is_same(visit: &Visit, marker: &str, t_start_ns: i64) -> bool {
    visit.marker == marker && visit.t_start_ns == t_start_ns
}

/// A visit and what the walk made of it, all or nothing.
async fn write_visit(
    db: &mut Connection,
    (told, run): (StreamVisit, (TrackKind, Place)),
    entry: Option<audit::Entry>,
    contradicted: Vec<Visit>,
    findings: Findings,
) -> Result<(), StoreError> {
    let session_id = told.visit.session_id;
    keep(db, told.visit.clone(), entry).await?;
    stream_visits::insert(&mut *db, &told).await?;
    for made in &contradicted {
        stands::undo(&mut *db, session_id, made.t_start_ns).await?;
        visits::delete(&mut *db, made.id).await?;
    }
    let anomalies: Vec<_> = findings.new_anomalies().collect();
    let points: Vec<_> = findings.points.into_values().collect();
    track::upsert(db, session_id, run, &points).await?;
    let told: Vec<_> = findings.stands.values().map(Stand::from).collect();
    stands::upsert(db, session_id, &told).await?;
    for outcome in &findings.visits {
        visits::set_outcome(&mut *db, session_id, outcome).await?;
    }
    anomalies::insert(db, session_id, &anomalies).await?;
    for more in &findings.more_anomalies {
        anomalies::add_to_last(&mut *db, session_id, more).await?;
    }
    webhook_deliveries::announce_anomalies(db, session_id, &anomalies).await
}
