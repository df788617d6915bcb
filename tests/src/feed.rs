//! A dashboard as the feed sees one.

use futures_util::{SinkExt, StreamExt};
use serde_json::{Value, json};
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async};

use crate::server::TestServer;

/// A connected dashboard.
pub struct TestFeed {
    socket: WebSocketStream<MaybeTlsStream<TcpStream>>,
}

impl TestFeed {
    /// Connects, says hello and gives the snapshot.
    pub async fn open(server: &TestServer) -> (TestFeed, Value) {
        let mut feed = TestFeed::connect(server).await;
        feed.say(json!({"type": "hello"})).await;
        let snapshot = feed.next().await;
        assert_eq!(snapshot["type"], "snapshot", "{snapshot}");
        (feed, snapshot)
    }

    /// Connects and says nothing yet.
    pub async fn connect(server: &TestServer) -> TestFeed {
        let (socket, _) = connect_async(server.socket("/feed")).await.expect("the feed opens");
        TestFeed { socket }
    }

    /// Sends a message.
    pub async fn say(&mut self, message: Value) {
        self.socket.send(Message::text(message.to_string())).await.expect("the feed takes a message");
    }

    /// The next message.
    pub async fn next(&mut self) -> Value {
        loop {
            let message = self.socket.next().await.expect("the feed goes on").expect("the link holds");
            if let Message::Text(text) = message {
                return serde_json::from_str(text.as_str()).expect("messages are JSON");
            }
        }
    }

    /// The next change for which `wanted` says yes.
    pub async fn change(&mut self, wanted: impl Fn(&Value) -> bool) -> Value {
        loop {
            let message = self.next().await;
            let changes = message["changes"].as_array().into_iter().flatten();
            if let Some(change) = changes.into_iter().find(|change| wanted(change)) {
                return change.clone();
            }
        }
    }
}
