//! `lodestep load`: many inspectors at once against a server, and whether it kept what it acknowledged.
//!
//! Everything is seen from outside: devices stream over the live socket, a dashboard listens to the feed, and in
//! the end every stored sample is fetched and held against what was sent.

mod api;
mod audit;
mod dashboard;
mod delays;
mod device;
mod nuisance;
mod own_server;
mod table;
mod trouble;
mod uploads;
mod walks;

use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result};
use clap::Args;
use tokio::time::{Instant, sleep_until};

use self::api::{Api, Process};
use self::delays::Delays;
use self::device::{Device, Plan, Storm};
use self::walks::Walks;
use crate::cli::failure::Failure;
use crate::cli::stopping::asked_to_stop;
use crate::cli::{print, progress};

/// The arguments of `lodestep load`.
#[derive(Debug, Args)]
pub(super) struct LoadArgs {
    /// The server to load, such as `http://127.0.0.1:8080`; without it one is started for the purpose, in a folder
    /// of its own that is removed afterwards
    #[arg(long, value_name = "URL")]
    url: Option<String>,

    /// Bearer token for that server, with the rights of an engineer
    #[arg(long, env = "LODESTEP_TOKEN", value_name = "TOKEN", hide_env_values = true)]
    token: Option<String>,

    /// Where the server that is started keeps its data meanwhile [default: the system's folder for temporary files]
    #[arg(long, value_name = "FOLDER", conflicts_with = "url")]
    data: Option<std::path::PathBuf>,

    /// How many walk at once, two feet each
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=20_000))]
    inspectors: u32,

    /// For how long, s
    #[arg(long, value_name = "S", default_value_t = 60, value_parser = clap::value_parser!(u32).range(20..=36_000))]
    seconds: u32,

    /// Samples of a second of a foot
    #[arg(long, value_name = "HZ", default_value_t = 100, value_parser = clap::value_parser!(u32).range(20..=1_000))]
    rate_hz: u32,

    /// How much a device gathers before it sends, ms
    #[arg(long, value_name = "MS", default_value_t = 200, value_parser = clap::value_parser!(u32).range(10..=5_000))]
    frame_ms: u32,

    /// Dashboards that listen as fast as they can
    #[arg(long, value_name = "N", default_value_t = 1)]
    dashboards: u32,

    /// Dashboards that say hello and never read, from the middle of the run on
    #[arg(long, value_name = "N", default_value_t = 0)]
    silent_dashboards: u32,

    /// Connections that send a byte of a request every few seconds, from the middle of the run on
    #[arg(long, value_name = "N", default_value_t = 0)]
    slow_loris: u32,

    /// Cuts every device in the middle of the run; all come back within 5 s of each other, after so long, with
    /// everything gathered meanwhile to send, s
    #[arg(long, value_name = "S")]
    storm: Option<u32>,

    /// Logs of 50 MB, the two feet of a walk of 45 minutes, handed in at once from the middle of the run on
    #[arg(long, value_name = "N", default_value_t = 0)]
    uploads: u32,

    /// In the middle of the run a walk of so many hours is worked out again, another such is removed, 100,000 markers are imported
    /// and reverted, a log of milliseconds is handed in ten times, and a backup is made
    #[arg(long, value_name = "HOURS")]
    trouble: Option<f64>,

    /// The same seed walks the same walks
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

/// All come back within this time of each other.
const COME_BACK_WITHIN: Duration = Duration::from_secs(5);
/// What is still on its way at the end has this long.
const LAST_ACKNOWLEDGEMENTS_WITHIN: Duration = Duration::from_secs(60);

/// Loads a server and prints what came of it.
pub(super) fn load(args: &LoadArgs) -> Result<()> {
    if args.storm.is_some_and(|away_s| args.seconds < 2 * (away_s + 30)) {
        return Err(Failure::usage(
            "a storm needs half a minute before it and as long after it: make --seconds at least twice --storm and a minute"
                .to_owned(),
        ));
    }
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()
        .context("the threads of the load cannot be started")?;
    let walks = Arc::new(walks::make(args.seed, args.seconds, args.rate_hz, args.frame_ms)?);
    let log = if args.uploads > 0 { Some(uploads::Walk::make(args.seed)?) } else { None };
    runtime.block_on(async {
        let stop = asked_to_stop()?;
        tokio::select! {
            done = run(args, &walks, log) => done,
            // The server of its own ends with it.
            () = stop => Err(anyhow::anyhow!("it was stopped before its end: nothing was compared")),
        }
    })
}

async fn run(args: &LoadArgs, walks: &Arc<Walks>, log: Option<uploads::Walk>) -> Result<()> {
    let own = match &args.url {
        Some(_) => None,
        None => Some(own_server::OwnServer::start(args.data.as_deref()).await?),
    };
    let url = args.url.as_deref().or(own.as_ref().map(own_server::OwnServer::url)).unwrap_or_default();
    let api = Api::new(url, args.token.as_deref())?;
    if own.is_some() {
        api.import_anchors().await?;
    }
    let sessions = api.begin_sessions(args.inspectors).await?;

    let trouble = match args.trouble {
        Some(hours) => Some(trouble::make_ready(&api, args.seed, hours).await?),
        None => None,
    };
    let frame_every = Duration::from_millis(args.frame_ms.into());
    let start = Instant::now() + Duration::from_secs(2);
    let plan = Arc::new(Plan { start, frame_every, frames: walks.frames(), storm: storm(args, start) });
    let middle = start + frame_every * (walks.frames() / 2) as u32;
    let sent = Arc::new(dashboard::Sent::new(sessions.len(), walks.frames(), start));

    let mut listening = Vec::new();
    for _ in 0..args.dashboards {
        let socket = api.socket("/feed").await?;
        listening.push(tokio::spawn(dashboard::listen(
            socket,
            sessions.clone(),
            Arc::clone(&sent),
            frame_every,
        )));
    }
    let mut nuisances = Vec::new();
    for _ in 0..args.silent_dashboards {
        nuisances.push(tokio::spawn(nuisance::silent_dashboard(api.clone(), middle)));
    }
    for number in 0..args.slow_loris {
        nuisances.push(tokio::spawn(nuisance::slow_loris(api.clone(), middle, number)));
    }
    let handed_in =
        log.map(|log| tokio::spawn(uploads::hand_in(api.clone(), Arc::new(log), args.uploads, middle)));

    let trouble = trouble.map(|ready| tokio::spawn(trouble::all_at_once(api.clone(), ready, middle)));

    let devices: Vec<_> = sessions
        .iter()
        .enumerate()
        .map(|(number, session_id)| {
            let phase = frame_every.mul_f64(number as f64 / sessions.len() as f64);
            let device =
                Device::new(number, *session_id, api.clone(), Arc::clone(walks), Arc::clone(&plan), phase);
            tokio::spawn(device.stream(Arc::clone(&sent)))
        })
        .collect();

    let bar = progress::of_count(args.seconds.into(), "s");
    let mut seen = Vec::new();
    for second in 0..=args.seconds {
        sleep_until(start + Duration::from_secs(second.into())).await;
        bar.set_position(second.into());
        // Seldom: to make the figures costs the server something, too.
        if second % 10 == 0 || second == args.seconds {
            seen.push((second, api.process().await?));
        }
    }
    bar.finish_and_clear();

    let mut acknowledged = Delays::halves(middle);
    let mut outcomes = Vec::new();
    for (number, device) in devices.into_iter().enumerate() {
        let ended = tokio::time::timeout(LAST_ACKNOWLEDGEMENTS_WITHIN, device).await;
        let outcome = ended
            .map_err(|_| {
                anyhow::anyhow!(
                    "device {number} still waits for acknowledgements a minute after its last frame"
                )
            })?
            .context("a device stopped")??;
        acknowledged.extend(&outcome.delays);
        outcomes.push(outcome);
    }
    let finished = Instant::now();
    for nuisance in nuisances {
        nuisance.abort();
    }
    let mut shown = Delays::halves(middle);
    for dashboard in listening {
        dashboard.abort();
    }
    shown.extend(&sent.delays());
    let handed_in = match handed_in {
        Some(task) => Some(task.await.context("the uploads stopped")??),
        None => None,
    };
    let troubles = match trouble {
        Some(task) => task.await.context("the trouble stopped")??,
        None => Vec::new(),
    };
    let audit = audit::audit(&api, walks, &sessions, &outcomes).await?;
    let result = table::Result {
        args,
        took: finished - start,
        outcomes: &outcomes,
        acknowledged: &acknowledged,
        shown: &shown,
        seen: &seen,
        audit: &audit,
        handed_in: handed_in.as_deref(),
        troubles: &troubles,
    };
    print::print(&result.text())?;
    if let Some(own) = own {
        own.stop().await?;
    }
    if audit.is_clean() {
        Ok(())
    } else {
        Err(anyhow::anyhow!("samples that were acknowledged are not stored as they were sent: see the table"))
    }
}

/// What every device does in the middle of the run, when it is to.
fn storm(args: &LoadArgs, start: Instant) -> Option<Storm> {
    args.storm.map(|away_s| {
        let cut_at = start + Duration::from_secs((args.seconds / 2).saturating_sub(away_s).max(20).into());
        Storm { cut_at, back_at: cut_at + Duration::from_secs(away_s.into()), within: COME_BACK_WITHIN }
    })
}

/// The process's figures at some moments of the run, s.
type Seen = [(u32, Process)];
