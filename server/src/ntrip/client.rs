//! Follows a source for ever: connects, asks, reads, and comes back when it is lost.

use std::ops::ControlFlow;
use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::sync::mpsc;
use tokio::time::{Instant, sleep, timeout, timeout_at};

use super::head::{self, Answer};
use super::source::Source;
use lodestep_engine::geo::Geodetic;
use lodestep_engine::gnss::rtcm::Decoder;
use lodestep_engine::gnss::solution::nmea;
use lodestep_engine::gnss::time::GpsTime;

/// Connecting and the head of the answer may take so long each; both together are told within five seconds.
const CONNECT_WITHIN: Duration = Duration::from_millis(2_400);
const ANSWER_WITHIN: Duration = Duration::from_millis(2_400);
/// A source that sends nothing useful for so long is told of.
const SILENT_AFTER: Duration = Duration::from_millis(4_500);
/// One that does so for longer is given up and asked anew.
const GIVEN_UP_AFTER: Duration = Duration::from_secs(30);
/// The first pause before it is asked again, and the longest: casters ban eager clients.
const FIRST_PAUSE: Duration = Duration::from_secs(1);
const LONGEST_PAUSE: Duration = Duration::from_secs(60);
/// A source that was good for so long is asked again at once.
const GOOD_AFTER: Duration = Duration::from_secs(10);
/// A virtual reference station asks where the rover is, so often.
const PLACE_EVERY: Duration = Duration::from_secs(10);
const PIECE_BYTES: usize = 4 << 10;

/// What is told of a source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Told {
    /// Data as they came.
    Bytes(Vec<u8>),
    /// Frames come, for the first time or again.
    Good,
    /// It does not send anything useful, in a sentence; nothing has to be done but what the sentence says.
    Trouble(String),
}

/// Follows a source until nobody listens any more. A caster is told every now and then that the rover is
/// `near`, where that is known.
pub async fn follow(source: Source, near: Option<Geodetic>, to: mpsc::Sender<Told>) {
    let mut pause = FIRST_PAUSE;
    loop {
        let mut good_for = Duration::ZERO;
        match once(&source, near, &to, &mut good_for).await {
            ControlFlow::Break(()) => return,
            ControlFlow::Continue(why) => {
                if good_for >= GOOD_AFTER {
                    pause = FIRST_PAUSE;
                }
                let told = format!("{source}: {why}; asked again in {} s", pause.as_secs());
                if to.send(Told::Trouble(told)).await.is_err() {
                    return;
                }
                tokio::select! {
                    () = sleep(pause) => {}
                    () = to.closed() => return,
                }
                pause = (2 * pause).min(LONGEST_PAUSE);
            }
        }
    }
}

/// One connection, until it ends: why, or that nobody listens.
async fn once(
    source: &Source,
    near: Option<Geodetic>,
    to: &mpsc::Sender<Told>,
    good_for: &mut Duration,
) -> ControlFlow<(), String> {
    use ControlFlow::{Break, Continue};
    let mut stream = match timeout(CONNECT_WITHIN, TcpStream::connect(&source.address)).await {
        Ok(Ok(stream)) => stream,
        Ok(Err(error)) => return Continue(format!("cannot be reached ({error})")),
        Err(_) => {
            return Continue(format!("cannot be reached within {:.1} s", CONNECT_WITHIN.as_secs_f64()));
        }
    };
    let mut bytes = Vec::new();
    if let Some(request) = head::request(source) {
        match timeout(ANSWER_WITHIN, asked(&mut stream, &request)).await {
            Ok(Ok(data)) => bytes = data,
            Ok(Err(why)) => return Continue(why),
            Err(_) => {
                return Continue(format!(
                    "took the request and gave no answer within {:.1} s",
                    ANSWER_WITHIN.as_secs_f64()
                ));
            }
        }
    }
    // Only to see whether what comes is RTCM at all: times do not matter.
    let mut watch = Decoder::default();
    let (mut good, mut told_silent, mut heard) = (None::<Instant>, false, 0_usize);
    let mut useful_at = Instant::now();
    let mut place_at = Instant::now();
    let mut piece = vec![0; PIECE_BYTES];
    loop {
        if !bytes.is_empty() {
            heard += bytes.len();
            let before = watch.counts().frames;
            watch.push(&bytes, GpsTime::default());
            if watch.counts().frames > before {
                useful_at = Instant::now();
                if good.is_none() || told_silent {
                    good.get_or_insert(useful_at);
                    told_silent = false;
                    if to.send(Told::Good).await.is_err() {
                        return Break(());
                    }
                }
            }
            if to.send(Told::Bytes(std::mem::take(&mut bytes))).await.is_err() {
                return Break(());
            }
        }
        *good_for = good.map_or(Duration::ZERO, |since| useful_at.duration_since(since));
        let now = Instant::now();
        let quiet = now.duration_since(useful_at);
        if quiet >= GIVEN_UP_AFTER {
            return Continue(format!("sent nothing useful for {} s", quiet.as_secs()));
        }
        if quiet >= SILENT_AFTER && !told_silent {
            told_silent = true;
            let why = match heard {
                0 => "connected, and sends nothing".to_owned(),
                _ if good.is_none() => format!(
                    "sends {heard} bytes and no RTCM 3 among them: choose another mount point, or switch the receiver to RTCM 3"
                ),
                _ => format!("has sent no frame for {:.1} s", quiet.as_secs_f64()),
            };
            heard = 0;
            if to.send(Told::Trouble(format!("{source}: {why}"))).await.is_err() {
                return Break(());
            }
        }
        if let Some(near) = near
            && source.mount.is_some()
            && now >= place_at
        {
            place_at = now + PLACE_EVERY;
            let unix_ns = time::OffsetDateTime::now_utc().unix_timestamp_nanos();
            let sentence = nmea::told_to_caster(near, i64::try_from(unix_ns).unwrap_or_default());
            if let Err(error) = stream.write_all(sentence.as_bytes()).await {
                return Continue(format!("the connection was lost ({error})"));
            }
        }
        let until = if told_silent { useful_at + GIVEN_UP_AFTER } else { useful_at + SILENT_AFTER };
        let until = if near.is_some() { until.min(place_at) } else { until };
        tokio::select! {
            read = timeout_at(until, stream.read(&mut piece)) => match read {
                Ok(Ok(0)) => return Continue("closed the connection".to_owned()),
                Ok(Ok(n)) => bytes.extend_from_slice(&piece[..n]),
                Ok(Err(error)) => return Continue(format!("the connection was lost ({error})")),
                Err(_) => {}
            },
            () = to.closed() => return Break(()),
        }
    }
}

/// Asks a caster; gives the data that came with its answer.
async fn asked(stream: &mut TcpStream, request: &str) -> Result<Vec<u8>, String> {
    let lost = |error: std::io::Error| format!("the connection was lost ({error})");
    stream.write_all(request.as_bytes()).await.map_err(lost)?;
    let mut bytes = Vec::new();
    let mut piece = vec![0; PIECE_BYTES];
    loop {
        let n = stream.read(&mut piece).await.map_err(lost)?;
        bytes.extend_from_slice(&piece[..n]);
        match head::read(&bytes) {
            Answer::Data(from) => return Ok(bytes.split_off(from)),
            Answer::Refused(why) => return Err(why),
            Answer::Wait if n == 0 => return Err("closed the connection without an answer".to_owned()),
            Answer::Wait => {}
        }
    }
}
