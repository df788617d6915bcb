//! What those see who watch a server: whether it is ready, its figures, and the dashboard that draws them.

use std::collections::BTreeSet;
use std::path::Path;

use lodestep_engine::sample::ImuSample;
use lodestep_engine::systems::pedestrian::Side;
use lodestep_tests::device::TestDevice;
use lodestep_tests::hand_in::ask;
use lodestep_tests::server::TestServer;
use serde_json::{Value, json};

#[tokio::test]
async fn a_server_with_all_it_needs_is_ready() {
    let server = TestServer::start().await;
    let answer = ask(server.client.get(server.url("/readyz"))).await;
    assert_eq!(answer.status, 200, "{answer:?}");
    assert!(answer.body["database_version"].as_i64().unwrap() >= 10, "{answer:?}");
    assert!(answer.body["free_bytes"].as_u64().unwrap() > 0, "{answer:?}");
}

#[tokio::test]
async fn a_server_whose_disk_is_nearly_full_is_well_but_not_ready_and_says_why() {
    let server = TestServer::start_with(|config| config.least_free_bytes = u64::MAX).await;
    let answer = ask(server.client.get(server.url("/readyz"))).await;
    assert_eq!((answer.status, answer.code()), (503, "not_ready"), "{answer:?}");
    assert!(answer.detail().contains("bytes left"), "{answer:?}");
    assert_eq!(server.client.get(server.url("/healthz")).send().await.unwrap().status(), 200);
}

/// The names of figures in the expressions of a dashboard.
fn drawn(dashboard: &Value) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    for panel in dashboard["panels"].as_array().unwrap() {
        for target in panel["targets"].as_array().unwrap() {
            let expression = target["expr"].as_str().unwrap();
            let words = expression.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
            names.extend(
                words
                    .filter(|word| word.starts_with("lodestep_") || word.starts_with("process_"))
                    .map(str::to_owned),
            );
        }
    }
    names
}

/// The names of the figures that a server tells, as Prometheus stores them.
async fn told(server: &TestServer) -> (BTreeSet<String>, String) {
    let text = server.client.get(server.url("/metrics")).send().await.unwrap().text().await.unwrap();
    let names = text.lines().filter(|line| !line.starts_with('#'));
    let names = names.filter_map(|line| line.split([' ', '{']).next()).filter(|name| !name.is_empty());
    (names.map(str::to_owned).collect(), text)
}

/// A second of a sensor at rest.
fn at_rest() -> Vec<ImuSample> {
    let sample = |k: i64| ImuSample {
        t_ns: k * 10_000_000,
        w_ib_b_rad_s: [0.001 * (k % 3) as f64, 0.0, 0.001],
        f_b_m_s2: [0.0, 0.01 * (k % 5) as f64, 9.79],
        mag_b_ut: None,
        pressure_hpa: None,
    };
    (0..100).map(sample).collect()
}

#[tokio::test]
async fn the_dashboard_draws_figures_that_there_are_and_none_is_left_out() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../deploy/grafana-dashboard.json");
    let dashboard: Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    let server = TestServer::start().await;
    // A little of everything that is counted.
    let (mut device, _) = TestDevice::begin(&server, &server.inspector().await).await;
    for foot in Side::BOTH {
        device.send_frame(foot, 0, &at_rest()).await;
        device.acknowledged(foot, 0).await;
    }
    let session_id = server.session(json!({})).await;
    server.process(&session_id).await;
    let refused = json!({"name": "nobody", "password": "no such password"});
    assert_eq!(server.post("/account/sign-in", &refused).await.0, 401);

    let (told, text) = told(&server).await;
    let live = text.lines().find_map(|line| line.strip_prefix("lodestep_live_sessions "));
    assert!(live.and_then(|value| value.parse::<f64>().ok()) >= Some(1.0), "one walks now, found {live:?}");
    let drawn = drawn(&dashboard);
    assert!(drawn.len() > 15, "{drawn:?}");
    // Nothing has been told to another program here, and there is no backup.
    let may_lack = |name: &str| name.contains("webhook") || name.contains("backup");
    let missing: Vec<_> = drawn.iter().filter(|name| !told.contains(*name) && !may_lack(name)).collect();
    assert!(missing.is_empty(), "the dashboard draws {missing:?}, which the server does not tell");
    let undrawn: Vec<_> = told
        .iter()
        .filter(|name| !name.ends_with("_sum") && !name.ends_with("_count"))
        .filter(|name| !drawn.contains(*name))
        .collect();
    assert!(undrawn.is_empty(), "{undrawn:?} are told and not drawn");
    for name in told.iter().map(|name| name.trim_end_matches("_bucket")) {
        let is_part = name.ends_with("_sum") || name.ends_with("_count");
        assert!(is_part || text.contains(&format!("# HELP {name} ")), "{name} has no description");
    }
    let panels = dashboard["panels"].as_array().unwrap();
    let ids: BTreeSet<_> = panels.iter().map(|panel| panel["id"].as_u64()).collect();
    assert_eq!(ids.len(), panels.len(), "two panels with one id");
}

#[tokio::test]
async fn no_figure_names_a_person_or_an_id() {
    let server = TestServer::start().await;
    let (_, inspector) = server.post("/inspectors", &json!({"name": "Wang Fang"})).await;
    let id = inspector["id"].as_str().unwrap();
    server.get(&format!("/inspectors/{id}")).await;
    server.get("/markers/A17-secret").await;
    let (_, text) = told(&server).await;
    assert!(text.contains("/api/v1/inspectors/{id}"), "{text}");
    for personal in [id, "Wang", "A17-secret"] {
        assert!(!text.contains(personal), "{personal} is in {text}");
    }
}
