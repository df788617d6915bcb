//! The command: sources in, one live session out.

use std::io::Write as _;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, Result};
use clap::Args;
use lodestep_engine::geo::Geodetic;
use lodestep_engine::parse::live_message::Hello;
use lodestep_engine::parse::range_rows;
use lodestep_engine::stream::{Rows, StreamId};
use lodestep_engine::systems::rover::DECLARATION;
use tokio::io::{AsyncBufReadExt, AsyncRead, BufReader, Lines};
use tokio::sync::mpsc;
use tokio::time::{Instant, sleep_until, timeout};

use super::link::{Link, Opening, Said};
use super::observed::{Complete, Observed, Week};
use crate::cli::failure::Failure;
use crate::cli::stopping::asked_to_stop;
use crate::ntrip::{Source, Told, follow};

/// Words of sources that may wait.
const MOST_WAITING: usize = 64;
const FIRST_PAUSE: Duration = Duration::from_secs(1);
const LONGEST_PAUSE: Duration = Duration::from_secs(30);
/// Everything has to be acknowledged within this when it ends.
const END_WITHIN: Duration = Duration::from_secs(30);

/// The arguments of `lodestep stream rover`.
#[derive(Debug, Args)]
pub(super) struct RoverArgs {
    /// The server
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:8080")]
    server: String,

    /// A token with the right to walk, where the server has accounts
    #[arg(long, value_name = "TOKEN", env = "LODESTEP_TOKEN", hide_env_values = true)]
    token: Option<String>,

    /// Whose session it is, by id
    #[arg(long, value_name = "ID", required_unless_present = "session")]
    inspector: Option<String>,

    /// Goes on with a session instead of beginning one
    #[arg(long, value_name = "ID")]
    session: Option<String>,

    /// Anchors, base and tag, TOML
    #[arg(long, value_name = "rover.toml")]
    instrument: Option<PathBuf>,

    /// The rover's receiver: tcp://host:port or ntrip://user:password@host:port/MOUNT
    #[arg(long, value_name = "SOURCE", requires = "base")]
    rover: Option<Source>,

    /// The base's receiver or caster
    #[arg(long, value_name = "SOURCE", requires = "rover")]
    base: Option<Source>,

    /// Orbits from another source, where neither rover nor base sends 1019, 1042 and 1046
    #[arg(long, value_name = "SOURCE", requires = "rover")]
    navigation: Option<Source>,

    /// Ranges of the tag, lines of t_s,anchor,range_m as they come: a file, a pipe, or - for standard input
    #[arg(long, value_name = "FILE", required_unless_present = "rover")]
    ranges: Option<PathBuf>,

    /// Ends when nothing has come for so long, s [default: when it is asked to stop]
    #[arg(long, value_name = "S")]
    until_quiet: Option<f64>,

    /// Where the rover is, for casters that make a base near it: told them every ten seconds
    #[arg(long, value_name = "LAT,LON,H", value_parser = crate::cli::rover::parse_place, allow_hyphen_values = true)]
    near: Option<[f64; 3]>,
}

/// Which source something came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum From {
    Rover,
    Base,
    Navigation,
}

impl From {
    fn name(self) -> &'static str {
        match self {
            From::Rover => "rover",
            From::Base => "base",
            From::Navigation => "navigation",
        }
    }
}

/// Streams until it is asked to stop.
pub(super) async fn run(args: RoverArgs) -> Result<()> {
    let mut link = Link::new(opening(&args)?);
    let near = args.near.map(|[latitude_deg, longitude_deg, height_m]| Geodetic {
        latitude_deg,
        longitude_deg,
        height_m,
    });
    let (to, mut told) = mpsc::channel(MOST_WAITING);
    for (from, source) in
        [(From::Rover, &args.rover), (From::Base, &args.base), (From::Navigation, &args.navigation)]
    {
        if let Some(source) = source {
            tokio::spawn(forwarded(from, source.clone(), near, to.clone()));
        }
    }
    let mut observed: [Observed; 3] = Default::default();
    let mut week = Week::default();
    let mut ranges = lines(args.ranges.as_ref()).await?;
    let stopping = asked_to_stop()?;
    tokio::pin!(stopping);
    let quiet = args.until_quiet.map(|s| Duration::from_secs_f64(s.clamp(0.1, 1e6)));
    let mut heard_at = None::<Instant>;
    let (mut pause, mut try_at) = (FIRST_PAUSE, Instant::now());
    // Batches are counted from where the server says.
    let mut counted = false;
    loop {
        if !link.is_open() && Instant::now() >= try_at {
            match link.open().await {
                Ok(session_id) => {
                    pause = FIRST_PAUSE;
                    counted = true;
                    say(&format!("session {session_id} at {}", args.server));
                }
                // A server that refuses the very first hello will not think otherwise.
                Err(error) if !counted && refused(&error) => return Err(error),
                Err(error) => {
                    say(&format!("{error:#}; tried again in {} s", pause.as_secs()));
                    try_at = Instant::now() + pause;
                    pause = (2 * pause).min(LONGEST_PAUSE);
                }
            }
        }
        link.send().await;
        let closed = !link.is_open();
        let ends_at = quiet.zip(heard_at).map(|(quiet, heard_at)| heard_at + quiet);
        tokio::select! {
            Some((from, told)) = told.recv(), if counted => {
                if matches!(told, Told::Bytes(_)) {
                    heard_at = Some(Instant::now());
                }
                take(from, told, (&mut observed[from as usize], &mut week), &mut link)?;
            }
            line = next_line(&mut ranges), if counted => match line {
                Some(line) => {
                    heard_at = Some(Instant::now());
                    take_range(&line, &mut link)?;
                }
                None => ranges = None,
            },
            said = link.hear() => {
                if said? == Said::Lost {
                    say("the link to the server is lost");
                    try_at = Instant::now() + pause;
                }
            }
            () = sleep_until(try_at), if closed => {}
            () = sleep_until(ends_at.unwrap_or(try_at)), if ends_at.is_some() => break,
            () = &mut stopping => break,
        }
    }
    end(&mut link).await
}

/// What was heard last goes to the server, too, before it ends.
async fn end(link: &mut Link) -> Result<()> {
    let ended = timeout(END_WITHIN, async {
        if !link.is_open() {
            link.open().await?;
        }
        link.send().await;
        while link.waiting() > 0 {
            link.hear().await?;
        }
        link.finish().await;
        while link.hear().await? != Said::Finished {}
        Ok::<(), anyhow::Error>(())
    });
    ended.await.with_context(|| {
        format!("the server did not take all within {} s; go on with --session", END_WITHIN.as_secs())
    })?
}

fn opening(args: &RoverArgs) -> Result<Opening> {
    let instrument = args
        .instrument
        .as_ref()
        .map(|path| {
            std::fs::read_to_string(path)
                .map_err(|error| Failure::bad_input(path, format!("cannot be read: {error}")))
        })
        .transpose()?;
    let mut streams: Vec<&str> = Vec::new();
    if args.rover.is_some() {
        streams.extend(["rover", "base", "navigation_1", "navigation_2", "navigation_3"]);
    }
    if args.ranges.is_some() {
        streams.push("ranges");
    }
    let hello = match (&args.session, &args.inspector) {
        (Some(session_id), _) => Hello::Continue { session_id: session_id.clone() },
        (None, inspector) => Hello::Begin {
            inspector_id: inspector.clone().unwrap_or_default(),
            start: None,
            system: Some(DECLARATION.name.to_owned()),
            streams: Some(streams.into_iter().filter_map(StreamId::read).collect()),
            initial_heading_deg: None,
            instrument,
        },
    };
    Ok(Opening { url: format!("ws://{}/api/v1/live", args.server), token: args.token.clone(), hello })
}

/// Whether the server answered, and said no.
fn refused(error: &anyhow::Error) -> bool {
    error.to_string().starts_with("the server said")
}

async fn forwarded(from: From, source: Source, near: Option<Geodetic>, to: mpsc::Sender<(From, Told)>) {
    let (own, mut told) = mpsc::channel(MOST_WAITING);
    tokio::spawn(follow(source, near, own));
    while let Some(one) = told.recv().await {
        if to.send((from, one)).await.is_err() {
            return;
        }
    }
}

fn take(from: From, told: Told, (observed, week): (&mut Observed, &mut Week), link: &mut Link) -> Result<()> {
    let bytes = match told {
        Told::Good => {
            say(&format!("{}: frames come", from.name()));
            return Ok(());
        }
        Told::Trouble(why) => {
            say(&format!("{}: {why}", from.name()));
            return Ok(());
        }
        Told::Bytes(bytes) => bytes,
    };
    for complete in observed.take(&bytes, week) {
        match (complete, from) {
            (Complete::Epoch(rows), From::Rover | From::Base) => push(link, from.name(), rows)?,
            (Complete::Epoch(_), From::Navigation) => {}
            // Each sender numbers its own batches.
            (Complete::Orbit(rows), _) => push(link, ORBITS[from as usize], rows)?,
        }
    }
    Ok(())
}

/// Where the orbits of each source go.
const ORBITS: [&str; 3] = ["navigation_1", "navigation_2", "navigation_3"];

fn push(link: &mut Link, name: &str, rows: Rows) -> Result<()> {
    let stream = StreamId::read(name).and_then(|id| DECLARATION.stream(id));
    let stream = stream.with_context(|| format!("the system has no stream {name}"))?;
    link.push(stream.id, stream.number, rows)
}

/// A line of `t_s,anchor,range_m`; a header and what is no such line are passed over with a word.
fn take_range(line: &str, link: &mut Link) -> Result<()> {
    let mut cells = line.split(',').map(str::trim);
    let (time, anchor, range) = (cells.next(), cells.next(), cells.next());
    let number =
        |cell: Option<&str>| cell.and_then(|cell| cell.parse::<f64>().ok()).filter(|x| x.is_finite());
    let name = anchor.and_then(range_rows::packed);
    let (Some(t_s), Some(name)) = (number(time).filter(|t_s| t_s.abs() < 9e9), name) else {
        if !line.trim().is_empty() && !line.starts_with("t_s") {
            say(&format!("ranges: expected t_s,anchor,range_m, found {line:?}: the line was left out"));
        }
        return Ok(());
    };
    let t_ns = (t_s * 1e9).round() as i64;
    let mut rows = Rows::new(range_rows::COLUMNS.len());
    rows.push(t_ns, range_rows::values(t_ns, name, number(range).unwrap_or(f64::NAN)));
    push(link, "ranges", rows)
}

type RangeLines = Lines<BufReader<Box<dyn AsyncRead + Send + Unpin>>>;

async fn lines(path: Option<&PathBuf>) -> Result<Option<RangeLines>> {
    let Some(path) = path else { return Ok(None) };
    let source: Box<dyn AsyncRead + Send + Unpin> = if path.as_os_str() == "-" {
        Box::new(tokio::io::stdin())
    } else {
        let opened = tokio::fs::File::open(path).await;
        Box::new(opened.map_err(|error| Failure::bad_input(path, format!("cannot be read: {error}")))?)
    };
    Ok(Some(BufReader::new(source).lines()))
}

/// The next line; never where there are no ranges.
async fn next_line(lines: &mut Option<RangeLines>) -> Option<String> {
    match lines {
        Some(lines) => lines.next_line().await.ok().flatten(),
        None => std::future::pending().await,
    }
}

/// For people only: nothing depends on whether it can be shown.
fn say(words: &str) {
    let _ = writeln!(std::io::stderr(), "lodestep: {words}");
}

#[cfg(test)]
mod tests {
    use lodestep_engine::parse::batch::Batch;

    use super::*;

    #[test]
    fn a_batch_is_never_longer_than_the_server_takes() {
        let mut link = Link::new(Opening {
            url: String::new(),
            token: None,
            hello: Hello::Continue { session_id: String::new() },
        });
        let mut rows = Rows::new(5);
        (0..2_500).for_each(|k| rows.push(k, [0.0; 5]));
        push(&mut link, "ranges", rows).unwrap();
        assert_eq!(link.waiting(), 2_500_usize.div_ceil(Batch::MOST_SAMPLES));
    }
}
