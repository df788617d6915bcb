//! Connections: how many there may be, how long one may take for its header or be idle, and who makes room when there are too many.
//!
//! Nobody has to sign in to open a connection. So those that do nothing are the first to go: when the last place is taken, of the
//! address with the most connections the one goes that has been idle for longest, and the newcomer gets its place.

use std::collections::HashMap;
use std::convert::Infallible;
use std::net::{IpAddr, SocketAddr};
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};
use std::time::{Duration, Instant};
use std::{io, pin};

use axum::Router;
use axum::body::Body;
use axum::extract::ConnectInfo;
use axum::http::StatusCode;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;
use tokio_util::sync::CancellationToken;
use tower::ServiceExt;

/// How long a header may take, and a connection be without a request.
const HEADER_WITHIN: Duration = Duration::from_secs(30);
/// Descriptors that are left to the database, to uploads, and to what the program opens now and then.
const DESCRIPTORS_KEPT: u64 = 256;
/// More connections than this are never let in.
const MOST: usize = 16_384;
/// Pause after a connection that could not be accepted for want of something.
const ACCEPT_AGAIN_AFTER: Duration = Duration::from_millis(100);

/// How many connections this process can hold, with as many descriptors as it may have.
pub(crate) fn most() -> usize {
    let descriptors = raise_descriptors();
    usize::try_from(descriptors.saturating_sub(DESCRIPTORS_KEPT)).unwrap_or(MOST).clamp(64, MOST)
}

/// Raises the soft limit on descriptors to the hard one; how many there may be.
#[cfg(unix)]
fn raise_descriptors() -> u64 {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    let limit = getrlimit(Resource::Nofile);
    let raised = Rlimit { current: limit.maximum, maximum: limit.maximum };
    if let Err(error) = setrlimit(Resource::Nofile, raised) {
        tracing::debug!(%error, "the limit on descriptors stays as it is: {error}");
    }
    getrlimit(Resource::Nofile).current.unwrap_or(u64::MAX)
}

#[cfg(not(unix))]
fn raise_descriptors() -> u64 {
    u64::MAX
}

/// Serves until told to stop, then until what is open has ended.
pub(crate) async fn serve(listener: TcpListener, router: Router, most: usize, stopping: CancellationToken) {
    let open = Open::new(most);
    let (all_ended, at_work) = watch::channel(());
    loop {
        let accepted = tokio::select! {
            accepted = listener.accept() => accepted,
            () = stopping.cancelled() => break,
        };
        let (stream, address) = match accepted {
            Ok(accepted) => accepted,
            Err(error) if is_of_one_connection(&error) => continue,
            Err(error) => {
                // Out of descriptors, for one: somebody has to go.
                open.is_full(&error.to_string());
                open.make_room(None);
                tokio::time::sleep(ACCEPT_AGAIN_AFTER).await;
                continue;
            }
        };
        // A pose or an acknowledgement is small: it must not wait until the one before has arrived. Where that cannot be set it does.
        let _ = stream.set_nodelay(true);
        if let Some(connection) = open.admit(address) {
            let (router, stopping, at_work) = (router.clone(), stopping.clone(), at_work.clone());
            tokio::spawn(async move {
                connection.run(stream, router, stopping).await;
                drop(at_work);
            });
        }
    }
    drop((listener, at_work));
    all_ended.closed().await;
}

/// Whether the one who came is gone again; anything else concerns all.
fn is_of_one_connection(error: &io::Error) -> bool {
    use io::ErrorKind::{ConnectionAborted, ConnectionRefused, ConnectionReset};
    matches!(error.kind(), ConnectionRefused | ConnectionAborted | ConnectionReset)
}

/// The open connections.
#[derive(Clone, Debug)]
struct Open {
    most: usize,
    begun_at: Instant,
    by: Arc<Mutex<HashMap<u64, Arc<Known>>>>,
    next: Arc<AtomicU64>,
    /// Whether it was said that there is no place left.
    told: Arc<AtomicBool>,
}

/// What is known of one.
#[derive(Debug)]
struct Known {
    address: IpAddr,
    begun_at: Instant,
    /// When bytes last came or went, ms since `begun_at`.
    last_ms: AtomicU64,
    /// Requests that are being answered.
    requests: AtomicUsize,
    /// It is a websocket now, which has deadlines of its own.
    is_socket: AtomicBool,
    cut: CancellationToken,
}

impl Known {
    fn is_idle(&self) -> bool {
        !self.cut.is_cancelled()
            && !self.is_socket.load(Ordering::Relaxed)
            && self.requests.load(Ordering::Relaxed) == 0
    }

    fn touch(&self) {
        let now_ms = u64::try_from(self.begun_at.elapsed().as_millis()).unwrap_or(u64::MAX);
        self.last_ms.store(now_ms, Ordering::Relaxed);
    }
}

impl Open {
    fn new(most: usize) -> Open {
        let by = Arc::default();
        Open { most, begun_at: Instant::now(), by, next: Arc::default(), told: Arc::default() }
    }

    /// Gives a new connection its place; none, when all are taken by those who are at work.
    fn admit(&self, address: SocketAddr) -> Option<Connection> {
        let peer = address.ip();
        let (all, of_address) = {
            let by = self.by();
            (by.len(), by.values().filter(|known| known.address == peer).count())
        };
        // A proxy at this machine speaks for many.
        let has_its_share = !peer.is_loopback() && of_address >= (self.most / 2).max(1);
        if has_its_share && !self.make_room(Some(peer)) {
            return None;
        }
        if all >= self.most {
            self.is_full("all connections are taken");
            if !self.make_room(None) {
                return None;
            }
        } else if all < self.most / 10 * 9 && self.told.swap(false, Ordering::Relaxed) {
            tracing::info!("there is room for connections again");
        }
        let number = self.next.fetch_add(1, Ordering::Relaxed);
        let known = Arc::new(Known {
            address: peer,
            begun_at: self.begun_at,
            last_ms: AtomicU64::new(0),
            requests: AtomicUsize::new(0),
            is_socket: AtomicBool::new(false),
            cut: CancellationToken::new(),
        });
        known.touch();
        self.by().insert(number, Arc::clone(&known));
        metrics::gauge!("lodestep_connections").set(self.by().len() as f64);
        Some(Connection { open: self.clone(), number, address, known })
    }

    /// Says once that there are as many as there may be, until there are fewer.
    fn is_full(&self, why: &str) {
        if !self.told.swap(true, Ordering::Relaxed) {
            tracing::warn!(
                "there are as many connections as there may be ({} of {}; {why}): those that are idle for longest are closed for those that come. Look who opens so many, and let this server have more descriptors (LimitNOFILE) or set a proxy before it",
                self.by().len(),
                self.most
            );
        }
    }

    /// Closes one that is idle: of this address or, without one, of the address that has the most; whether there was any.
    fn make_room(&self, of: Option<IpAddr>) -> bool {
        let mut by = self.by();
        let mut counts: HashMap<IpAddr, usize> = HashMap::new();
        for known in by.values() {
            *counts.entry(known.address).or_default() += 1;
        }
        let idle = by.iter().filter(|(_, known)| known.is_idle() && of.is_none_or(|of| of == known.address));
        let goes = idle.min_by_key(|(_, known)| {
            (std::cmp::Reverse(counts.get(&known.address)), known.last_ms.load(Ordering::Relaxed))
        });
        let Some(number) = goes.map(|(number, _)| *number) else { return false };
        if let Some(known) = by.remove(&number) {
            metrics::counter!("lodestep_connections_cut_total").increment(1);
            known.cut.cancel();
        }
        true
    }

    fn by(&self) -> MutexGuard<'_, HashMap<u64, Arc<Known>>> {
        self.by.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// One that has its place, until it is dropped.
struct Connection {
    open: Open,
    number: u64,
    address: SocketAddr,
    known: Arc<Known>,
}

impl Drop for Connection {
    fn drop(&mut self) {
        let mut by = self.open.by();
        by.remove(&self.number);
        metrics::gauge!("lodestep_connections").set(by.len() as f64);
    }
}

impl Connection {
    async fn run(self, stream: TcpStream, router: Router, stopping: CancellationToken) {
        let io = TokioIo::new(Watched { stream, known: Arc::clone(&self.known) });
        let service = hyper::service::service_fn(|request| self.answer(request, router.clone()));
        let mut builder = http1::Builder::new();
        builder.timer(TokioTimer::new()).header_read_timeout(HEADER_WITHIN);
        let mut connection = pin::pin!(builder.serve_connection(io, service).with_upgrades());
        let ended = tokio::select! {
            ended = connection.as_mut() => ended,
            () = self.known.cut.cancelled() => return,
            () = stopping.cancelled() => {
                connection.as_mut().graceful_shutdown();
                connection.await
            }
        };
        if let Err(error) = ended {
            tracing::debug!(%error, "a connection ended badly: {error}");
        }
    }

    async fn answer(
        &self,
        request: hyper::Request<Incoming>,
        router: Router,
    ) -> Result<hyper::Response<Body>, Infallible> {
        let _answers = Answers::begin(&self.known);
        let mut request = request.map(Body::new);
        request.extensions_mut().insert(ConnectInfo(self.address));
        let response = router.oneshot(request).await?;
        if response.status() == StatusCode::SWITCHING_PROTOCOLS {
            self.known.is_socket.store(true, Ordering::Relaxed);
        }
        Ok(response)
    }
}

/// A request is being answered for as long as this is held.
struct Answers<'a>(&'a Known);

impl Answers<'_> {
    fn begin(known: &Known) -> Answers<'_> {
        known.requests.fetch_add(1, Ordering::Relaxed);
        Answers(known)
    }
}

impl Drop for Answers<'_> {
    fn drop(&mut self) {
        self.0.requests.fetch_sub(1, Ordering::Relaxed);
    }
}

/// A stream that notes when bytes come or go.
struct Watched {
    stream: TcpStream,
    known: Arc<Known>,
}

impl Watched {
    fn noted<T>(&self, polled: Poll<io::Result<T>>) -> Poll<io::Result<T>> {
        if let Poll::Ready(Ok(_)) = polled {
            self.known.touch();
        }
        polled
    }
}

impl AsyncRead for Watched {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buf: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let polled = Pin::new(&mut self.stream).poll_read(cx, buf);
        self.noted(polled)
    }
}

impl AsyncWrite for Watched {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        let polled = Pin::new(&mut self.stream).poll_write(cx, bytes);
        self.noted(polled)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bytes: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let polled = Pin::new(&mut self.stream).poll_write_vectored(cx, bytes);
        self.noted(polled)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(cx)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn from(last: u8) -> SocketAddr {
        SocketAddr::from(([10, 0, 0, last], 1))
    }

    #[test]
    fn who_comes_last_gets_the_place_of_one_who_does_nothing_at_the_address_with_the_most() {
        let open = Open::new(4);
        let mut crowd: Vec<_> = (0..2).filter_map(|_| open.admit(from(1))).collect();
        let other = open.admit(from(2)).unwrap();
        let socket = open.admit(from(3)).unwrap();
        socket.known.is_socket.store(true, Ordering::Relaxed);
        crowd[0].known.last_ms.store(7, Ordering::Relaxed);
        crowd[1].known.last_ms.store(5, Ordering::Relaxed);
        let newcomer = open.admit(from(4)).unwrap();
        assert!(crowd[1].known.cut.is_cancelled(), "the one that was idle for longest stays");
        assert!(!crowd[0].known.cut.is_cancelled() && !other.known.cut.is_cancelled());
        assert!(!socket.known.cut.is_cancelled() && !newcomer.known.cut.is_cancelled());
        // Those who are at work are left alone, and then nobody else is let in.
        crowd.swap_remove(1);
        let working = [&crowd[0], &other, &newcomer].map(|connection| Answers::begin(&connection.known));
        let last = open.admit(from(5));
        assert!(last.is_none() && working.len() == 3);
    }

    #[test]
    fn no_address_has_more_than_half_of_all_but_a_proxy_at_this_machine() {
        let open = Open::new(8);
        let held: Vec<_> = (0..6).filter_map(|_| open.admit(from(1))).collect();
        assert_eq!(held.iter().filter(|connection| !connection.known.cut.is_cancelled()).count(), 4);
        let proxy = SocketAddr::from(([127, 0, 0, 1], 1));
        let open = Open::new(8);
        let held: Vec<_> = (0..8).filter_map(|_| open.admit(proxy)).collect();
        assert!(held.iter().all(|connection| !connection.known.cut.is_cancelled()));
    }
}
