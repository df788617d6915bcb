//! Those who take and do not give: dashboards that never read, connections that never finish a request.

use std::time::Duration;

use futures_util::SinkExt;
use tokio::io::AsyncWriteExt;
use tokio::net::TcpStream;
use tokio::time::{Instant, sleep, sleep_until};
use tokio_tungstenite::tungstenite::Message;

use super::api::Api;

/// A byte is sent this often.
const BYTE_EVERY: Duration = Duration::from_secs(3);

/// Says hello to the feed, never reads, and comes back when it is cut.
pub(super) async fn silent_dashboard(api: Api, from: Instant) {
    sleep_until(from).await;
    loop {
        if let Ok(mut socket) = api.socket("/feed").await {
            let _ = socket.send(Message::text(r#"{"type":"hello"}"#)).await;
            // A ping goes nowhere once the server has given up on it.
            while socket.send(Message::Ping(Default::default())).await.is_ok() {
                sleep(BYTE_EVERY).await;
            }
        }
        sleep(BYTE_EVERY).await;
    }
}

/// Sends a request byte by byte, and begins another when it is cut.
pub(super) async fn slow_loris(api: Api, from: Instant, number: u32) {
    sleep_until(from + Duration::from_millis(u64::from(number) * 10)).await;
    let request = format!("GET /healthz HTTP/1.1\r\nHost: localhost\r\nX-Slow: {}\r\n", "z".repeat(4_000));
    loop {
        if let Ok(mut stream) = TcpStream::connect(api.address()).await {
            for byte in request.as_bytes() {
                if stream.write_all(&[*byte]).await.is_err() {
                    break;
                }
                sleep(BYTE_EVERY).await;
            }
        }
        sleep(BYTE_EVERY).await;
    }
}
