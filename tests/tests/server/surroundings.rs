//! What holds for every route: who may ask, what every answer carries, where the server may listen.

use lodestep_server::config::Config;
use lodestep_server::serve;
use lodestep_tests::server::TestServer;
use tokio::net::TcpListener;

#[tokio::test]
async fn an_address_that_others_can_reach_is_refused_with_the_reason() {
    let folder = tempfile::TempDir::new().unwrap();
    let listener = TcpListener::bind("0.0.0.0:0").await.unwrap();
    let refused = serve::serve(Config::for_testing(folder.path()), listener, async {}).await.unwrap_err();
    let sentence = refused.to_string();
    assert!(sentence.contains("nobody can sign in yet"), "{sentence}");
    assert!(!folder.path().join("lodestep.db").exists(), "nothing is begun before the refusal");

    let mut config = Config::for_testing(folder.path());
    config.listen = "192.0.2.1:8080".parse().unwrap();
    let sentence = serve::bind(&config).await.unwrap_err().to_string();
    assert!(sentence.contains("192.0.2.1:8080") && sentence.contains("SSH tunnel"), "{sentence}");
}

#[tokio::test]
async fn a_well_server_says_ok() {
    let server = TestServer::start().await;
    let answer = server.client.get(server.url("/healthz")).send().await.unwrap();
    assert_eq!(answer.status(), 200);
    assert_eq!(answer.text().await.unwrap(), "ok");
}
