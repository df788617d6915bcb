//! Logs handed in at the dock: whole, in parts, twice, and wrong in every way.

use std::io::Write;
use std::sync::OnceLock;
use std::time::{Duration, SystemTime};

use bytes::Bytes;
use lodestep_engine::geo::Site;
use lodestep_engine::sim::pedestrian::{SensorModel, Walk, WalkKind, simulate};
use lodestep_tests::hand_in::{Answer, UPLOAD_OFFSET, ask, gzip, log, sha256};
use lodestep_tests::server::TestServer;
use serde_json::{Value, json};

/// A walk of twenty metres.
fn walk() -> &'static Walk {
    static WALK: OnceLock<Walk> = OnceLock::new();
    WALK.get_or_init(|| simulate(&WalkKind::Line { metres: 20.0 }, 1, &Site::fast(), &SensorModel::cmp10a()))
}

fn left() -> Vec<u8> {
    log(&walk().left)
}

fn files_in(folder: &std::path::Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}

/// What a session holds: its state, its logs and how many samples they have.
async fn holds(server: &TestServer, session_id: &str) -> (String, Vec<Value>) {
    let session = server.look(&format!("/sessions/{session_id}")).await.body;
    (session["state"].as_str().unwrap().to_owned(), session["logs"].as_array().unwrap().clone())
}

#[tokio::test]
async fn a_log_is_accepted_in_every_packing_and_says_what_is_in_it() {
    let server = TestServer::start().await;
    let packed: [(Vec<u8>, &str); 3] =
        [(left(), "plain"), (gzip(&left()), "gzip"), (zstd::encode_all(&left()[..], 3).unwrap(), "zstd")];
    for (bytes, codec) in packed {
        let session_id = server.session(json!({})).await;
        assert_eq!(holds(&server, &session_id).await.0, "created");
        let accepted = server.hand_in(&session_id, "left", bytes.clone()).await;
        assert_eq!(accepted.status, 200, "{accepted:?}");
        let row = &accepted.body;
        assert_eq!((row["state"].as_str(), row["codec"].as_str()), (Some("accepted"), Some(codec)));
        assert_eq!(row["samples"], walk().left.len());
        assert_eq!(row["t_last_ns"], walk().left.last().unwrap().t_ns);
        assert_eq!(
            (row["offset_bytes"].as_u64(), row["sha256"].as_str()),
            (Some(bytes.len() as u64), Some(&*sha256(&bytes)))
        );
        let (state, logs) = holds(&server, &session_id).await;
        assert_eq!((state.as_str(), logs.len()), ("receiving", 1));
    }
    assert_eq!(files_in(&server.folder().join("uploads")), [""; 0]);
}

#[tokio::test]
async fn an_upload_goes_on_where_it_was_cut_and_over_a_restart() {
    let server = TestServer::start().await;
    let session_id = server.session(json!({})).await;
    let bytes = left();
    let begun = server
        .begin_log(&session_id, json!({ "foot": "left", "file_name": "../../L.csv", "size_bytes": bytes.len(), "sha256": sha256(&bytes) }))
        .await;
    let log_id = begun.id().to_owned();
    let path = format!("/logs/{log_id}");

    // A link that breaks in the middle of a request: what arrived is kept.
    let cut = futures_util::stream::iter([
        Ok(Bytes::copy_from_slice(&bytes[..70_000])),
        Err(std::io::Error::other("the cable came off")),
    ]);
    let patch = server.client.patch(server.api(&path)).header(UPLOAD_OFFSET, 0);
    assert!(patch.body(reqwest::Body::wrap_stream(cut)).send().await.is_err());

    // The next request waits for the broken one to be put away, and is told where to go on.
    let too_early = server.append(&log_id, 1, Vec::new()).await;
    assert_eq!((too_early.status, too_early.code()), (409, "wrong_offset"));
    let offset = too_early.offset.unwrap();
    assert!(offset <= 70_000);
    let asked = server.client.head(server.api(&path)).send().await.unwrap();
    assert_eq!(asked.headers()[UPLOAD_OFFSET], offset.to_string());

    let more = server.append(&log_id, offset, bytes[offset as usize..100_000].to_vec()).await;
    assert_eq!((more.status, more.offset), (204, Some(100_000)));

    let server = server.restart().await;
    // A page that has forgotten the upload begins it again and is given the one on its way.
    let again = server
        .begin_log(
            &session_id,
            json!({ "foot": "left", "size_bytes": bytes.len(), "sha256": sha256(&bytes).to_uppercase() }),
        )
        .await;
    assert_eq!((again.status, again.offset, again.id()), (200, Some(100_000), &*log_id));

    let early = server.finish_log(&log_id, &sha256(&bytes)).await;
    assert_eq!((early.status, early.code(), early.offset), (409, "upload_incomplete", Some(100_000)));
    let rest = server.append(&log_id, 100_000, bytes[100_000..].to_vec()).await;
    assert_eq!(rest.offset, Some(bytes.len() as u64));
    let accepted = server.finish_log(&log_id, &sha256(&bytes)).await;
    assert_eq!(accepted.body["samples"], walk().left.len());

    // The answer may have been lost: finishing again says the same.
    assert_eq!(server.finish_log(&log_id, &sha256(&bytes)).await.body, accepted.body);
    let late = server.append(&log_id, bytes.len() as u64, b"more".to_vec()).await;
    assert_eq!((late.status, late.code()), (409, "upload_finished"));
}

#[tokio::test]
async fn the_same_log_twice_is_success_with_nothing_new() {
    let server = TestServer::start().await;
    let session_id = server.session(json!({})).await;
    let first = server.hand_in(&session_id, "left", left()).await;
    // Announced: nothing needs to be sent.
    let known = server.begin_log(&session_id, json!({ "foot": "left", "sha256": sha256(&left()) })).await;
    assert_eq!(
        (known.status, known.body["state"].as_str(), known.id()),
        (200, Some("unchanged"), first.id())
    );
    // Not announced: found out at the end.
    let again = server.hand_in(&session_id, "left", left()).await;
    assert_eq!((again.status, again.body["state"].as_str()), (200, Some("unchanged")));
    // The other foot is another matter.
    let other = server.hand_in(&session_id, "right", left()).await;
    assert_eq!(other.body["state"], "accepted");
    assert_eq!(files_in(&server.folder().join("uploads")), [""; 0]);
}

#[tokio::test]
async fn a_wrong_hash_keeps_the_upload() {
    let server = TestServer::start().await;
    let session_id = server.session(json!({})).await;
    let log_id = server.begin_log(&session_id, json!({ "foot": "right" })).await.id().to_owned();
    server.append(&log_id, 0, left()).await;
    let wrong = server.finish_log(&log_id, &sha256(b"another file")).await;
    assert_eq!((wrong.status, wrong.code()), (422, "wrong_hash"));
    assert!(wrong.detail().contains("The upload is kept"), "{wrong:?}");
    assert_eq!(wrong.offset, Some(left().len() as u64));
    assert_eq!(server.finish_log(&log_id, "abc").await.code(), "not_a_sha256");
    assert_eq!(server.finish_log(&log_id, &sha256(&left())).await.body["state"], "accepted");
}

#[tokio::test]
async fn an_upload_that_is_given_up_leaves_nothing() {
    let server = TestServer::start().await;
    let session_id = server.session(json!({})).await;
    for way in ["log", "session"] {
        let log_id = server.begin_log(&session_id, json!({ "foot": "left" })).await.id().to_owned();
        server.append(&log_id, 0, b"t_s".to_vec()).await;
        assert_eq!(files_in(&server.folder().join("uploads")).len(), 1);
        let path = if way == "log" { format!("/logs/{log_id}") } else { format!("/sessions/{session_id}") };
        assert_eq!(ask(server.client.delete(server.api(&path))).await.status, 204);
        assert_eq!(files_in(&server.folder().join("uploads")), [""; 0]);
        assert_eq!(server.look(&format!("/logs/{log_id}")).await.code(), "log_not_found");
    }
}

#[tokio::test]
async fn what_nobody_goes_on_with_for_a_week_is_gone_at_the_next_start() {
    let server = TestServer::start().await;
    let session_id = server.session(json!({})).await;
    let folder = server.folder().join("uploads");
    let mut begun = Vec::new();
    for foot in ["left", "right"] {
        let log_id = server.begin_log(&session_id, json!({ "foot": foot })).await.id().to_owned();
        server.append(&log_id, 0, b"t_s,gyr".to_vec()).await;
        begun.push(log_id);
    }
    let eight_days_ago = SystemTime::now() - Duration::from_secs(8 * 24 * 3600);
    let file = std::fs::File::options().append(true).open(folder.join(format!("{}.upload", begun[0])));
    file.unwrap().set_modified(eight_days_ago).unwrap();
    // Left by a server that was killed: samples set aside, and bytes whose log is gone.
    let gone = "0199f1c8-0000-7000-8000-000000000000";
    std::fs::write(folder.join(format!("{}.samples", begun[1])), "half").unwrap();
    std::fs::write(folder.join(format!("{gone}.upload")), "t_s").unwrap();

    let server = server.restart().await;
    assert_eq!(server.look(&format!("/logs/{}", begun[0])).await.code(), "log_not_found");
    assert_eq!(server.look(&format!("/logs/{}", begun[1])).await.offset, Some(7));
    assert_eq!(files_in(&folder), [format!("{}.upload", begun[1])]);
}

/// Hands a bad log in, checks that nothing of it is left and that the server goes on.
async fn refused(server: &TestServer, bytes: Vec<u8>) -> Answer {
    let session_id = server.session(json!({})).await;
    let refused = server.hand_in(&session_id, "left", bytes).await;
    let (_, logs) = holds(server, &session_id).await;
    assert_eq!(logs[0]["state"], "failed", "{refused:?}");
    assert_eq!((logs[0]["samples"].as_u64(), logs.len()), (Some(0), 1));
    assert!(refused.detail().contains(logs[0]["error"].as_str().unwrap()));
    assert_eq!(files_in(&server.folder().join("uploads")), [""; 0]);
    // Nothing to compute a track from has come in by it.
    assert_eq!(server.process(&session_id).await["state"], "failed");
    assert_eq!(server.client.get(server.url("/healthz")).send().await.unwrap().status(), 200);
    refused
}

fn with_line(line: usize, change: impl Fn(&str) -> String) -> Vec<u8> {
    let text = String::from_utf8(left()).unwrap();
    let lines: Vec<_> =
        text.lines().enumerate().map(|(i, l)| if i + 1 == line { change(l) } else { l.to_owned() }).collect();
    (lines.join("\n") + "\n").into_bytes()
}

/// The log with the first `lines` rows garbled.
fn garbled(lines: usize) -> Vec<u8> {
    let text = String::from_utf8(left()).unwrap();
    let garble = |(k, line): (usize, &str)| match (1..=lines).contains(&k) {
        true => line.replacen(',', ",abc", 1),
        false => line.to_owned(),
    };
    text.lines().enumerate().map(garble).collect::<Vec<_>>().join("\n").into_bytes()
}

#[tokio::test]
async fn a_garbled_line_costs_itself_alone_and_is_told_with_the_walk() {
    let server = TestServer::start().await;
    let session_id = server.session(json!({})).await;
    let accepted = server.hand_in(&session_id, "left", garbled(2)).await;
    assert_eq!((accepted.status, &accepted.body["state"]), (200, &json!("accepted")), "{accepted:?}");
    assert_eq!(accepted.body["samples"], walk().left.len() - 2);
    for _ in 0..2 {
        let told = server.look(&format!("/sessions/{session_id}/anomalies")).await.body;
        let left_out: Vec<_> =
            told.as_array().unwrap().iter().filter(|told| told["anomaly"] == "lines_left_out").collect();
        assert_eq!(left_out.len(), 1, "{told}");
        assert_eq!(left_out[0]["figures"]["lines"], 2.0);
        // A run finds its own anomalies, and leaves what reading found.
        server.process(&session_id).await;
    }
}

#[tokio::test]
async fn a_packed_log_that_was_cut_or_has_changed_is_read_as_far_as_it_goes_and_that_is_told() {
    let server = TestServer::start().await;
    let whole = gzip(&left());
    let cut = whole[..whole.len() * 3 / 4].to_vec();
    let mut changed = whole.clone();
    let checksum = changed.len() - 6;
    changed[checksum] ^= 1;
    for (bytes, share, words) in [(cut, 0.5, "cut off"), (changed, 1.0, "damaged")] {
        let session_id = server.session(json!({})).await;
        let accepted = server.hand_in(&session_id, "left", bytes).await;
        assert_eq!(accepted.body["state"], "accepted", "{accepted:?}");
        let samples = accepted.body["samples"].as_u64().unwrap();
        assert!(samples as f64 >= share * walk().left.len() as f64, "{samples}");
        let told = server.look(&format!("/sessions/{session_id}/anomalies")).await.body;
        let packing = told.as_array().unwrap().iter().find(|told| told["figures"]["packing"].is_string());
        assert!(packing.unwrap()["detail"].as_str().unwrap().contains(words), "{told}");
    }
}

#[tokio::test]
async fn bad_logs_are_refused_with_what_where_and_what_to_do() {
    let server = TestServer::start().await;
    let png = [b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".as_slice(), &[7; 5000]].concat();
    let degrees: Vec<_> = walk()
        .left
        .iter()
        .map(|sample| {
            let mut sample = *sample;
            sample.w_ib_b_rad_s = sample.w_ib_b_rad_s.map(f64::to_degrees);
            sample
        })
        .collect();
    // What is packed of no second of a walk is no walk, however it ends.
    let few = left().split_inclusive(|byte| *byte == b'\n').take(80).flatten().copied().collect::<Vec<u8>>();
    let half = gzip(&few);
    let mut flipped = gzip(&few);
    let checksum = flipped.len() - 6;
    flipped[checksum] ^= 1;
    // Bytes; status; code; line, column; words of the sentence.
    type Case = (Vec<u8>, u16, &'static str, (Option<u64>, Option<&'static str>), &'static str);
    let cases: Vec<Case> = vec![
        (Vec::new(), 422, "empty_file", (None, None), "0 bytes"),
        (png.clone(), 422, "not_text", (None, None), "PNG picture"),
        (gzip(&png), 422, "not_text", (None, None), "PNG picture"),
        (
            with_line(1, |header| header.replace("gyr_x_rad_s", "gyro_x_rad_s")),
            422,
            "missing_column",
            (Some(1), Some("gyr_x_rad_s")),
            "if \"gyro_x_rad_s\" is meant",
        ),
        (
            with_line(1, |_| "t_s,gx,gy,gz,ax,ay,az".into()),
            422,
            "unknown_format",
            (None, None),
            "t_s, gx, gy",
        ),
        (with_line(1, |_| String::new())[1..].to_vec(), 422, "missing_header", (Some(1), None), "header"),
        (
            garbled(usize::MAX),
            422,
            "not_a_number",
            (Some(2), Some("gyr_x_rad_s")),
            "lines that cannot be read",
        ),
        (log(&degrees), 422, "degrees_not_radians", (None, None), "rad"),
        (half[..half.len() / 2].to_vec(), 422, "truncated", (None, None), "gzip"),
        (flipped, 422, "damaged", (None, None), "checksum"),
    ];
    for (bytes, status, code, (line, column), words) in cases {
        let answer = refused(&server, bytes).await;
        assert_eq!((answer.status, answer.code()), (status, code), "{answer:?}");
        if line.is_some() {
            assert_eq!(answer.body["where"]["line"].as_u64(), line, "{answer:?}");
        }
        if column.is_some() {
            assert_eq!(answer.body["where"]["column"].as_str(), column, "{answer:?}");
        }
        assert!(answer.detail().contains(words), "{answer:?}");
        assert!(answer.detail().contains("Nothing of this log was stored"), "{answer:?}");
    }
}

/// The peak of this process's memory so far, bytes.
fn peak_memory_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap() << 10
}

/// Ten megabytes that unpack to ten gigabytes of `unit` (1 MiB), made from one packed member.
fn bomb(unit: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    encoder.write_all(unit).unwrap();
    encoder.finish().unwrap().repeat(10 << 10)
}

#[tokio::test]
async fn ten_megabytes_never_become_ten_gigabytes() {
    let server = TestServer::start().await;
    let zeros = bomb(&vec![0; 1 << 20]);
    assert!((9 << 20..14 << 20).contains(&zeros.len()), "{} bytes", zeros.len());
    // One whose content is a log as far as it goes: a header, then the same line for ever.
    let mut still = gzip(&with_line(1, str::to_owned));
    still.extend_from_slice(&bomb(&b"9.99,0,0,0,0,0,9.8,,,,\n".repeat((1 << 20) / 23)));
    let before = peak_memory_bytes();
    for bytes in [zeros, still] {
        let answer = refused(&server, bytes).await;
        assert_eq!((answer.status, answer.code()), (413, "unpacked_too_large"), "{answer:?}");
    }
    let grown = peak_memory_bytes() - before;
    assert!(grown < 128 << 20, "the peak grew by {grown} bytes");
}

#[tokio::test]
async fn limits_are_told_with_their_figures() {
    let limit = left().len() as u64 - 1;
    let server = TestServer::start_with(|config| {
        config.upload_bytes = limit;
        config.unpacked_bytes = limit;
    })
    .await;
    let session_id = server.session(json!({})).await;
    let announced = server.begin_log(&session_id, json!({ "foot": "left", "size_bytes": limit + 1 })).await;
    assert_eq!((announced.status, announced.code()), (413, "upload_too_large"));
    assert!(announced.detail().contains(&format!("{limit} bytes")), "{announced:?}");
    let log_id = server.begin_log(&session_id, json!({ "foot": "left" })).await.id().to_owned();
    let sent = server.append(&log_id, 0, left()).await;
    assert_eq!((sent.status, sent.code()), (413, "upload_too_large"));
    // What came before the limit waits for its sender, until it is given up.
    assert_eq!(server.delete(&format!("/logs/{log_id}")).await.0, 204);

    let answer = refused(&server, gzip(&left())).await;
    assert_eq!((answer.status, answer.code()), (413, "unpacked_too_large"));
    assert!(answer.detail().contains(&format!("{limit} bytes")), "{answer:?}");
}

#[tokio::test]
async fn uploads_that_cannot_be_are_refused_at_once() {
    let server = TestServer::start().await;
    let nobody = "0199f1c8-0000-7000-8000-000000000000";
    let no_session = server.begin_log(nobody, json!({ "foot": "left" })).await;
    assert_eq!((no_session.status, no_session.code()), (404, "session_not_found"));
    let no_log = server.append(nobody, 0, b"t_s".to_vec()).await;
    assert_eq!((no_log.status, no_log.code()), (404, "log_not_found"));
    assert_eq!(server.finish_log(nobody, &sha256(b"")).await.status, 404);

    let session_id = server.session(json!({ "feet": ["right"] })).await;
    let wrong_foot = server.begin_log(&session_id, json!({ "foot": "left" })).await;
    assert_eq!((wrong_foot.status, wrong_foot.code()), (422, "foot_not_worn"));
    let no_foot = server.begin_log(&session_id, json!({ "foot": "middle" })).await;
    assert_eq!(no_foot.status, 422);
    let log_id =
        server.begin_log(&session_id, json!({ "foot": "right", "size_bytes": 4 })).await.id().to_owned();
    let ahead = server.append(&log_id, 7, b"t_s".to_vec()).await;
    assert_eq!((ahead.status, ahead.code(), ahead.offset), (409, "wrong_offset", Some(0)));
    let nowhere = ask(server.client.patch(server.api(&format!("/logs/{log_id}"))).body("t_s")).await;
    assert_eq!((nowhere.status, nowhere.code()), (400, "upload_offset_missing"));
    let longer = server.append(&log_id, 0, b"t_s,g".to_vec()).await;
    assert_eq!((longer.status, longer.code()), (422, "longer_than_announced"));
}
