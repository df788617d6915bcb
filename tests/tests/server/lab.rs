//! Walks worked out with other parameters and aids: the same as by the command line, beside the walk's own track.

use std::ffi::OsString;
use std::sync::OnceLock;
use std::time::Duration;

use lodestep_engine::geo::Site;
use lodestep_engine::sim::pedestrian::{SensorModel, Walk, WalkKind, simulate};
use lodestep_engine::systems::pedestrian::DECLARATION;
use lodestep_server::cli;
use lodestep_tests::hand_in::{Answer, ask, log, sha256};
use lodestep_tests::server::TestServer;
use lodestep_tests::staff::server_with_staff;
use reqwest::Method;
use serde_json::{Value, json};

/// A walk of thirty metres.
pub(crate) fn walk() -> &'static Walk {
    static WALK: OnceLock<Walk> = OnceLock::new();
    WALK.get_or_init(|| simulate(&WalkKind::Line { metres: 30.0 }, 6, &Site::fast(), &SensorModel::cmp10a()))
}

/// A session with both logs, a marker half a metre east of its start, and a visit to it.
pub(crate) async fn handed_in(server: &TestServer) -> String {
    let [e, n, u] = walk().start_n_m();
    let marker = json!({ "name": "A1", "e_m": e + 0.5, "n_m": n, "u_m": u });
    assert!(ask(server.client.post(server.api("/markers")).json(&marker)).await.status < 300);
    let session_id = server.session(json!({ "start": { "position_m": [e, n, u] } })).await;
    for (foot, samples) in [("left", &walk().left), ("right", &walk().right)] {
        assert_eq!(server.hand_in(&session_id, foot, log(samples)).await.body["state"], "accepted");
    }
    let visit = json!({ "marker": "A1", "t_start_s": 4, "t_end_s": 7 });
    let told = server.client.post(server.api(&format!("/sessions/{session_id}/visits"))).json(&visit);
    assert_eq!(ask(told).await.status, 201);
    session_id
}

async fn ask_for(server: &TestServer, body: Value) -> Answer {
    ask(server.client.post(server.api("/lab/runs")).json(&body)).await
}

/// A run as it is in the end.
async fn ended(server: &TestServer, id: &str) -> Value {
    loop {
        let run = server.look(&format!("/lab/runs/{id}")).await.body;
        if !["queued", "running"].contains(&run["state"].as_str().unwrap()) {
            return run;
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

/// The one run of one session, computed.
pub(crate) async fn run(server: &TestServer, body: Value) -> Value {
    let asked = ask_for(server, body).await;
    assert_eq!(asked.status, 202, "{asked:?}");
    let run = ended(server, asked.body[0]["id"].as_str().unwrap()).await;
    assert_eq!(run["state"], "finished", "{run}");
    run
}

/// What a site's file says, of what the server says of its site.
const SITE_KEYS: [&str; 8] = [
    "name",
    "latitude_deg",
    "longitude_deg",
    "height_m",
    "gravity_m_s2",
    "declination_deg",
    "inclination_deg",
    "field_ut",
];

/// The walk of `handed_in` by the command line, with a file of parameters and more arguments: report and track.
pub(crate) async fn by_command_line(
    server: &TestServer,
    parameters: &[u8],
    more: &[&str],
) -> (Value, String) {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    };
    let site = server.look("/site").await.body;
    let site_toml: String = SITE_KEYS.iter().map(|key| format!("{key} = {}\n", site[key])).collect();
    let [e, n, u] = walk().start_n_m();
    let (track, report) = (folder.path().join("track.csv"), folder.path().join("report.json"));
    let markers = format!("name,e_m,n_m,u_m\nA1,{},{n},{u}\n", e + 0.5);
    let mut arguments: Vec<OsString> = vec![
        "lodestep".into(),
        "process".into(),
        "--left".into(),
        file("left.csv", &log(&walk().left)).into(),
        "--right".into(),
        file("right.csv", &log(&walk().right)).into(),
        "--initial-position".into(),
        format!("{e},{n},{u}").into(),
        "--site".into(),
        file("site.toml", site_toml.as_bytes()).into(),
        "--markers".into(),
        file("markers.csv", markers.as_bytes()).into(),
        "--visits".into(),
        file("visits.csv", b"t_start_s,t_end_s,marker\n4,7,A1\n").into(),
        "--parameters".into(),
        file("parameters.json", parameters).into(),
        "--solution".into(),
        "smoothed".into(),
        "--rate-hz".into(),
        "10".into(),
        "--out".into(),
        track.clone().into(),
        "--report".into(),
        report.clone().into(),
    ];
    arguments.extend(more.iter().map(OsString::from));
    let code = tokio::task::spawn_blocking(move || cli::run(arguments)).await.unwrap();
    assert_eq!(code, std::process::ExitCode::SUCCESS);
    let report = serde_json::from_slice(&std::fs::read(report).unwrap()).unwrap();
    (report, std::fs::read_to_string(track).unwrap())
}

#[tokio::test]
async fn the_schema_tells_what_the_engine_itself_computes_with() {
    let server = TestServer::start().await;
    let schema = server.look("/lab/parameters").await.body;
    let told = schema["parameters"].as_array().unwrap();
    assert_eq!(told.len(), DECLARATION.parameters.len());
    for (told, known) in told.iter().zip(DECLARATION.parameters) {
        assert_eq!(
            (told["key"].as_str(), told["default"].as_f64()),
            (Some(known.key), Some(known.default_of(&DECLARATION)))
        );
        assert!(told["least"].as_f64() <= told["default"].as_f64(), "{told}");
        assert!(told["default"].as_f64() <= told["most"].as_f64(), "{told}");
    }
    assert_eq!(schema["engine_sha256"].as_str().unwrap().len(), 64);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_run_with_parameters_is_the_command_line_s_to_the_last_bit() {
    let server = TestServer::start().await;
    let session_id = handed_in(&server).await;
    server.process(&session_id).await;
    let own = server.look(&format!("/sessions/{session_id}")).await.body;
    let parameters = json!({ "marker_sigma_m": 0.1, "stance.threshold": 12.5, "imu_noise.height_random_walk_m_sqrt_s": 0.1 });

    let by_default = run(&server, json!({ "session_ids": [session_id] })).await;
    assert_eq!(by_default["provenance"]["track_sha256"], own["track_sha256"]);
    let tuned = run(&server, json!({ "session_ids": [session_id], "parameters": parameters })).await;
    assert_ne!(tuned["provenance"]["track_sha256"], own["track_sha256"]);

    // The file says one of them otherwise: what is set counts.
    let given = json!({ "marker_sigma_m": 3.0, "stance.threshold": 12.5, "imu_noise.height_random_walk_m_sqrt_s": 0.1 });
    let (report, track) =
        by_command_line(&server, given.to_string().as_bytes(), &["--set", "marker_sigma_m=0.1"]).await;
    let from = &tuned["provenance"];
    assert_eq!(report["track_sha256"], from["track_sha256"]);
    for told in ["engine_version", "engine_sha256", "parameters"] {
        assert_eq!(report[told], from[told], "{told}");
    }
    assert_eq!(report["parameters"], parameters);
    assert_eq!(report["inputs"]["visits_sha256"], from["visits_sha256"]);
    for (k, samples) in [&walk().left, &walk().right].into_iter().enumerate() {
        assert_eq!(report["inputs"]["logs_sha256"][k], sha256(&log(samples)));
        assert_eq!(from["inputs"][k]["sha256"], sha256(&log(samples)));
        assert_eq!(from["inputs"][k]["source"], "log");
    }
    let path = format!("/sessions/{session_id}/track.csv?run={}", tuned["id"].as_str().unwrap());
    let stored = server.client.get(server.api(&path)).send().await.unwrap().text().await.unwrap();
    assert!(stored == track, "the stored track differs from the file");
    let whole =
        server.look(&format!("/sessions/{session_id}/track?run={}", tuned["id"].as_str().unwrap())).await;
    assert_eq!(whole.body["run"], tuned["id"]);

    // The walk's own track is as it was.
    let after = server.look(&format!("/sessions/{session_id}")).await.body;
    assert_eq!(after, own);
}

#[tokio::test]
async fn runs_are_compared_with_the_walk_s_own_track() {
    let server = TestServer::start().await;
    let session_id = handed_in(&server).await;
    server.process(&session_id).await;
    let set = json!({ "name": "=firm", "about": "markers are believed", "parameters": { "marker_sigma_m": 0.1, "separation_m": 0.13 } });
    let set = ask(server.client.post(server.api("/lab/parameter-sets")).json(&set)).await;
    assert_eq!(set.status, 201, "{set:?}");
    assert_eq!(set.body["parameters"], json!({ "marker_sigma_m": 0.1 }), "a default is no setting");
    let firm = run(&server, json!({ "session_ids": [session_id], "parameter_set_id": set.id() })).await;
    let aids = run(
        &server,
        json!({ "session_ids": [session_id], "aids": ["heading", "zupt"], "solution": "filtered" }),
    )
    .await;
    assert_eq!((firm["name"].as_str(), aids["name"].as_str()), (Some("=firm"), Some("zupt + heading")));

    let compared = server.look(&format!("/lab/comparison?session_ids={session_id}")).await.body;
    let rows = compared["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 3);
    let [own, firm_row, aids_row] = &rows[..] else { panic!("{rows:?}") };
    assert!(own["run_id"].is_null());
    let session = server.look(&format!("/sessions/{session_id}")).await.body;
    assert_eq!(own["provenance"]["track_sha256"], session["track_sha256"]);
    assert_eq!(own["values"]["distance_m"], session["distance_m"]);
    assert_eq!(own["values"]["visits_accepted"], 1.0);
    for name in [
        "closure_m",
        "marker_mean_m",
        "marker_rms_m",
        "marker_max_m",
        "marker_p95_m",
        "left_stance_share",
        "nis_zupt",
        "nis_markers",
    ] {
        let (value, was) =
            (firm_row["values"][name].as_f64().unwrap(), own["values"][name].as_f64().unwrap());
        assert_eq!(firm_row["differences"][name].as_f64(), Some(value - was), "{name}");
    }
    // A marker that is believed more moves the track farther, up to the half metre that it is off.
    let moved = |row: &Value| row["values"]["largest_correction_m"].as_f64().unwrap();
    assert!(moved(firm_row) > 2.0 * moved(own), "{} {}", moved(firm_row), moved(own));
    assert!(aids_row["values"]["nis_markers"].is_null());
    assert_eq!((&firm_row["comparable"], &aids_row["comparable"]), (&json!(true), &json!(true)));

    let csv = server.client.get(server.api(&format!("/lab/comparison.csv?session_ids={session_id}")));
    let csv = csv.send().await.unwrap().text().await.unwrap();
    assert_eq!(csv.lines().count(), 4);
    assert!(csv.contains(",\"'=firm\","), "a name is no formula: {csv}");
    let columns = csv.lines().next().unwrap().split(',').count();
    assert!(csv.lines().nth(1).unwrap().split(',').count() == columns, "{csv}");

    // Another visit: what the runs read is no longer what the walk's own track was computed from.
    let visit = json!({ "marker": "A1", "t_start_s": 1, "t_end_s": 3 });
    ask(server.client.post(server.api(&format!("/sessions/{session_id}/visits"))).json(&visit)).await;
    server.process(&session_id).await;
    let compared = server.look(&format!("/lab/comparison?session_ids={session_id}")).await.body;
    let told: Vec<_> =
        compared["rows"].as_array().unwrap().iter().map(|row| row["comparable"].clone()).collect();
    assert_eq!(told, [Value::Null, json!(false), json!(true)], "without markers the visits do not matter");
}

#[tokio::test]
async fn a_run_by_all_aids_is_what_the_filter_told() {
    let server = TestServer::start().await;
    let session_id = handed_in(&server).await;
    server.process(&session_id).await;
    let rows = async |run: &str| {
        server.look(&format!("/sessions/{session_id}/track?run={run}")).await.body["rows"].clone()
    };
    let all = ["zupt", "heading", "maru", "separation", "altimeter", "markers"];
    let body = |aids: &[&str]| json!({ "session_ids": [session_id], "aids": aids, "solution": "filtered" });
    let by_all = run(&server, body(&all)).await;
    assert_eq!(rows(by_all["id"].as_str().unwrap()).await, rows("filtered").await);
    let zupt = run(&server, body(&["zupt"])).await;
    let zupt = rows(zupt["id"].as_str().unwrap()).await;
    assert_ne!(zupt, rows("main").await);
    assert_eq!(zupt.as_array().unwrap().len(), rows("main").await.as_array().unwrap().len());
    let listed = server.look(&format!("/lab/runs?session_id={session_id}")).await.body;
    assert_eq!(listed.as_array().unwrap().len(), 2);
}

#[tokio::test]
async fn what_cannot_be_is_refused_in_a_sentence() {
    let server = TestServer::start().await;
    let session_id = handed_in(&server).await;
    let refused = async |body: Value| ask_for(&server, body).await;
    let wrong =
        refused(json!({ "session_ids": [session_id], "parameters": { "marker_sigma_m": 1e6 } })).await;
    assert_eq!((wrong.status, wrong.code()), (422, "wrong_parameter"));
    assert!(wrong.detail().contains("expected marker_sigma_m from 0.01 to 20 m, found 1000000"), "{wrong:?}");
    let unknown = refused(json!({ "session_ids": [session_id], "parameters": { "magic": 1.0 } })).await;
    assert!(unknown.detail().contains("no parameter \"magic\""), "{unknown:?}");
    assert_eq!(refused(json!({ "session_ids": [] })).await.code(), "wrong_sessions");
    let nobody = "0199f1c8-0000-7000-8000-000000000000";
    assert_eq!(refused(json!({ "session_ids": [nobody] })).await.code(), "session_not_found");
    assert_eq!(
        refused(json!({ "session_ids": [session_id], "aids": ["magic"] })).await.code(),
        "wrong_field"
    );
    assert_eq!(
        refused(json!({ "session_ids": [session_id], "solution": "trail" })).await.code(),
        "wrong_solution"
    );
    assert_eq!(server.look(&format!("/sessions/{session_id}/track?run=magic")).await.code(), "wrong_run");
    assert_eq!(
        server.look(&format!("/sessions/{session_id}/track?run={nobody}")).await.code(),
        "lab_run_not_found"
    );
    assert_eq!(server.look("/lab/comparison?session_ids=x").await.code(), "wrong_sessions");

    let empty = server.session(json!({})).await;
    let asked = refused(json!({ "session_ids": [empty] })).await;
    let failed = ended(&server, asked.body[0]["id"].as_str().unwrap()).await;
    assert_eq!(failed["state"], "failed");
    assert!(failed["error"].as_str().unwrap().contains("upload a log"), "{failed}");
    // The session itself is not to blame.
    assert_eq!(server.look(&format!("/sessions/{empty}")).await.body["state"], "created");
    let path = format!("/sessions/{empty}/track?run={}", failed["id"].as_str().unwrap());
    assert_eq!(server.look(&path).await.code(), "run_not_finished");
}

#[tokio::test]
async fn a_run_that_waits_is_given_up_and_one_that_a_restart_interrupts_is_done() {
    let server = TestServer::start().await;
    let session_id = handed_in(&server).await;
    let runs = json!({ "session_ids": [session_id], "parameters": { "marker_sigma_m": 0.3 } });
    let mut ids = Vec::new();
    let new_run = async || ask_for(&server, runs.clone()).await.body[0]["id"].as_str().unwrap().to_owned();
    for _ in 0..4 {
        ids.push(new_run().await);
    }
    // One that was done before it could be given up says so; another is asked for then.
    let given_up = loop {
        let id = new_run().await;
        let answer = ask(server.client.post(server.api(&format!("/lab/runs/{id}/cancel")))).await;
        if answer.status == 200 {
            assert_eq!(answer.body["state"], "cancelled", "{answer:?}");
            break id;
        }
        assert_eq!((answer.status, answer.code()), (409, "run_ended"));
    };
    let again = ask(server.client.post(server.api(&format!("/lab/runs/{given_up}/cancel")))).await;
    assert_eq!((again.status, again.code()), (409, "run_ended"));
    let removed = new_run().await;
    assert_eq!(ask(server.client.delete(server.api(&format!("/lab/runs/{removed}")))).await.status, 204);

    let server = server.restart().await;
    for id in &ids {
        let run = ended(&server, id).await;
        assert_eq!(run["state"], "finished", "{run}");
    }
    let run = server.look(&format!("/lab/runs/{given_up}")).await.body;
    assert_eq!((run["state"].as_str(), run["figures"].is_null()), (Some("cancelled"), true));
    assert_eq!(server.look(&format!("/lab/runs/{removed}")).await.status, 404);
    let tracks: Vec<_> = track_hashes(&server, &ids).await;
    assert!(tracks.windows(2).all(|pair| pair[0] == pair[1]), "{tracks:?}");
    // With the walk go its runs.
    assert_eq!(ask(server.client.delete(server.api(&format!("/sessions/{session_id}")))).await.status, 204);
    assert_eq!(server.look("/lab/runs").await.body, json!([]));
}

async fn track_hashes(server: &TestServer, ids: &[String]) -> Vec<Value> {
    let mut tracks = Vec::new();
    for id in ids {
        let run = server.look(&format!("/lab/runs/{id}")).await.body;
        tracks.push(run["provenance"]["track_sha256"].clone());
    }
    tracks
}

#[tokio::test]
async fn a_set_of_parameters_is_an_engineer_s_and_each_change_is_written_down() {
    let (server, staff) = server_with_staff().await;
    let person = |name: &str| staff.iter().find(|person| person.name == name).unwrap();
    let (engineer, surveyor, admin) = (person("engineer"), person("surveyor"), person("admin"));
    let path = "/lab/parameter-sets";
    let set = json!({ "name": "firm", "parameters": { "marker_sigma_m": 0.1 } });
    assert_eq!(surveyor.ask(&server, Method::POST, path, &set).await.status, 403);
    let made = engineer.ask(&server, Method::POST, path, &set).await;
    assert_eq!((made.status, made.body["created_by"].as_str()), (201, Some("engineer")));
    assert_eq!(engineer.ask(&server, Method::POST, path, &set).await.code(), "name_taken");
    let one = format!("{path}/{}", made.id());
    let softer = json!({ "name": "firm", "parameters": { "marker_sigma_m": 0.2 }, "version": 1 });
    assert_eq!(engineer.ask(&server, Method::PUT, &one, &softer).await.body["version"], 2);
    let late = engineer.ask(&server, Method::PUT, &one, &softer).await;
    assert_eq!((late.status, late.code()), (409, "set_changed"));
    assert_eq!(late.body["current"]["parameters"]["marker_sigma_m"], 0.2);
    assert_eq!(engineer.ask(&server, Method::DELETE, &one, &json!({})).await.status, 204);
    let log = admin.get(&server, "/audit?action=parameter_set").await.body;
    let told: Vec<_> =
        log.as_array().unwrap().iter().map(|entry| entry["action"].as_str().unwrap()).collect();
    assert_eq!(told, ["parameter_set.removed", "parameter_set.changed", "parameter_set.added"]);
    assert_eq!(log[1]["before"]["parameters"]["marker_sigma_m"], 0.1);
}
