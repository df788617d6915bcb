//! A link that loses, doubles, swaps and cuts: between the devices and the server.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex};

use tokio::io::{AsyncReadExt, AsyncWriteExt, copy};
use tokio::net::tcp::{OwnedReadHalf, OwnedWriteHalf};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinHandle;

use super::random::Random;

/// What a websocket calls binary; only such frames are lost, for nothing comes after a lost text that would tell.
const BINARY: u8 = 2;

/// How often what is done to a frame of a device, in a hundred.
#[derive(Clone, Copy, Debug)]
pub struct Trouble {
    /// It never arrives.
    pub lost: u64,
    /// It arrives twice.
    pub doubled: u64,
    /// The next one overtakes it.
    pub swapped: u64,
    /// Half of it arrives, and the link is gone.
    pub halved: u64,
}

/// How often it was done.
#[derive(Clone, Copy, Debug, Default)]
pub struct Done {
    /// Frames passed on.
    pub frames: u64,
    /// Never arrived.
    pub lost: u64,
    /// Arrived twice.
    pub doubled: u64,
    /// Overtaken.
    pub swapped: u64,
    /// Cut in the middle.
    pub halved: u64,
}

/// A link; gone when it is dropped.
#[derive(Debug)]
pub struct Link {
    /// Where it listens.
    pub address: SocketAddr,
    done: Arc<Mutex<Done>>,
    task: JoinHandle<()>,
}

impl Link {
    /// One to this server.
    pub async fn to(server: SocketAddr, trouble: Trouble, mut random: Random) -> Link {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free loopback port");
        let address = listener.local_addr().expect("a bound listener has an address");
        let done = Arc::new(Mutex::new(Done::default()));
        let task = tokio::spawn({
            let done = Arc::clone(&done);
            async move {
                while let Ok((device, _)) = listener.accept().await {
                    let Ok(server) = TcpStream::connect(server).await else { continue };
                    let (from_device, to_device) = device.into_split();
                    let (from_server, to_server) = server.into_split();
                    let random = Random::of(random.word());
                    let out = Out { trouble, random, done: Arc::clone(&done), held: None };
                    tokio::spawn(carry(out, from_device, to_server, from_server, to_device));
                }
            }
        });
        Link { address, done, task }
    }

    /// What it has done so far.
    pub fn done(&self) -> Done {
        *self.done.lock().expect("nothing panics while it counts")
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        self.task.abort();
    }
}

/// Carries both ways until one side ends; then both do.
async fn carry(
    mut out: Out,
    from_device: OwnedReadHalf,
    to_server: OwnedWriteHalf,
    mut from_server: OwnedReadHalf,
    mut to_device: OwnedWriteHalf,
) {
    tokio::select! {
        _ = out.carry(from_device, to_server) => {}
        _ = copy(&mut from_server, &mut to_device) => {}
    }
}

/// The way out of a device.
struct Out {
    trouble: Trouble,
    random: Random,
    done: Arc<Mutex<Done>>,
    /// A frame that the next one overtakes.
    held: Option<Vec<u8>>,
}

impl Out {
    async fn carry(&mut self, mut from: OwnedReadHalf, mut to: OwnedWriteHalf) -> std::io::Result<()> {
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            head.push(from.read_u8().await?);
        }
        to.write_all(&head).await?;
        // Anything but a device's socket is plain HTTP, which TCP keeps whole.
        if !head.starts_with(b"GET /api/v1/live") {
            return copy(&mut from, &mut to).await.map(|_| ());
        }
        loop {
            let frame = read_frame(&mut from).await?;
            self.pass(frame, &mut to).await?;
        }
    }

    async fn pass(&mut self, frame: Vec<u8>, to: &mut OwnedWriteHalf) -> std::io::Result<()> {
        let is_batch = frame[0] & 0x0F == BINARY;
        let mark = |count: fn(&mut Done) -> &mut u64| {
            *count(&mut self.done.lock().expect("nothing panics while it counts")) += 1;
        };
        mark(|done| &mut done.frames);
        if is_batch && self.held.is_none() && self.random.percent(self.trouble.swapped) {
            mark(|done| &mut done.swapped);
            self.held = Some(frame);
            return Ok(());
        }
        if is_batch && self.random.percent(self.trouble.lost) {
            mark(|done| &mut done.lost);
        } else if self.random.percent(self.trouble.halved) {
            mark(|done| &mut done.halved);
            to.write_all(&frame[..frame.len() / 2]).await?;
            return Err(std::io::ErrorKind::ConnectionAborted.into());
        } else {
            to.write_all(&frame).await?;
            if is_batch && self.random.percent(self.trouble.doubled) {
                mark(|done| &mut done.doubled);
                to.write_all(&frame).await?;
            }
        }
        match self.held.take() {
            Some(overtaken) => to.write_all(&overtaken).await,
            None => Ok(()),
        }
    }
}

/// A whole frame of a client (RFC 6455 §5.2), as it came.
async fn read_frame(from: &mut OwnedReadHalf) -> std::io::Result<Vec<u8>> {
    let mut frame = vec![0; 2];
    from.read_exact(&mut frame).await?;
    let more = match frame[1] & 0x7F {
        126 => 2,
        127 => 8,
        _ => 0,
    };
    read_more(from, &mut frame, more).await?;
    let length = match more {
        0 => u64::from(frame[1] & 0x7F),
        _ => frame[2..].iter().fold(0, |length, byte| length << 8 | u64::from(*byte)),
    };
    let mask = if frame[1] & 0x80 == 0 { 0 } else { 4 };
    read_more(from, &mut frame, mask + length as usize).await?;
    Ok(frame)
}

async fn read_more(from: &mut OwnedReadHalf, frame: &mut Vec<u8>, bytes: usize) -> std::io::Result<()> {
    let begin = frame.len();
    frame.resize(begin + bytes, 0);
    from.read_exact(&mut frame[begin..]).await?;
    Ok(())
}
