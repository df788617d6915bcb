//! A program that is told of events: it keeps what was posted to it, and answers as it is told to.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Notify;

/// What was posted.
#[derive(Clone, Debug)]
pub struct Posted {
    /// The first line and the headers, as they came.
    pub head: String,
    /// The body.
    pub body: String,
}

impl Posted {
    /// The value of a header.
    pub fn header(&self, name: &str) -> Option<&str> {
        let named = self.head.lines().filter_map(|line| line.split_once(':'));
        named.into_iter().find(|(known, _)| known.eq_ignore_ascii_case(name)).map(|(_, value)| value.trim())
    }
}

#[derive(Debug, Default)]
struct Kept {
    posted: Vec<Posted>,
    /// Status lines with which the next ones are answered; 204 when there is none.
    answers: VecDeque<String>,
    /// What has this in its body is answered with 422.
    refused: Option<String>,
}

/// Listens on a free loopback port until it is dropped.
#[derive(Debug)]
pub struct TestReceiver {
    /// Where it listens.
    pub url: String,
    kept: Arc<Mutex<Kept>>,
    came: Arc<Notify>,
    task: tokio::task::JoinHandle<()>,
}

impl TestReceiver {
    /// Starts one.
    pub async fn start() -> TestReceiver {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free loopback port");
        let address = listener.local_addr().expect("a bound listener has an address");
        let (kept, came) = (Arc::new(Mutex::new(Kept::default())), Arc::new(Notify::new()));
        let task = tokio::spawn(listen(listener, Arc::clone(&kept), Arc::clone(&came)));
        TestReceiver { url: format!("http://{address}/hook"), kept, came, task }
    }

    /// The next ones are answered with these status lines, such as `503 Service Unavailable`, then with 204.
    pub fn answer_with(&self, lines: &[&str]) {
        let mut kept = self.kept.lock().expect("nobody panics while holding it");
        kept.answers.extend(lines.iter().map(|line| (*line).to_owned()));
    }

    /// From now on what has this in its body is answered with 422.
    pub fn refuse(&self, text: &str) {
        self.kept.lock().expect("nobody panics while holding it").refused = Some(text.to_owned());
    }

    /// What was posted so far.
    pub fn posted(&self) -> Vec<Posted> {
        self.kept.lock().expect("nobody panics while holding it").posted.clone()
    }

    /// Waits until so many have come.
    pub async fn wait_for(&self, count: usize) -> Vec<Posted> {
        loop {
            let came = self.came.notified();
            let posted = self.posted();
            if posted.len() >= count {
                return posted;
            }
            came.await;
        }
    }
}

impl Drop for TestReceiver {
    fn drop(&mut self) {
        self.task.abort();
    }
}

async fn listen(listener: TcpListener, kept: Arc<Mutex<Kept>>, came: Arc<Notify>) {
    while let Ok((stream, _)) = listener.accept().await {
        let (kept, came) = (Arc::clone(&kept), Arc::clone(&came));
        tokio::spawn(async move {
            // A connection that breaks off has posted nothing.
            let _ = take(stream, &kept, &came).await;
        });
    }
}

/// One request of one connection.
async fn take(mut stream: TcpStream, kept: &Mutex<Kept>, came: &Notify) -> std::io::Result<()> {
    let mut bytes = Vec::new();
    let head_bytes = loop {
        if let Some(end) = bytes.windows(4).position(|four| four == b"\r\n\r\n") {
            break end + 4;
        }
        if stream.read_buf(&mut bytes).await? == 0 {
            return Ok(());
        }
    };
    let head = String::from_utf8_lossy(&bytes[..head_bytes]).into_owned();
    let mut posted = Posted { head, body: String::new() };
    let length = posted.header("content-length").and_then(|text| text.parse().ok()).unwrap_or(0);
    let mut body = bytes.split_off(head_bytes);
    while body.len() < length {
        if stream.read_buf(&mut body).await? == 0 {
            return Ok(());
        }
    }
    posted.body = String::from_utf8_lossy(&body).into_owned();
    let line = {
        let mut kept = kept.lock().expect("nobody panics while holding it");
        let refused = kept.refused.as_ref().is_some_and(|text| posted.body.contains(text));
        kept.posted.push(posted);
        if refused {
            kept.answers.push_front("422 Unprocessable Content".to_owned());
        }
        kept.answers.pop_front().unwrap_or_else(|| "204 No Content".to_owned())
    };
    let answer = format!("HTTP/1.1 {line}\r\nContent-Length: 4\r\nConnection: close\r\n\r\nseen");
    let answer = if line.starts_with("204") {
        format!("HTTP/1.1 {line}\r\nConnection: close\r\n\r\n")
    } else {
        answer
    };
    came.notify_waiters();
    stream.write_all(answer.as_bytes()).await
}
