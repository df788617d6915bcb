//! A foot-mounted device as the live socket sees one: sends what a test says, when it says it.

use futures_util::{SinkExt, StreamExt};
use lodestep_engine::parse::batch::Batch;
use lodestep_engine::parse::frame;
use lodestep_engine::parse::live_message::{Answer, DeviceMessage, Hello, NextSequence, Start};
use lodestep_engine::sample::ImuSample;
use lodestep_engine::systems::catalogue::former_keys;
use lodestep_engine::systems::pedestrian::Side;
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async};

use crate::server::TestServer;

/// A connected device.
pub struct TestDevice {
    socket: WebSocketStream<MaybeTlsStream<TcpStream>>,
    /// The last acknowledged batch of each foot.
    on_disk: [Option<u64>; 2],
}

impl TestDevice {
    /// Connects and says nothing yet.
    pub async fn connect(server: &TestServer) -> TestDevice {
        let (socket, _) = connect_async(server.socket("/live")).await.expect("the live socket opens");
        TestDevice { socket, on_disk: [None; 2] }
    }

    /// Begins a session of both feet at the origin and gives its id.
    pub async fn begin(server: &TestServer, inspector_id: &str) -> (TestDevice, String) {
        let mut device = TestDevice::connect(server).await;
        let hello = Hello::Begin {
            inspector_id: inspector_id.to_owned(),
            start: Some(Start::PositionM([0.0; 3])),
            system: None,
            streams: None,
            initial_heading_deg: None,
            instrument: None,
        };
        device.send(&DeviceMessage::Hello(hello)).await;
        match device.next().await {
            Answer::Welcome { session_id, next_sequence } => {
                assert!(next_sequence.values().all(|next| *next == 0), "{next_sequence:?}");
                (device, session_id)
            }
            other => panic!("expected a welcome, found {other:?}"),
        }
    }

    /// Goes on with a session and gives the batches that the server wants next.
    pub async fn go_on(server: &TestServer, session_id: &str) -> (TestDevice, NextSequence) {
        let mut device = TestDevice::connect(server).await;
        let hello = Hello::Continue { session_id: session_id.to_owned() };
        device.send(&DeviceMessage::Hello(hello)).await;
        match device.next().await {
            Answer::Welcome { next_sequence, .. } => (device, next_sequence),
            other => panic!("expected a welcome, found {other:?}"),
        }
    }

    /// Sends a message as JSON.
    pub async fn send(&mut self, message: &DeviceMessage) {
        self.send_text(message.to_json()).await;
    }

    /// Sends any text.
    pub async fn send_text(&mut self, text: String) {
        self.socket.send(Message::text(text)).await.expect("the socket takes a message");
    }

    /// Sends a batch as a binary frame.
    pub async fn send_frame(&mut self, foot: Side, sequence: u64, samples: &[ImuSample]) {
        let mut bytes = Vec::new();
        let batch = Batch::imu(foot.stream(), sequence, samples.to_vec());
        frame::encode(foot.index() as u8, &batch, &mut bytes).expect("a batch of a test has an allowed size");
        self.send_bytes(bytes).await;
    }

    /// Sends any bytes.
    pub async fn send_bytes(&mut self, bytes: Vec<u8>) {
        self.socket.send(Message::binary(bytes)).await.expect("the socket takes a frame");
    }

    /// The next answer.
    pub async fn next(&mut self) -> Answer {
        self.try_next().await.expect("expected an answer, found the end of the connection")
    }

    /// The next answer; `None` when the server has closed.
    pub async fn try_next(&mut self) -> Option<Answer> {
        loop {
            match self.socket.next().await? {
                Ok(Message::Text(text)) => {
                    let answer = Answer::from_json(text.as_str(), &former_keys());
                    return Some(answer.expect("an answer of the protocol"));
                }
                Ok(Message::Close(_)) | Err(_) => return None,
                Ok(_) => {}
            }
        }
    }

    /// The code of the error that comes next.
    pub async fn next_error(&mut self) -> String {
        match self.next().await {
            Answer::Error(problem) => problem["code"].as_str().expect("a problem has a code").to_owned(),
            other => panic!("expected an error, found {other:?}"),
        }
    }

    /// Waits until every batch of a foot up to this one is acknowledged.
    pub async fn acknowledged(&mut self, foot: Side, sequence: u64) {
        while self.on_disk[foot.index()].is_none_or(|upto| upto < sequence) {
            match self.next().await {
                Answer::Ack { stream, sequence } => {
                    let side = Side::of(stream).expect("a foot's stream");
                    self.on_disk[side.index()] = Some(sequence);
                }
                Answer::Event(_) => {}
                other => panic!("expected acknowledgements, found {other:?}"),
            }
        }
    }

    /// Ends the walk and waits for the server's word that it has all of it.
    pub async fn finish(&mut self) {
        self.send(&DeviceMessage::Finish).await;
        loop {
            match self.next().await {
                Answer::Finished => return,
                Answer::Ack { .. } | Answer::Event(_) => {}
                other => panic!("expected the end, found {other:?}"),
            }
        }
    }

    /// Cuts the link without a word, as a pulled plug does.
    pub fn cut(self) {
        drop(self);
    }
}
