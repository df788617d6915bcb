//! A caster that is dead, bans, pauses or sends garbage is told of within five seconds, and followed again when it is well.

use std::time::Duration;

use lodestep_server::ntrip::{Source, Told, follow};
use lodestep_tests::rtcm_writer::RtcmWriter;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::mpsc;
use tokio::time::{Instant, timeout};

/// A caster that plays one part for each connection, in order; the last for all that follow.
async fn caster(parts: &'static [Part]) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap().to_string();
    tokio::spawn(async move {
        for k in 0.. {
            let (stream, _) = listener.accept().await.unwrap();
            tokio::spawn(play(stream, parts[k.min(parts.len() - 1)]));
        }
    });
    address
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Part {
    /// Takes the request and says nothing.
    Mute,
    /// Answers and sends nothing.
    Silent,
    /// Answers and sends what is no RTCM.
    Garbage,
    /// Refuses.
    Bans,
    /// Sends frames for a moment, then none.
    Pauses,
    /// Hangs up at once.
    HangsUp,
    /// Sends frames.
    Well,
}

async fn play(mut stream: TcpStream, part: Part) {
    let mut request = vec![0; 1024];
    let n = stream.read(&mut request).await.unwrap();
    let text = String::from_utf8_lossy(&request[..n]);
    assert!(text.starts_with("GET /BASE HTTP/1.0\r\n"), "{text}");
    assert!(text.contains("Authorization: Basic bWU6c2VjcmV0\r\n"), "{text}");
    let frame = RtcmWriter::station([1e6, 2e6, 3e6], 0.0);
    match part {
        Part::HangsUp => return,
        Part::Bans => {
            let _ = stream.write_all(b"HTTP/1.1 403 Forbidden\r\n\r\n").await;
            return;
        }
        Part::Mute => {}
        _ => stream.write_all(b"ICY 200 OK\r\n\r\n").await.unwrap(),
    }
    let begun = Instant::now();
    loop {
        let sent = match part {
            Part::Garbage => stream.write_all(b"$GPGGA,120000,,,,,0,,,,,,,,*66\r\n").await,
            Part::Well => stream.write_all(&frame).await,
            Part::Pauses if begun.elapsed() < Duration::from_millis(300) => stream.write_all(&frame).await,
            _ => Ok(()),
        };
        if sent.is_err() {
            return;
        }
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
}

fn source(address: &str) -> Source {
    format!("ntrip://me:secret@{address}/BASE").parse().unwrap()
}

/// The next word that is no data, and when it came.
async fn word(told: &mut mpsc::Receiver<Told>) -> Told {
    loop {
        match timeout(Duration::from_secs(20), told.recv()).await.unwrap().unwrap() {
            Told::Bytes(_) => {}
            other => return other,
        }
    }
}

async fn trouble_within_5_s(parts: &'static [Part], said: &str) -> mpsc::Receiver<Told> {
    let address = caster(parts).await;
    let (to, mut told) = mpsc::channel(64);
    let begun = Instant::now();
    tokio::spawn(follow(source(&address), None, to));
    let mut heard = word(&mut told).await;
    if heard == Told::Good {
        heard = word(&mut told).await;
    }
    let Told::Trouble(sentence) = heard else { panic!("{heard:?}") };
    assert!(sentence.contains(said) && !sentence.contains("secret"), "{parts:?}: {sentence}");
    assert!(begun.elapsed() < Duration::from_millis(5_400), "{parts:?} after {:?}", begun.elapsed());
    told
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_caster_in_trouble_is_told_of_within_five_seconds_and_followed_again_by_itself() {
    // All at once: each waits for some seconds.
    let troubles = tokio::join!(
        trouble_within_5_s(&[Part::Mute, Part::Well], "no answer"),
        trouble_within_5_s(&[Part::Silent], "sends nothing"),
        trouble_within_5_s(&[Part::Garbage], "no RTCM 3"),
        trouble_within_5_s(&[Part::Bans, Part::Well], "403"),
        trouble_within_5_s(&[Part::Pauses], "no frame for"),
        trouble_within_5_s(&[Part::HangsUp, Part::Well], "without an answer"),
    );
    let (mut mute, _, _, mut bans, _, mut hangs_up) = troubles;
    for told in [&mut mute, &mut bans, &mut hangs_up] {
        assert_eq!(word(told).await, Told::Good);
    }
    // Nobody listens where it should.
    let free = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = free.local_addr().unwrap().to_string();
    drop(free);
    let (to, mut told) = mpsc::channel(64);
    tokio::spawn(follow(source(&address), None, to));
    let Told::Trouble(sentence) = word(&mut told).await else { panic!("dead") };
    assert!(sentence.contains("cannot be reached") && sentence.contains("asked again in 1 s"), "{sentence}");
}
