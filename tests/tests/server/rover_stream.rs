//! Rover and base send RTCM 3 over TCP, the tag its ranges: the session is the same, to the last bit, as what the decoded epochs give.

use std::ffi::OsString;
use std::process::ExitCode;
use std::time::Duration;

use lodestep_engine::gnss::ephemeris::Navigation;
use lodestep_engine::gnss::observations::Observations;
use lodestep_engine::gnss::rtcm::{Decoder, Message};
use lodestep_engine::gnss::satellite::Constellation;
use lodestep_engine::gnss::{navigation_reader, observation_reader};
use lodestep_engine::parse::ranges_csv;
use lodestep_engine::sim::rover::{Scene, simulate};
use lodestep_engine::systems::rover::computation::{self, Means};
use lodestep_engine::systems::rover::instrument::Instrument;
use lodestep_engine::systems::rover::recording::Recording;
use lodestep_engine::systems::rover::told::{self, Placement};
use lodestep_engine::track::Track;
use lodestep_server::cli;
use lodestep_tests::rtcm_writer::RtcmWriter;
use lodestep_tests::server::TestServer;
use tokio::io::AsyncWriteExt;
use tokio::net::TcpListener;

/// A receiver that sends this to the first connection, and then nothing.
async fn receiver(bytes: Vec<u8>) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    tokio::spawn(async move {
        let (mut stream, _) = listener.accept().await.unwrap();
        for piece in bytes.chunks(777) {
            stream.write_all(piece).await.unwrap();
        }
        std::future::pending::<()>().await;
    });
    format!("tcp://{address}")
}

/// What a decoder makes of the bytes, as a reader of files would.
fn decoded(bytes: &[u8], navigation: &mut Navigation, near: &Observations) -> Observations {
    let mut file = Observations::default();
    for message in Decoder::default().push(bytes, near.epochs[0].time) {
        match message {
            Message::Epoch(epoch) => file.epochs.push(epoch),
            Message::Ephemeris(one) => navigation.ephemerides.push(*one),
            Message::Station(station) => {
                file.approximate_position_m = Some(station.position_m);
                file.antenna_delta_hen_m = [station.antenna_height_m, 0.0, 0.0];
            }
        }
    }
    file
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_receivers_send_gives_the_bits_of_what_they_sent() {
    let folder = tempfile::tempdir().unwrap();
    let mut files = simulate(Scene::Doorway, 4);
    let ranges = files.iter_mut().find(|file| file.name == "uwb.csv").unwrap();
    ranges.text = ranges.text.split_inclusive('\n').take(150).collect();
    for file in &files {
        std::fs::write(folder.path().join(file.name), &file.text).unwrap();
    }
    let text = |name: &str| files.iter().find(|file| file.name == name).unwrap().text.as_bytes();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let read = |name: &str| {
        let mut file = observation_reader::read(text(name)).unwrap();
        file.epochs.truncate(60);
        file
    };
    let (rover, base) = (read("rover.obs"), read("base.obs"));
    let orbits = navigation_reader::read(text("base.nav")).unwrap();
    let mut from_rover: Vec<u8> = orbits.ephemerides.iter().flat_map(RtcmWriter::ephemeris).collect();
    let mut writer = RtcmWriter::default();
    rover.epochs.iter().for_each(|epoch| from_rover.extend(writer.epoch(epoch, 7)));
    let [up, ..] = base.antenna_delta_hen_m;
    // A base sends orbits, too: they say which week it is, whatever the computer's clock.
    let mut from_base: Vec<u8> = orbits.ephemerides.iter().flat_map(RtcmWriter::ephemeris).collect();
    from_base.extend(RtcmWriter::station(base.approximate_position_m.unwrap(), up));
    let mut writer = RtcmWriter::default();
    base.epochs.iter().for_each(|epoch| from_base.extend(writer.epoch(epoch, 5)));

    let mut recording = Recording::default();
    recording.rover = decoded(&from_rover, &mut recording.navigation, &rover);
    recording.base = decoded(&from_base, &mut recording.navigation, &base);
    recording.navigation.in_order_of_time();
    recording.ranges = ranges_csv::read(text("uwb.csv")).unwrap();
    let means = Means {
        instrument: Instrument::from_toml(std::str::from_utf8(text("rover.toml")).unwrap()).unwrap(),
        systems: Constellation::ALL.to_vec(),
        initial_position_m: None,
        with_ranges: true,
    };
    let done = computation::compute(&recording, &means, true, false).unwrap();
    let placement = Placement::new(done.base, means.instrument.site.map(|site| site.geodetic()));
    let zero_ns = recording.zero_ns();
    let mut track = Track { points: told::points(&done, placement, zero_ns), ..Track::default() };
    told::anomalies(&done, placement, zero_ns).into_iter().for_each(|event| track.take(event));

    let site = folder.path().join("site.toml");
    let server = TestServer::start_with(|config| config.site = Some(site)).await;
    let line = [
        "lodestep",
        "stream",
        "rover",
        "--server",
        server.url("").trim_start_matches("http://").trim_end_matches('/'),
        "--inspector",
        &server.inspector().await,
        "--instrument",
        &path("rover.toml"),
        "--rover",
        &receiver(from_rover).await,
        "--base",
        &receiver(from_base).await,
        "--ranges",
        &path("uwb.csv"),
        "--until-quiet",
        "2",
    ]
    .map(OsString::from)
    .to_vec();
    let streamed = tokio::task::spawn_blocking(move || cli::run(line)).await.unwrap();
    assert_eq!(streamed, ExitCode::SUCCESS);
    let session = loop {
        let sessions = server.look("/sessions").await.body;
        let session = sessions.as_array().unwrap().first().unwrap().clone();
        assert_ne!(session["state"], "failed", "{session}");
        if session["state"] == "finished" {
            break session;
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    };
    assert_eq!(session["system"], "rover");
    assert_eq!(session["track_sha256"].as_str().unwrap(), track.sha256());
}
