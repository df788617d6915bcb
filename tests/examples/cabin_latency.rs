//! How long it takes from a sample of the cabin's inertial sensor on the wire to the pose that rests on it, and what a cabin costs.
//!
//! `cargo run --release -p lodestep-tests --example cabin_latency -- PROGRAM [SECONDS] [INSPECTORS]` (60 and 0). PROGRAM is a
//! `lodestep`, which is started as a server of its own on a folder that is removed afterwards. A simulated run comes in real time
//! as a device sends it: each sample in a frame of its own, all rows of a moment of another device in one. A control system listens
//! to the poses. INSPECTORS beside it are `lodestep load`, on the same machine.

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use std::process::Stdio;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use anyhow::{Context as _, Result, bail};
use futures_util::{SinkExt as _, StreamExt as _};
use lodestep_engine::parse::batch::{Batch, StreamKey};
use lodestep_engine::parse::frame;
use lodestep_engine::parse::live_message::{DeviceMessage, Hello};
use lodestep_engine::sample::ImuSample;
use lodestep_engine::sim::cabin::{RunPlan, SimulatedRun, simulate};
use lodestep_engine::stream::{Readings, Rows, StreamId};
use lodestep_engine::systems::cabin::DECLARATION;
use serde_json::{Value, json};
use tokio::net::TcpListener;
use tokio::process::{Child, Command};
use tokio::time::{Instant, sleep, sleep_until, timeout};
use tokio_tungstenite::connect_async_with_config;
use tokio_tungstenite::tungstenite::Message;

/// The pose is being found in the first seconds: they do not count, s.
const FROM_S: u32 = 10;
/// What is told one by one.
const LATE: Duration = Duration::from_millis(10);
/// Between two samples, ns.
const SAMPLE_NS: i64 = 5_000_000;

/// What is on the wire at a time, ns.
type Frame = (i64, Vec<u8>);

#[tokio::main]
async fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let program = arguments.first().context("expected the lodestep program as the first argument")?;
    let seconds: u32 = arguments.get(1).map_or(Ok(60), |text| text.parse())?;
    let inspectors: u32 = arguments.get(2).map_or(Ok(0), |text| text.parse())?;
    let track_s = f64::from(seconds.saturating_sub(70).max(10));
    let run = simulate(&RunPlan { hold_s: 30.0, slew_s: 40.0, track_s, ..RunPlan::default() }, 0);
    let frames = frames(&run, seconds)?;

    let folder = tempfile::tempdir()?;
    let address = TcpListener::bind("127.0.0.1:0").await?.local_addr()?.to_string();
    let mut serve = Command::new(program);
    serve.args(["serve", "--listen", &address, "--data"]).arg(folder.path()).env("LODESTEP_LOG", "warn");
    let _server = serve.stdin(Stdio::null()).kill_on_drop(true).spawn()?;
    let client = reqwest::Client::new();
    let began = Instant::now();
    while client.get(format!("http://{address}/healthz")).send().await.is_err() {
        if began.elapsed() > Duration::from_secs(30) {
            bail!("the server does not answer on {address}");
        }
        sleep(Duration::from_millis(50)).await;
    }
    let beside = (inspectors > 0).then(|| load(program, &address, inspectors, seconds + 25)).transpose()?;
    if beside.is_some() {
        // Until all of them walk.
        sleep(Duration::from_secs(15)).await;
    }

    let inspector = post(&client, &address, "/inspectors", &json!({"name": "cabin"})).await?;
    let id = inspector["id"].as_str().context("an inspector has an id")?.to_owned();
    let mut device = opened(format!("ws://{address}/api/v1/live")).await?;
    let hello = Hello::Begin {
        inspector_id: id,
        start: None,
        system: Some("cabin".to_owned()),
        streams: None,
        initial_heading_deg: None,
        instrument: Some(run.instrument.clone()),
    };
    device.send(Message::text(DeviceMessage::Hello(hello).to_json())).await?;
    let welcome: Value = loop {
        match device.next().await.context("the server closed")?? {
            Message::Text(text) => break serde_json::from_str(text.as_str())?,
            Message::Close(why) => bail!("the server closed: {why:?}"),
            _ => {}
        }
    };
    let session_id = welcome["session_id"].as_str().with_context(|| format!("no welcome: {welcome}"))?;
    let poses = opened(format!("ws://{address}/api/v1/sessions/{session_id}/poses")).await?;

    let samples = (i64::from(seconds) * 1_000_000_000 / SAMPLE_NS) as usize;
    let sent: Arc<Mutex<Vec<Option<Instant>>>> = Arc::new(Mutex::new(vec![None; samples + 2]));
    let listening = tokio::spawn(listen(poses, Arc::clone(&sent)));
    let (mut out, mut answers) = device.split();
    let answering = tokio::spawn(async move { while let Some(Ok(_)) = answers.next().await {} });
    let start = Instant::now() + Duration::from_millis(100);
    let measuring = {
        let (client, address) = (client.clone(), address.clone());
        tokio::spawn(async move {
            sleep_until(start + Duration::from_secs(FROM_S.into())).await;
            (cpu_s(&client, &address).await, Instant::now())
        })
    };
    let mut latest = Duration::ZERO;
    for (t_ns, bytes) in frames {
        let due = start + Duration::from_nanos(t_ns as u64);
        sleep_until(due).await;
        let now = Instant::now();
        if t_ns % SAMPLE_NS == 0 {
            let number = (t_ns / SAMPLE_NS) as usize;
            let mut sent = sent.lock().map_err(|_| anyhow::anyhow!("the listener has stopped"))?;
            if sent[number].is_none() {
                sent[number] = Some(now);
                latest = latest.max(now - due);
            }
        }
        out.send(Message::binary(bytes)).await?;
    }
    let cpu_after_s = cpu_s(&client, &address).await?;
    let (cpu_before_s, since) = measuring.await?;
    let cores = (cpu_after_s - cpu_before_s?) / since.elapsed().as_secs_f64();
    sleep(Duration::from_millis(500)).await;
    drop(out);
    answering.abort();
    let (delays, poses) = timeout(Duration::from_secs(5), listening)
        .await
        .map_or_else(|_| bail!("the poses did not end"), |ended| ended.context("the listener stopped"))?;
    let late: Vec<String> = delays
        .iter()
        .filter(|(_, delay)| *delay > LATE)
        .map(|(sample, delay)| {
            format!("{:.0} ms at {:.1} s", delay.as_secs_f64() * 1e3, *sample as f64 * SAMPLE_NS as f64 / 1e9)
        })
        .collect();
    let mut delays: Vec<Duration> = delays.into_iter().map(|(_, delay)| delay).collect();
    delays.sort_unstable();
    let wanted = samples - (i64::from(FROM_S) * 1_000_000_000 / SAMPLE_NS) as usize;
    let at = |share: f64| delays[((delays.len() - 1) as f64 * share).round() as usize].as_secs_f64() * 1e3;
    println!("{seconds} s at 200 Hz, {inspectors} inspectors beside it; the first {FROM_S} s do not count");
    println!(
        "sample sent to its pose: p50 {:.2} ms, p99 {:.2} ms, longest {:.2} ms",
        at(0.5),
        at(0.99),
        at(1.0)
    );
    println!("longer than {} ms: {} [{}]", LATE.as_millis(), late.len(), late.join(", "));
    println!("poses told: {poses}; samples without one: {} of {wanted}", wanted.saturating_sub(delays.len()));
    println!("the device's own clock was late by {:.2} ms at most", latest.as_secs_f64() * 1e3);
    println!("the server took {:.1} % of a core", 100.0 * cores);
    if let Some(mut beside) = beside {
        beside.kill().await?;
    }
    Ok(())
}

/// A socket that sends each frame at once, as a device does for which milliseconds count.
async fn opened(url: String) -> Result<Socket> {
    let (socket, _) = connect_async_with_config(url, None, true).await?;
    Ok(socket)
}

fn load(program: &str, address: &str, inspectors: u32, seconds: u32) -> Result<Child> {
    let mut load = Command::new(program);
    load.args(["load", "--url", &format!("http://{address}"), "--inspectors", &inspectors.to_string()]);
    load.args(["--seconds", &seconds.to_string()]).stdout(Stdio::null()).stderr(Stdio::null());
    Ok(load.kill_on_drop(true).spawn()?)
}

async fn post(client: &reqwest::Client, address: &str, path: &str, body: &Value) -> Result<Value> {
    let answer = client.post(format!("http://{address}/api/v1{path}")).json(body).send().await?;
    Ok(answer.error_for_status()?.json().await?)
}

/// Seconds of a processor that the server has taken.
async fn cpu_s(client: &reqwest::Client, address: &str) -> Result<f64> {
    let text = client.get(format!("http://{address}/metrics")).send().await?.text().await?;
    let line = text.lines().find_map(|line| line.strip_prefix("process_cpu_seconds_total "));
    Ok(line.context("the server tells its processor time")?.trim().parse()?)
}

type Socket = tokio_tungstenite::WebSocketStream<tokio_tungstenite::MaybeTlsStream<tokio::net::TcpStream>>;

/// From each sample, by its number, to the first pose that rests on it, and how many poses came, until nothing comes for a while.
async fn listen(
    mut poses: Socket,
    sent: Arc<Mutex<Vec<Option<Instant>>>>,
) -> (Vec<(usize, Duration)>, usize) {
    let (mut delays, mut count) = (Vec::new(), 0);
    let mut told = std::collections::HashSet::new();
    let mut last_new = Instant::now();
    while let Ok(Some(Ok(message))) = timeout(Duration::from_secs(2), poses.next()).await {
        let now = Instant::now();
        let Message::Binary(frame) = message else { continue };
        let (Some(t), Some(age)) = (frame.get(16..24), frame.get(24..28)) else { continue };
        let (Ok(t), Ok(age)) = (t.try_into(), age.try_into()) else { continue };
        // The time of the pose is that of its sample and its age.
        let tag_ns = i64::from_le_bytes(t) - i64::from(u32::from_le_bytes(age)) * 1_000;
        let number = ((tag_ns + SAMPLE_NS / 2) / SAMPLE_NS) as usize;
        count += 1;
        if told.insert(number) {
            last_new = now;
            let sent_at = sent.lock().ok().and_then(|sent| sent.get(number).copied().flatten());
            if number as i64 * SAMPLE_NS >= i64::from(FROM_S) * 1_000_000_000 {
                delays.extend(sent_at.map(|sent_at| (number, now - sent_at)));
            }
        } else if now - last_new > Duration::from_millis(400) && count > 2000 {
            // Silent: the run is over.
            break;
        }
    }
    (delays, count)
}

/// All that devices send, each frame with the time at which it goes out.
fn frames(run: &SimulatedRun, seconds: u32) -> Result<Vec<Frame>> {
    let until_ns = i64::from(seconds) * 1_000_000_000;
    let mut all: Vec<(i64, usize, Vec<u8>)> = Vec::new();
    let mut streams: Vec<(&str, Vec<(i64, Readings)>)> = Vec::new();
    let single = |samples: &[ImuSample]| {
        samples.iter().map(|sample| (sample.t_ns, Readings::Imu(vec![*sample]))).collect::<Vec<_>>()
    };
    streams.push(("imu", single(&run.imu)));
    streams.push(("platform_imu", single(&run.platform_imu)));
    let encoders = run.encoders.iter().map(|row| (row.t_ns, [&row.angles_rad[..], &row.legs_m].concat()));
    streams.push(("encoders", together(encoders)));
    let antennas = run.antennas.iter().map(|row| {
        let head = [row.antenna as f64 + 1.0];
        let quality = [f64::from(row.quality)];
        let values = [&head[..], &row.position_n_m, &row.sigma_n_m, &quality, &row.velocity_n_m_s].concat();
        (row.t_ns, values)
    });
    streams.push(("gnss", together(antennas)));
    let rays = run.stations.iter().map(|ray| {
        let places = [ray.station as f64 + 1.0, ray.target as f64 + 1.0];
        (ray.t_ns, [&places[..], &[ray.azimuth_rad, ray.zenith_rad, ray.slant_m]].concat())
    });
    streams.push(("stations", together(rays)));
    let plan = run.plan.iter().map(|row| (row.t_ns, [row.cabin, row.platform].concat()));
    streams.push(("plan", together(plan)));
    for (order, (name, batches)) in streams.into_iter().enumerate() {
        let id = StreamId::read(name).context("a stream of the cabin")?;
        let number = DECLARATION.stream(id).context("a stream of the cabin")?.number;
        for (sequence, (t_ns, readings)) in
            batches.into_iter().take_while(|(t_ns, _)| *t_ns < until_ns).enumerate()
        {
            let batch = Batch { stream: StreamKey::Id(id), sequence: sequence as u64, readings };
            let mut bytes = Vec::new();
            frame::encode(number, &batch, &mut bytes)?;
            all.push((t_ns, order, bytes));
        }
    }
    // Of one time the inertial sensor's comes first: its pose waits for no other device.
    all.sort_by_key(|(t_ns, order, _)| (*t_ns, *order));
    Ok(all.into_iter().map(|(t_ns, _, bytes)| (t_ns, bytes)).collect())
}

/// Rows of one time in one frame.
fn together(rows: impl Iterator<Item = (i64, Vec<f64>)>) -> Vec<(i64, Readings)> {
    let mut frames: Vec<(i64, Rows)> = Vec::new();
    for (t_ns, values) in rows {
        match frames.last_mut() {
            Some((last_ns, rows)) if *last_ns == t_ns => rows.push(t_ns, values),
            _ => {
                let mut rows = Rows::new(values.len());
                rows.push(t_ns, values);
                frames.push((t_ns, rows));
            }
        }
    }
    frames.into_iter().map(|(t_ns, rows)| (t_ns, Readings::Values(rows))).collect()
}
