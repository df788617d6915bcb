//! How long it takes from a sample of a pole to its tip on the feed, and from the end of a gap to its smoothed points.
//!
//! `cargo run -p lodestep-tests --example pole_live -- [SECONDS]` (60; `--release` for what is shipped). A survey is streamed
//! through the real websocket of a real server in this process while a dashboard listens: up to so many seconds before the sky
//! comes back as fast as the server takes it, from there on in real time, a frame each twentieth of a second. A fix goes out
//! a fifth of a second after its time, as receivers tell them.

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use std::time::Duration;

use lodestep_engine::parse::batch::{Batch, StreamKey};
use lodestep_engine::parse::frame;
use lodestep_engine::parse::live_message::{Answer, DeviceMessage, Hello};
use lodestep_engine::sim::pole::{GnssEpoch, Route, SimulatedSurvey, Trouble, simulate};
use lodestep_engine::stream::{Readings, Rows, StreamId};
use lodestep_engine::systems::pole::DECLARATION;
use lodestep_tests::device::TestDevice;
use lodestep_tests::feed::TestFeed;
use lodestep_tests::server::TestServer;
use tokio::time::{Instant, sleep_until};

const FRAME_NS: i64 = 50_000_000;
/// A fix is told so long after its time.
const FIX_LATE_NS: i64 = 200_000_000;
/// So much is streamed after the sky has come back.
const AFTER_NS: i64 = 12_000_000_000;

/// A batch, and when it goes out by the clock of the survey.
struct Due {
    t_ns: i64,
    batch: Batch,
}

#[tokio::main]
async fn main() {
    let seconds: i64 = std::env::args().nth(1).map_or(60, |text| text.parse().expect("a whole number"));
    let survey = simulate(Route::I(60.0), 1, Trouble::None);
    let pairs = survey.gnss.windows(2).map(|pair| (pair[0].t_ns, pair[1].t_ns));
    let (_, back_ns) = pairs.max_by_key(|(lost, back)| back - lost).expect("a survey has fixes");
    let real_from_ns = back_ns - seconds * 1_000_000_000;
    let site = site_file(&survey);
    let path = site.path().to_owned();
    let server = TestServer::start_with(move |config| config.site = Some(path)).await;
    let (feed, _) = TestFeed::open(&server).await;
    let mut device = TestDevice::connect(&server).await;
    let hello = Hello::Begin {
        inspector_id: server.inspector().await,
        start: None,
        system: Some("pole".to_owned()),
        streams: None,
        initial_heading_deg: None,
        instrument: Some(pole_file(&survey)),
    };
    device.send(&DeviceMessage::Hello(hello)).await;
    let Answer::Welcome { .. } = device.next().await else { panic!("the server does not welcome the pole") };
    let (fast, real): (Vec<Due>, Vec<Due>) =
        dues(&survey, back_ns + AFTER_NS).into_iter().partition(|due| due.t_ns < real_from_ns);
    for due in &fast {
        send(&mut device, &due.batch).await;
        device.next().await;
    }
    let start = Instant::now() + Duration::from_millis(500);
    let at = move |t_ns: i64| start + Duration::from_nanos((t_ns - real_from_ns).max(0).unsigned_abs());
    let listening = tokio::spawn(listen(feed, back_ns));
    for due in &real {
        loop {
            tokio::select! {
                biased;
                () = sleep_until(at(due.t_ns)) => break,
                _ = device.next() => {}
            }
        }
        send(&mut device, &due.batch).await;
    }
    let told = tokio::time::timeout(Duration::from_secs(20), listening).await;
    let Ok(Ok((positions, smoothed))) = told else { panic!("the feed does not tell the end") };
    // A sample goes out with the last one of its frame.
    let sent = |t_ns: i64| at((t_ns + FRAME_NS - 1).div_euclid(FRAME_NS) * FRAME_NS);
    let mut delays: Vec<f64> = positions
        .iter()
        .filter(|(t_ns, _)| *t_ns > real_from_ns + 1_000_000_000)
        .map(|(t_ns, arrived)| arrived.saturating_duration_since(sent(*t_ns)).as_secs_f64() * 1e3)
        .collect();
    delays.sort_by(f64::total_cmp);
    assert!(!delays.is_empty(), "nothing was measured");
    let share = |share: f64| delays[((delays.len() - 1) as f64 * share).round() as usize];
    println!(
        "sample sent to its tip on the feed: p50 {:.1} ms, p99 {:.1} ms, max {:.1} ms ({} of them, {seconds} s and after)",
        share(0.5),
        share(0.99),
        share(1.0),
        delays.len()
    );
    // The gap has ended for the server when the first fix after it is told.
    let told = at(back_ns + FIX_LATE_NS);
    let after = smoothed.iter().find(|arrived| **arrived > told).expect("a gap that ends is smoothed");
    let after_s = after.saturating_duration_since(told).as_secs_f64();
    println!("first fix after the gap sent to the smoothed points on the feed: {after_s:.2} s");
    server.stop().await;
}

/// What goes out, by the time at which it does.
fn dues(survey: &SimulatedSurvey, end_ns: i64) -> Vec<Due> {
    let mut dues = Vec::new();
    let mut add = |number: usize, due_ns: i64, sequence: u64, readings: Readings| {
        let id = StreamId::read(["imu", "gnss", "switch"][number]).expect("a name of the declaration");
        dues.push(Due { t_ns: due_ns, batch: Batch { stream: StreamKey::Id(id), sequence, readings } });
    };
    let frame_of = |t_ns: i64| (t_ns + FRAME_NS - 1).div_euclid(FRAME_NS);
    let frames = survey.imu.chunk_by(|a, b| frame_of(a.t_ns) == frame_of(b.t_ns));
    for (samples, sequence) in frames.take_while(|samples| samples[0].t_ns < end_ns).zip(0..) {
        let due_ns = frame_of(samples[0].t_ns) * FRAME_NS;
        add(0, due_ns, sequence, Readings::Imu(samples.to_vec()));
    }
    let frame = survey.site.local_frame();
    let early = |epoch: &&GnssEpoch| epoch.t_ns < end_ns;
    for (epoch, sequence) in survey.gnss.iter().take_while(early).zip(0..) {
        let place = frame.to_geodetic(epoch.p_n_m);
        let [e, n, u] = epoch.sigma_n_m;
        let quality = if epoch.quality == "fixed" { 1.0 } else { 2.0 };
        let row = [place.latitude_deg, place.longitude_deg, place.height_m, e, n, u, quality];
        add(1, epoch.t_ns + FIX_LATE_NS, sequence, values(epoch.t_ns, &row));
    }
    for ((t_ns, closed), sequence) in survey.contact.iter().take_while(|(t_ns, _)| *t_ns < end_ns).zip(0..) {
        add(2, *t_ns, sequence, values(*t_ns, &[f64::from(u8::from(*closed))]));
    }
    dues.sort_by_key(|due| due.t_ns);
    dues
}

fn values(t_ns: i64, row: &[f64]) -> Readings {
    let mut rows = Rows::new(row.len());
    rows.push(t_ns, row.iter().copied());
    Readings::Values(rows)
}

async fn send(device: &mut TestDevice, batch: &Batch) {
    let StreamKey::Id(id) = batch.stream else { return };
    let mut bytes = Vec::new();
    let number = DECLARATION.stream(id).map_or(0, |stream| stream.number);
    frame::encode(number, batch, &mut bytes).expect("a frame of one stream has an allowed size");
    device.send_bytes(bytes).await;
}

/// When each position came, and when the smoothed points of the gap.
async fn listen(mut feed: TestFeed, back_ns: i64) -> (Vec<(i64, Instant)>, Vec<Instant>) {
    let (mut positions, mut smoothed) = (Vec::new(), Vec::new());
    loop {
        let message = feed.next().await;
        let now = Instant::now();
        for change in message["changes"].as_array().into_iter().flatten() {
            if change["kind"] == "position" && change["state"] != "silent" {
                let t_ns = change["t_ns"].as_i64().unwrap_or_default();
                positions.push((t_ns, now));
                if t_ns > back_ns + AFTER_NS - 1_000_000_000 {
                    return (positions, smoothed);
                }
            } else if change["kind"] == "revision" {
                smoothed.push(now);
            }
        }
    }
}

fn pole_file(survey: &SimulatedSurvey) -> String {
    format!("[pole]\nantenna_b_m = {:?}\ntip_b_m = {:?}\n", survey.antenna_b_m, survey.tip_b_m)
}

fn site_file(survey: &SimulatedSurvey) -> tempfile::NamedTempFile {
    let site = &survey.site;
    let file = tempfile::Builder::new().suffix(".toml").tempfile().expect("a temporary file");
    let text = format!(
        "name = \"survey\"\nlatitude_deg = {:.10}\nlongitude_deg = {:.10}\nheight_m = {:.4}\n",
        site.latitude_deg, site.longitude_deg, site.height_m
    );
    std::fs::write(file.path(), text).expect("a temporary file takes a text");
    file
}
