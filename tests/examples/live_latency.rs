//! How long it takes from a sample that is sent to its point on the feed, under the load of many inspectors.
//!
//! `cargo run --release -p lodestep-tests --example live_latency -- [INSPECTORS] [SECONDS]` (50 and 60).
//! Each inspector streams two feet at 100 Hz, a frame of ten samples each a tenth of a second, through
//! the real websocket of a real server in this process; a dashboard listens. The detector needs samples
//! from after a moment to judge it: which frame that moment's point had to wait for is found by running
//! the same frames through the engine beforehand, and the time is taken from the sending of that frame.

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use std::collections::HashMap;
use std::time::Duration;

use lodestep_engine::event::Event;
use lodestep_engine::geo::Site;
use lodestep_engine::parse::live_message::Answer;
use lodestep_engine::session::{Session, SessionConfig};
use lodestep_engine::sim::pedestrian::{SensorModel, Walk, WalkKind, simulate};
use lodestep_engine::systems::pedestrian::{self, Side};
use lodestep_tests::device::TestDevice;
use lodestep_tests::feed::TestFeed;
use lodestep_tests::server::TestServer;
use serde_json::{Value, json};
use tokio::time::{Instant, sleep_until};

/// Samples in a frame, and how often one goes out.
const FRAME: usize = 10;
const FRAME_EVERY: Duration = Duration::from_millis(100);
/// The standing start is told all at once when it has been used; it says nothing about the way.
const FROM_NS: i64 = 15_000_000_000;
const FROM_FRAME: usize = 150;

#[tokio::main]
async fn main() {
    let mut arguments = std::env::args().skip(1).map(|text| text.parse::<usize>().expect("a whole number"));
    let inspectors = arguments.next().unwrap_or(50);
    let seconds = arguments.next().unwrap_or(60);
    let kind = WalkKind::Line { metres: 1.3 * seconds as f64 };
    let site = Site::fast();
    let mut walk = simulate(&kind, 1, &site, &SensorModel::cmp10a());
    walk.left.truncate(100 * seconds);
    walk.right.truncate(100 * seconds);
    let frame_of = frames_that_release(&walk, &site);

    let server = TestServer::start().await;
    let (feed, _) = TestFeed::open(&server).await;
    let mut sessions = HashMap::new();
    let mut devices = Vec::new();
    for number in 0..inspectors {
        let name = json!({"name": format!("inspector {number}")});
        let created = server.client.post(server.api("/inspectors")).json(&name).send().await;
        let created: Value = created.expect("an answer").json().await.expect("an inspector");
        let inspector = created["id"].as_str().expect("an id");
        let (device, session_id) = TestDevice::begin(&server, inspector).await;
        sessions.insert(session_id, number);
        devices.push(device);
    }
    let start = Instant::now() + Duration::from_millis(200);
    let listening = tokio::spawn(listen(feed, sessions, walk.left.last().map_or(0, |last| last.t_ns)));
    let streaming: Vec<_> = devices
        .into_iter()
        .enumerate()
        .map(|(number, device)| {
            // Not all in the same instant, as no two devices are.
            let phase = FRAME_EVERY.mul_f64(number as f64 / inspectors as f64);
            tokio::spawn(stream(device, start + phase, walk.left.clone(), walk.right.clone()))
        })
        .collect();
    let mut sent_at = Vec::new();
    let mut acknowledged = Vec::new();
    for task in streaming {
        let (sent, delays) = task.await.expect("a device streams to the end");
        sent_at.push(sent);
        acknowledged.extend(delays.into_iter().skip(FROM_FRAME));
    }
    let arrivals = listening.await.expect("the dashboard listens to the end");
    let delays: Vec<Duration> = arrivals
        .into_iter()
        .filter(|arrival| arrival.t_ns >= FROM_NS)
        .map(|arrival| arrival.at.duration_since(sent_at[arrival.inspector][frame_of[&arrival.t_ns]]))
        .collect();
    println!(
        "{inspectors} inspectors, two feet at 100 Hz, {seconds} s, of which the first 15 s do not count"
    );
    report("frame sent to its point on the feed", delays);
    report("frame sent to its acknowledgement (on disk)", acknowledged);
    server.stop().await;
}

/// For the time of each point: the number of the frame after which it is known. Left and right frames
/// of a number go out together, left first.
#[expect(clippy::unwrap_used, reason = "a preset that is refused is a fault of the program")]
fn frames_that_release(walk: &Walk, site: &Site) -> HashMap<i64, usize> {
    let config = SessionConfig {
        declination_rad: site.declination_deg.to_radians(),
        site_field: Some(site.field()),
        gravity_m_s2: site.gravity_m_s2,
        max_lead_ns: Some(1_000_000_000),
        ..pedestrian::two_feet()
    };
    let mut session = Session::new(config).unwrap();
    let mut frame_of = HashMap::new();
    let mut events = Vec::new();
    for (number, (left, right)) in walk.left.chunks(FRAME).zip(walk.right.chunks(FRAME)).enumerate() {
        for (foot, samples) in [(Side::Left, left), (Side::Right, right)] {
            for sample in samples {
                session.push(foot, sample, &mut events);
            }
        }
        for event in events.drain(..) {
            if let Event::Point(point) = event {
                frame_of.insert(point.t_ns, number);
            }
        }
    }
    frame_of
}

/// Streams a walk in real time: when each frame was sent, and how long its acknowledgement took.
async fn stream(
    mut device: TestDevice,
    start: Instant,
    left: Vec<lodestep_engine::sample::ImuSample>,
    right: Vec<lodestep_engine::sample::ImuSample>,
) -> (Vec<Instant>, Vec<Duration>) {
    let mut sent_at = Vec::new();
    let mut delays = Vec::new();
    let mut acknowledged = 0;
    for (number, (left, right)) in left.chunks(FRAME).zip(right.chunks(FRAME)).enumerate() {
        let due = start + FRAME_EVERY * number as u32;
        loop {
            tokio::select! {
                biased;
                () = sleep_until(due) => break,
                answer = device.next() => {
                    let Answer::Ack { stream, sequence } = answer else { continue };
                    if stream != Side::Right.stream() {
                        continue;
                    }
                    let next = sequence as usize + 1;
                    let now = Instant::now();
                    delays.extend(sent_at[acknowledged..next].iter().map(|sent| now.duration_since(*sent)));
                    acknowledged = next;
                }
            }
        }
        sent_at.push(Instant::now());
        device.send_frame(Side::Left, number as u64, left).await;
        device.send_frame(Side::Right, number as u64, right).await;
    }
    device.acknowledged(Side::Left, sent_at.len() as u64 - 1).await;
    (sent_at, delays)
}

/// A position that has arrived at the dashboard.
struct Arrival {
    inspector: usize,
    t_ns: i64,
    at: Instant,
}

/// Listens until the newest point of every inspector is near the end of the walk.
async fn listen(mut feed: TestFeed, sessions: HashMap<String, usize>, end_ns: i64) -> Vec<Arrival> {
    let mut arrivals = Vec::new();
    let mut at_the_end = vec![false; sessions.len()];
    while !at_the_end.iter().all(|ended| *ended) {
        let message = feed.next().await;
        let at = Instant::now();
        for change in message["changes"].as_array().into_iter().flatten() {
            if change["kind"] == "position" && change["state"] != "silent" {
                let inspector = sessions[change["session_id"].as_str().expect("a session")];
                let t_ns = change["t_ns"].as_i64().expect("a time");
                at_the_end[inspector] |= t_ns > end_ns - 1_500_000_000;
                arrivals.push(Arrival { inspector, t_ns, at });
            }
        }
    }
    arrivals
}

fn report(what: &str, mut delays: Vec<Duration>) {
    assert!(!delays.is_empty(), "nothing was measured: {what}");
    delays.sort_unstable();
    let at = |share: f64| delays[((delays.len() - 1) as f64 * share).round() as usize].as_secs_f64() * 1e3;
    println!(
        "{what}: p50 {:.1} ms, p99 {:.1} ms, max {:.1} ms ({} of them)",
        at(0.5),
        at(0.99),
        at(1.0),
        delays.len()
    );
}
