//! One task for each live session: it alone owns the walk, so batches, visits and the end of a
//! session happen in one order, the one in which they are stored.
//!
//! Write first, then tell: what comes out of a batch goes to the writer together with the batch, and
//! only when that is on disk does the device hear its acknowledgement and the hub of the changes. The
//! actor does not wait for the disk in between: what comes meanwhile is gathered, and written together next
//! (`to_disk`).

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use futures_util::StreamExt;
use futures_util::future::{BoxFuture, FutureExt};
use futures_util::stream::FuturesOrdered;
use lodestep_engine::event::TrackPoint;
use lodestep_engine::parse::batch::{Batch, StreamKey};
use lodestep_engine::parse::live_message::{Answer, FaultMessage, VisitMessage};
use lodestep_engine::stream::{Kind, Readings, StreamId};
use time::OffsetDateTime;
use tokio::sync::mpsc;
use tokio::time::{Instant, MissedTickBehavior, interval, sleep_until};

use super::device::{self, Device, ToDevice};
use super::live_session::{Findings, LiveSession};
use super::pace::Pace;
use super::pose_hub::ToldPose;
use super::rebuild;
use super::sequence::{Arrival, Sequence};
use super::to_disk::{Gathered, Then, Written};
use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::sessions::anomaly_runs::Growing;
use crate::state::App;
use crate::store::raw_chunks::Samples;
use crate::store::sessions::{Session, SessionState};
use crate::store::stream_visits::StreamVisit;
use crate::store::track::{self, Place};
use crate::store::visits::{self, Origin, Visit};
use crate::store::{StoreError, anomalies, sessions};
use crate::utc;
use crate::wire::{Change, Motion, Position};
use crate::{api, jobs};

/// Writes that may be on their way to the disk; more make the device wait.
const MOST_UNDERWAY: usize = 8;
/// Samples that are gathered while a write is on its way; more make the device wait.
const MOST_GATHERED: usize = 1_000;
/// An inspector of whom nothing comes for this long is shown as silent.
const SILENT_AFTER: Duration = Duration::from_secs(3);
/// A session that no device asks for is put away after this long; it comes back from the disk.
const PUT_AWAY_AFTER: Duration = Duration::from_secs(15 * 60);

/// What an actor is asked to do.
#[derive(Debug)]
pub(crate) enum Command {
    /// A device has come; it takes the place of the one before.
    Attach(Device),
    /// The socket of this number has closed.
    Detach(u64),
    /// Samples, and when they came.
    Batch(Batch, OffsetDateTime),
    /// The inspector stood at a marker; told by this caller.
    Visit(VisitMessage, Caller),
    /// Visits that were told in another way, and are on disk.
    StoredVisits(Vec<Visit>),
    /// A visit was taken back, or automatic mode was switched.
    Again,
    /// The inspector found a fault; told by this caller.
    Fault(FaultMessage, Caller),
    /// The walk is over.
    Finish,
}

/// Runs a live session until it is finished, put away, or the disk fails.
pub(super) async fn run(app: App, session: Session, mut inbox: mpsc::Receiver<Command>) {
    match from_disk_without_points(&app, &session).await {
        Ok((rebuilt, stored)) => Actor::new(app, session, rebuilt, stored).run(inbox).await,
        Err(error) => {
            let told = device::told(Error::from(error).into_problem());
            inbox.close();
            while let Some(command) = inbox.recv().await {
                if let Command::Attach(device) = command {
                    device.send(ToDevice::Last(told.clone()));
                }
            }
        }
    }
}

/// The same by the shortest way, with those points alone that had not been written yet.
async fn from_disk_without_points(
    app: &App,
    session: &Session,
) -> Result<(rebuild::Rebuilt, Stored), StoreError> {
    let told = rebuild::Told::of(app, session).await?;
    let mut rebuilt = match rebuild::from_a_saved_state(app, session.id, &told).await? {
        Some(rebuilt) => rebuilt,
        None => rebuild::from_all_samples(app, session.id, &told).await?,
    };
    let db = app.store.read();
    let stored = Stored {
        automatic: automatic_visits(app, session).await?,
        place: track::shown(db, session.id).await?,
        growing: Growing::with(anomalies::rows(db, session.id).await?),
    };
    if let Some((_, last_ns)) = track::span(app.store.read(), session.id).await? {
        rebuilt.findings.points = rebuilt.findings.points.split_off(&(last_ns + 1));
    }
    Ok((rebuilt, stored))
}

/// What is stored of a walk beside what is made from its samples.
struct Stored {
    automatic: Vec<Visit>,
    place: Place,
    growing: Growing,
}

/// A session's walk, and the visits that automatic mode has made of it.
pub(super) async fn from_disk(
    app: &App,
    session: &Session,
) -> Result<(rebuild::Rebuilt, Vec<Visit>), StoreError> {
    let told = rebuild::Told::of(app, session).await?;
    let rebuilt = rebuild::from_all_samples(app, session.id, &told).await?;
    Ok((rebuilt, automatic_visits(app, session).await?))
}

async fn automatic_visits(app: &App, session: &Session) -> Result<Vec<Visit>, StoreError> {
    let mut automatic = visits::of_session(app.store.read(), session.id).await?;
    automatic.retain(|visit| visit.origin == Origin::Automatic);
    Ok(automatic)
}

pub(super) struct Actor {
    pub(super) app: App,
    pub(super) session: Session,
    pub(super) walk: LiveSession,
    /// What may take up the states of this walk.
    pub(super) fits: String,
    pub(super) sequences: BTreeMap<StreamId, Sequence>,
    /// Visits that the walk has been told, with what became of them.
    pub(super) told: Vec<StreamVisit>,
    /// Visits that automatic mode has made.
    pub(super) automatic: Vec<Visit>,
    /// Something was decided that changes what came before.
    pub(super) wants_again: bool,
    pub(super) device: Option<Device>,
    /// What waits for the write before it to reach the disk.
    pub(super) gathered: Gathered,
    /// Points that wait to be written.
    pub(super) points: BTreeMap<i64, TrackPoint>,
    pub(super) points_at: Instant,
    pub(super) underway: FuturesOrdered<BoxFuture<'static, Written>>,
    /// When the next write of samples may begin.
    pub(super) pace: Pace,
    /// In which place its result lies.
    pub(super) place: Place,
    /// What was found wrong so far.
    pub(super) growing: Growing,
    /// Where the inspector was shown last.
    pub(super) newest: Option<Position>,
    /// The time of the pose that was told last, ns, and what corrects poses.
    posed_ns: i64,
    pose_aids: Arc<[String]>,
    heard_at: Instant,
}

/// Whether the actor goes on.
pub(super) enum Go {
    On,
    Ended,
}

impl Actor {
    fn new(app: App, session: Session, rebuilt: rebuild::Rebuilt, stored: Stored) -> Actor {
        Actor {
            app,
            session,
            walk: rebuilt.walk,
            fits: rebuilt.fits,
            sequences: rebuilt.sequences,
            told: rebuilt.told,
            automatic: stored.automatic,
            wants_again: false,
            device: None,
            gathered: Gathered::default(),
            points: rebuilt.findings.points,
            points_at: Instant::now(),
            underway: FuturesOrdered::new(),
            pace: Pace::new(Instant::now()),
            place: stored.place,
            growing: stored.growing,
            newest: None,
            posed_ns: i64::MIN,
            pose_aids: Arc::default(),
            heard_at: Instant::now(),
        }
    }

    async fn run(mut self, mut inbox: mpsc::Receiver<Command>) {
        let stopping = self.app.stopping.clone();
        // Asked for once: each new asking takes the lock that all sessions share.
        let stopped = stopping.cancelled();
        tokio::pin!(stopped);
        let mut every_second = interval(Duration::from_secs(1));
        every_second.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut finishing = false;
        loop {
            let (writes_from, is_held_back) = (self.writes_from(), self.is_held_back());
            let go = tokio::select! {
                Some(written) = self.underway.next(), if !self.underway.is_empty() => self.on_written(written),
                command = inbox.recv(), if !finishing && self.takes_more() => match command {
                    Some(Command::Finish) => {
                        finishing = true;
                        self.on_finish().await
                    }
                    Some(command) => self.on_command(command).await,
                    None => Go::Ended,
                },
                _ = every_second.tick() => self.on_tick(),
                () = sleep_until(writes_from), if is_held_back => Go::On,
                () = &mut stopped => Go::Ended,
            };
            if let Go::Ended = go {
                break;
            }
            if self.underway.is_empty() && self.writes_from() <= Instant::now() {
                self.write_gathered();
            }
        }
        // The server stops: what was taken is still written and acknowledged.
        self.all_on_disk().await;
    }

    /// When what was gathered may be written.
    fn writes_from(&self) -> Instant {
        self.pace.from(self.gathered.samples)
    }

    /// Whether something waits for nothing but its time to be written.
    fn is_held_back(&self) -> bool {
        self.underway.is_empty() && !self.gathered.raw.is_empty()
    }

    fn takes_more(&self) -> bool {
        self.underway.len() < MOST_UNDERWAY && self.gathered.samples < MOST_GATHERED
    }

    async fn on_command(&mut self, command: Command) -> Go {
        // A visit has its place among the samples: those before it go to the disk before it.
        if matches!(command, Command::Visit(..) | Command::StoredVisits(_))
            && let Go::Ended = self.all_on_disk().await
        {
            return Go::Ended;
        }
        match command {
            Command::Attach(device) => self.on_attach(device),
            Command::Detach(connection) => {
                if self.device.as_ref().is_some_and(|device| device.connection == connection) {
                    self.device = None;
                }
            }
            Command::Batch(batch, received_at) => self.on_batch(batch, received_at),
            Command::Visit(visit, caller) => self.on_visit(visit, &caller).await,
            Command::StoredVisits(visits) => self.on_stored_visits(visits).await,
            Command::Again => self.wants_again = true,
            Command::Fault(fault, caller) => {
                if let Go::Ended = self.on_fault(fault, &caller).await {
                    return Go::Ended;
                }
            }
            Command::Finish => unreachable!("the loop takes it"),
        }
        if std::mem::take(&mut self.wants_again) { self.work_out_again().await } else { Go::On }
    }

    fn on_attach(&mut self, device: Device) {
        if let Some(before) = self.device.take() {
            let gone = Error::conflict(
                "taken_over",
                "another connection goes on with this session: expected one device a session, found a second; close the one that is not needed",
            );
            before.send(ToDevice::Last(device::told(gone.into_problem())));
        }
        device.send(ToDevice::Answer(Answer::Welcome {
            session_id: self.session.id.to_string(),
            next_sequence: self.sequences.iter().map(|(id, stream)| (*id, stream.next_on_disk())).collect(),
        }));
        self.device = Some(device);
        self.heard_at = Instant::now();
        if self.session.state != SessionState::Live {
            self.session.state = SessionState::Live;
            let id = self.session.id;
            let write = self.app.store.writer().clone();
            let written = async move {
                write
                    .run(move |db| {
                        async move { sessions::set_state(db, id, SessionState::Live, None).await }.boxed()
                    })
                    .await
            };
            let told = Change::Session { session: Some(self.session.clone()), deleted: None };
            self.submit(written, Then { changes: vec![told], ..Then::default() });
        }
    }

    fn on_batch(&mut self, batch: Batch, received_at: OffsetDateTime) {
        let came_at = Instant::now();
        self.heard_at = came_at;
        let Batch { stream, sequence, readings } = batch;
        let stream = match self.stream_of(stream, &readings) {
            Ok(stream) => stream,
            Err(wrong) => return self.answer(device::told(wrong.into_problem())),
        };
        let arrived = self.sequences.entry(stream).or_default();
        match arrived.judge(sequence) {
            Arrival::OnDisk => {
                if let Some(sequence) = arrived.last_on_disk() {
                    self.answer(Answer::Ack { stream, sequence });
                }
            }
            Arrival::Underway => {}
            Arrival::Gap { expected } => self.answer(device::sequence_gap(stream, sequence, expected)),
            Arrival::Next => {
                arrived.taken();
                metrics::counter!("lodestep_live_batches_total").increment(1);
                metrics::counter!("lodestep_live_samples_total").increment(readings.len() as u64);
                let mut findings = self.take(stream, &readings, came_at);
                let automatic = self.note_automatic(&findings);
                let changes = self.changes(&mut findings, received_at);
                let gathered = &mut self.gathered;
                gathered.samples += readings.len();
                gathered.raw.push(Samples { stream, first_sequence: sequence, sequences: 1, readings });
                gathered.findings.add(findings);
                gathered.automatic.extend(automatic);
                gathered.then.changes.extend(changes);
                gathered.then.batches.insert(stream, sequence);
            }
        }
    }

    /// Gives the walk its next readings, and tells each new pose at once where somebody listens.
    fn take(&mut self, stream: StreamId, readings: &Readings, came_at: Instant) -> Findings {
        let Some(listeners) = self.app.poses.listeners(self.session.id) else {
            return self.walk.take(stream, readings);
        };
        let (posed_ns, aids) = (&mut self.posed_ns, &mut self.pose_aids);
        self.walk.take_each(stream, readings, |session| {
            let Some(pose) = session.pose().filter(|pose| pose.t_ns > *posed_ns) else { return };
            *posed_ns = pose.t_ns;
            if aids.is_empty() {
                *aids = session.aid_names().into();
            }
            // Who has gone meanwhile hears nothing.
            let _ = listeners.send(ToldPose { pose, came_at, aids: Arc::clone(aids) });
        })
    }

    /// The stream of the session that a batch is of, where its readings are such as the stream has.
    fn stream_of(&self, key: StreamKey, readings: &Readings) -> Result<StreamId> {
        let system = self.session.declaration();
        let known = self.session.declared_streams().into_iter().find(|stream| match key {
            StreamKey::Number(number) => stream.number == number,
            StreamKey::Id(id) => stream.id == id,
        });
        let Some(stream) = known else {
            let names: Vec<&str> = self.session.streams.iter().map(StreamId::name).collect();
            let found = match key {
                StreamKey::Number(number) => format!("stream number {number}"),
                StreamKey::Id(id) => format!("the stream {id}"),
            };
            return Err(Error::invalid(
                "wrong_foot",
                format!(
                    "expected readings of the streams that the session was begun with ({}), found {found}: begin a session with all of its streams",
                    names.join(", ")
                ),
            ));
        };
        let columns = system.rule_of(&stream).map_or(0, |rule| rule.columns.len());
        let fits = match readings {
            Readings::Imu(_) => stream.kind == Kind::Imu,
            Readings::Values(rows) => stream.kind == Kind::Values && rows.columns() == columns,
        };
        if !fits {
            let expected = match stream.kind {
                Kind::Imu => "samples of an inertial sensor".to_owned(),
                Kind::Values => format!("rows of {columns} numbers"),
            };
            let found = match readings {
                Readings::Imu(_) => "samples of an inertial sensor".to_owned(),
                Readings::Values(rows) => format!("rows of {}", rows.columns()),
            };
            return Err(Error::invalid(
                "wrong_readings",
                format!(
                    "expected {expected} of the stream {}, found {found}: send what the {} system declares for it",
                    stream.id, system.name
                ),
            ));
        }
        Ok(stream.id)
    }

    async fn on_fault(&mut self, message: FaultMessage, caller: &Caller) -> Go {
        // What is underway may hold the inspector's position at that time.
        if let Go::Ended = self.all_on_disk().await {
            return Go::Ended;
        }
        let told = match api::faults::report_live(&self.app, caller, &self.session, message).await {
            Ok(fault) => device::event(&Change::Fault { fault }),
            Err(error) => device::told(error.into_problem()),
        };
        self.answer(told);
        Go::On
    }

    async fn on_finish(&mut self) -> Go {
        if let Go::Ended = self.all_on_disk().await {
            return Go::Ended;
        }
        let mut findings = self.walk.finish();
        let automatic = self.note_automatic(&findings);
        let changes = self.changes(&mut findings, utc::now());
        self.record(Vec::new(), findings, automatic, Then { changes, ..Then::default() });
        // The stored log is run again from its start, as for an upload: the final track.
        let (app, id) = (self.app.clone(), self.session.id);
        let write = async move { jobs::queue::enqueue_ended_stream(&app, id).await.map(|_job| ()) };
        self.submit(write, Then { finished: true, ..Then::default() });
        Go::On
    }

    fn on_tick(&mut self) -> Go {
        if self.heard_at.elapsed() >= SILENT_AFTER
            && let Some(position) = &mut self.newest
            && position.state != Motion::Silent
        {
            position.state = Motion::Silent;
            position.speed_m_s = 0.0;
            self.app.hub.publish(Change::Position(position.clone()));
        }
        if self.underway.is_empty() && !self.points.is_empty() {
            self.record(Vec::new(), Findings::default(), Vec::new(), Then::default());
        }
        if self.device.is_none() && self.heard_at.elapsed() >= PUT_AWAY_AFTER { Go::Ended } else { Go::On }
    }

    pub(super) fn answer(&mut self, answer: Answer) {
        if let Some(device) = &self.device
            && !device.send(ToDevice::Answer(answer))
        {
            // It takes no answers: without its outbox the socket closes, and the device comes back.
            self.device = None;
        }
    }

    pub(super) fn last_answer(&mut self, answer: Answer) {
        if let Some(device) = self.device.take() {
            device.send(ToDevice::Last(answer));
        }
    }
}
