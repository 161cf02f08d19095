//! The page's server: static files, and one WebSocket per page. It runs on its own thread and never blocks the
//! process's loop.

mod connections;
#[cfg(any(test, feature = "fed"))]
#[path = "../../tests/support/fed.rs"]
pub mod fed;
mod guard;
mod live;
mod notice;
mod page_headers;
mod rate_limit;
mod server_identity;
mod stop;
#[cfg(test)]
mod tests;

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::{io, thread};

use axum::Router;
use axum::body::Bytes;
use axum::extract::State;
use axum::http::{HeaderMap, header};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use config::leo::{Console, ReadWithoutToken};
use crossbeam::channel::{Receiver, Sender, unbounded};
use tokio::net::{TcpListener, TcpSocket};

use crate::io::requester::QueuedRequest;
use crate::state_store::StateStore;
pub(crate) use guard::{Access, Token};
pub(crate) use live::Timeouts;
pub(crate) use server_identity::ServerIdentity;

/// Maximum number of requests queued for the loop; further ones are answered with an error.
const MAX_PENDING_REQUESTS: usize = 256;
/// The listen backlog. A SYN beyond it would be retransmitted only after a second.
const BACKLOG: u32 = 4096;
/// Maximum number of open pages.
const MAX_PAGES: u64 = 32;
/// Maximum number of open read-only pages, which have no token.
const MAX_READERS: u64 = 16;

/// The page's files, compressed with gzip.
const INDEX: &[u8] = include_bytes!("../../page/built/index.html.gz");
const SCRIPT: &[u8] = include_bytes!("../../page/built/page.js.gz");
const STYLE: &[u8] = include_bytes!("../../page/built/page.css.gz");

/// Counters of the pages.
#[derive(Debug, Default)]
pub(crate) struct Counts {
    pub(crate) open: AtomicU64,
    /// Open pages without the token.
    readers: AtomicU64,
    pub(crate) malformed: AtomicU64,
    pub(crate) refused: AtomicU64,
}

/// State shared by the loop and the server.
#[derive(Debug)]
pub(crate) struct Shared {
    state_store: Mutex<StateStore>,
    pub(crate) counts: Counts,
    /// The latest metrics in the OpenMetrics format.
    metrics: Mutex<Bytes>,
    urdf: Bytes,
    pending_requests: Sender<QueuedRequest>,
    policy: guard::AccessPolicy,
    stop: stop::Stop,
    connections: Arc<connections::Table>,
    /// The teacher who acts if a page names none.
    first: u16,
    /// The number of the next page.
    pages: AtomicU64,
    timeouts: Timeouts,
}

impl Shared {
    /// An empty state, and the receiver of the pages' requests.
    fn new(
        urdf: String,
        first: u16,
        policy: guard::AccessPolicy,
        stop: stop::Stop,
        timeouts: Timeouts,
    ) -> (Arc<Self>, Receiver<QueuedRequest>) {
        let (pending_requests, asked) = unbounded();
        let shared = Self {
            state_store: Mutex::default(),
            counts: Counts::default(),
            metrics: Mutex::default(),
            urdf: urdf.into(),
            pending_requests,
            policy,
            stop,
            connections: Arc::default(),
            first,
            pages: AtomicU64::new(1),
            timeouts,
        };
        (Arc::new(shared), asked)
    }

    /// The displayed state. A panic of another thread cannot leave an entry half written.
    pub(crate) fn state_store(&self) -> MutexGuard<'_, StateStore> {
        self.state_store.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Queues a request for the loop. Returns `false` if the queue is full.
    fn ask(&self, asked: QueuedRequest) -> bool {
        // Pages are served by one thread, so the length cannot change in between.
        self.pending_requests.len() < MAX_PENDING_REQUESTS && self.pending_requests.send(asked).is_ok()
    }

    /// Queues the cleanup of a closed page, even if the queue is full.
    fn ask_unbounded(&self, asked: QueuedRequest) {
        // At shutdown the receiver may be gone already.
        let _gone = self.pending_requests.send(asked);
    }

    /// Replaces the metrics served to scrapers.
    pub(crate) fn set_metrics(&self, metrics: String) {
        *self.metrics.lock().unwrap_or_else(PoisonError::into_inner) = metrics.into();
    }
}

/// A slot among the open pages, held until it is dropped.
struct PageSlot {
    shared: Arc<Shared>,
    access: Access,
}

impl PageSlot {
    /// Takes a slot, if one is free. Pages without the token cannot use up the slots of those with it.
    fn take(shared: &Arc<Shared>, access: Access) -> Option<Self> {
        let take = |places: &AtomicU64, max: u64| {
            let further = |open: u64| (open < max).then_some(open + 1);
            places.fetch_update(Ordering::Relaxed, Ordering::Relaxed, further).is_ok()
        };
        if access == Access::Read && !take(&shared.counts.readers, MAX_READERS) {
            return None;
        }
        if take(&shared.counts.open, MAX_PAGES) {
            return Some(Self { shared: Arc::clone(shared), access });
        }
        if access == Access::Read {
            shared.counts.readers.fetch_sub(1, Ordering::Relaxed);
        }
        None
    }
}

impl Drop for PageSlot {
    fn drop(&mut self) {
        self.shared.counts.open.fetch_sub(1, Ordering::Relaxed);
        if self.access == Access::Read {
            self.shared.counts.readers.fetch_sub(1, Ordering::Relaxed);
        }
    }
}

/// The configuration of the server.
pub(crate) struct Serving {
    pub(crate) address: SocketAddr,
    /// Whether another port will not do.
    pub(crate) port_required: bool,
    /// The port and token of the previous server.
    pub(crate) before: ServerIdentity,
    pub(crate) urdf: String,
    /// The teacher who acts if a page names none.
    pub(crate) first: u16,
    pub(crate) open: ReadWithoutToken,
    /// The domain of the robot that the stop button stops.
    pub(crate) domain: PathBuf,
    /// Whether the motor process runs on this machine.
    pub(crate) moves_here: bool,
    pub(crate) timeouts: Timeouts,
}

/// The running server; dropping it stops the server.
pub(crate) struct Web {
    pub(crate) shared: Arc<Shared>,
    pub(crate) pending_requests: Receiver<QueuedRequest>,
    /// The address for the operator.
    pub(crate) url: String,
    /// Whether it listens on all addresses of this machine.
    pub(crate) everywhere: bool,
    /// The configured port, if it was in use and another one was taken.
    pub(crate) port_in_use: Option<u16>,
    /// The port and token for the next incarnation.
    pub(crate) server_identity: ServerIdentity,
    _stop: tokio::sync::oneshot::Sender<()>,
}

impl Web {
    /// Starts the server. Reuses the port and the token of the previous incarnation, which open pages know. If the port
    /// is in use, it takes the next free one, unless that port is required.
    ///
    /// # Errors
    ///
    /// The address does not belong to this machine, its port is required and in use, or the system has no thread or
    /// random number left.
    pub(crate) fn serve(serving: Serving) -> io::Result<Self> {
        let Serving { address, port_required, before, urdf, first, open, domain, moves_here, timeouts } =
            serving;
        let mut runtime = tokio::runtime::Builder::new_current_thread();
        // One blocking thread is for raising the emergency stop.
        let runtime = runtime.enable_all().max_blocking_threads(1).build()?;
        let listener = {
            let _entered = runtime.enter();
            bind_next_free(address, before.port, port_required)?
        };
        let at = listener.local_addr()?;
        let token = before.token.map_or_else(Token::new, Ok)?;
        let server_identity = ServerIdentity { port: Some(at.port()), token: Some(token.clone()) };
        let query = format!("?token={}", token.as_str());
        let policy = guard::AccessPolicy { token, port: at.port(), open };
        let (shared, asked) = Shared::new(urdf, first, policy, stop::Stop::new(domain, moves_here), timeouts);
        let (stop, stopped) = tokio::sync::oneshot::channel();
        let state = Arc::clone(&shared);
        thread::Builder::new().name("web".to_owned()).spawn(move || {
            runtime.block_on(async {
                let ends = async {
                    // The sender is dropped with the server.
                    let _ = stopped.await;
                };
                tokio::select! {
                    () = ends => {}
                    () = connections::serve(listener, routes(&state), state) => {}
                }
            });
        })?;
        // If it listens on all addresses, print the loopback address, which always exists.
        let here = SocketAddr::new(
            match at.ip() {
                any if !any.is_unspecified() => any,
                IpAddr::V4(_) => Ipv4Addr::LOCALHOST.into(),
                IpAddr::V6(_) => Ipv6Addr::LOCALHOST.into(),
            },
            at.port(),
        );
        let everywhere = here != at;
        let url = format!("http://{here}/{query}");
        let port_in_use = Some(address.port()).filter(|port| *port != 0 && *port != at.port());
        Ok(Self {
            shared,
            pending_requests: asked,
            url,
            everywhere,
            port_in_use,
            server_identity,
            _stop: stop,
        })
    }

    /// Number of refused or malformed messages, refused requests and evicted connections.
    pub(crate) fn refused(&self) -> u64 {
        let counts = &self.shared.counts;
        let refused = counts.malformed.load(Ordering::Relaxed) + counts.refused.load(Ordering::Relaxed);
        refused + self.shared.connections.evicted()
    }

    /// Number of open pages.
    pub(crate) fn open(&self) -> u64 {
        self.shared.counts.open.load(Ordering::Relaxed)
    }
}

/// Why the page cannot have its address.
#[derive(Debug, thiserror::Error)]
pub enum PageAddressError {
    /// The port is in use, and no other one will do.
    #[error(
        "{0} is in use, and `console.port_required` of leo.toml is true: end the program that uses it (`ss -ltnp` names \
         it), or choose another `console.address`"
    )]
    InUse(SocketAddr),
    /// The address is that of another machine, or its network is down.
    #[error(
        "this machine has no address {} now; `ip address` lists those that it has: change `console.address` of leo.toml, \
         where 0.0.0.0 stands for all of them",
        _0.ip()
    )]
    Absent(SocketAddr),
    /// The system refuses the address.
    #[error("{address}: {source}; choose another `console.address` in leo.toml")]
    Refused {
        /// The address.
        address: SocketAddr,
        /// The error of the operating system.
        source: io::Error,
    },
}

impl PageAddressError {
    fn new(address: SocketAddr, source: io::Error) -> Self {
        if source.kind() == io::ErrorKind::AddrInUse {
            Self::InUse(address)
        } else if source.kind() == io::ErrorKind::AddrNotAvailable {
            Self::Absent(address)
        } else {
            Self::Refused { address, source }
        }
    }
}

/// Refuses a robot whose page must have its address and cannot.
///
/// # Errors
///
/// The port is required, and is in use or cannot be listened at.
pub fn check_port(console: &Console) -> Result<(), PageAddressError> {
    let Some(address) = console.address.get().filter(|_| console.port_required) else { return Ok(()) };
    match std::net::TcpListener::bind(address) {
        Err(error) => Err(PageAddressError::new(address, error)),
        Ok(_) => Ok(()),
    }
}

/// Opens the listening socket: at the port of the previous incarnation, at the configured one, or at the next free one
/// after it.
fn bind_next_free(address: SocketAddr, before: Option<u16>, required: bool) -> io::Result<TcpListener> {
    let is_in_use = |error: &io::Error| error.kind() == io::ErrorKind::AddrInUse;
    let at = |port| bind_listener(SocketAddr::new(address.ip(), port));
    let failed = |error| io::Error::other(PageAddressError::new(address, error));
    if required {
        return at(address.port()).map_err(failed);
    }
    // 0 stands for any free port, which is taken if none is free after the configured one.
    for port in before.into_iter().chain(address.port()..=u16::MAX).chain([0]) {
        match at(port) {
            Err(error) if is_in_use(&error) => {}
            bound => return bound.map_err(failed),
        }
    }
    Err(failed(io::ErrorKind::AddrInUse.into()))
}

/// Opens the listening socket.
fn bind_listener(address: SocketAddr) -> io::Result<TcpListener> {
    let socket = if address.is_ipv4() { TcpSocket::new_v4() } else { TcpSocket::new_v6() }?;
    // The port may still be in TIME_WAIT after the previous robot.
    socket.set_reuseaddr(true)?;
    socket.bind(address)?;
    socket.listen(BACKLOG)
}

/// The routes of the server.
fn routes(state: &Arc<Shared>) -> Router {
    let part = |gzip: &'static [u8], kind: &'static str| {
        get(move |headers: HeaderMap| async move { file(gzip, kind, &headers) })
    };
    Router::new()
        .route("/", part(INDEX, "text/html; charset=utf-8"))
        .route("/page.js", part(SCRIPT, "text/javascript; charset=utf-8"))
        .route("/page.css", part(STYLE, "text/css; charset=utf-8"))
        .route("/leo.urdf", get(urdf))
        .route("/metrics", get(serve_metrics))
        .route("/live", get(live::live))
        .route(guard::STOP, post(stop::stop))
        .layer(axum::middleware::from_fn_with_state(Arc::clone(state), guard::guard))
        .with_state(Arc::clone(state))
}

fn file(gzip: &'static [u8], kind: &'static str, asked: &HeaderMap) -> Response {
    let headers = [
        (header::CONTENT_TYPE, kind),
        (header::CONTENT_ENCODING, "gzip"),
        (header::CACHE_CONTROL, "no-cache"),
    ];
    (headers, page_headers::page_headers(asked), gzip).into_response()
}

async fn urdf(State(shared): State<Arc<Shared>>) -> Response {
    ([(header::CONTENT_TYPE, "application/xml")], shared.urdf.clone()).into_response()
}

async fn serve_metrics(State(shared): State<Arc<Shared>>) -> Response {
    let text = shared.metrics.lock().unwrap_or_else(PoisonError::into_inner).clone();
    ([(header::CONTENT_TYPE, reports::metrics::CONTENT_TYPE)], text).into_response()
}
