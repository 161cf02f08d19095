//! The page's server: files, and one WebSocket per page. It runs on a thread of its own, and the
//! process's loop never waits for it.

mod connections;
mod door;
#[cfg(any(test, feature = "fed"))]
pub mod fed;
mod guard;
mod live;
mod notice;
mod pace;
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
use config::leo::ReadWithoutToken;
use crossbeam::channel::{Receiver, Sender, unbounded};
use tokio::net::{TcpListener, TcpSocket};

use crate::requests::Wish;
use crate::sheet::Sheet;
pub(crate) use door::Door;
pub(crate) use guard::{Access, Token};
pub(crate) use live::Patience;

/// Wishes that wait for the loop; further ones are answered with an error.
const WISHES: usize = 256;
/// Connections that the system keeps until they are accepted. A further one would be tried again after a second.
const BACKLOG: u32 = 4096;
/// Pages at once.
const PAGES_MOST: u64 = 32;
/// Pages that only read, and have no token, at once.
const READERS_MAX: u64 = 16;

/// Bodies of the files that the page is made of, compressed with gzip.
const INDEX: &[u8] = include_bytes!("../../page/built/index.html.gz");
const SCRIPT: &[u8] = include_bytes!("../../page/built/page.js.gz");
const STYLE: &[u8] = include_bytes!("../../page/built/page.css.gz");

/// A wish of a page, to be answered to it.
#[derive(Debug)]
pub(crate) struct Asked {
    /// The page: its hand in the workspace.
    pub(crate) page: u16,
    /// The page's own number for it; none where the page is gone and nobody waits for an answer.
    pub(crate) id: Option<u64>,
    pub(crate) wish: Wish,
    pub(crate) answer: tokio::sync::mpsc::Sender<String>,
}

/// How the pages fare.
#[derive(Debug, Default)]
pub(crate) struct Counts {
    pub(crate) open: AtomicU64,
    /// Of the pages that are open, those without the token.
    readers: AtomicU64,
    pub(crate) malformed: AtomicU64,
    pub(crate) refused: AtomicU64,
}

/// What the loop and the server share.
#[derive(Debug)]
pub(crate) struct Shared {
    sheet: Mutex<Sheet>,
    pub(crate) counts: Counts,
    /// What the metrics were at the last look, in the OpenMetrics form.
    metrics: Mutex<Bytes>,
    urdf: Bytes,
    wishes: Sender<Asked>,
    lock: guard::Lock,
    stop: stop::Stop,
    connections: Arc<connections::Table>,
    /// The teacher who acts where a page names none.
    first: u16,
    /// The next page's number.
    pages: AtomicU64,
    patience: Patience,
}

impl Shared {
    /// Nothing shown yet; and where the loop hears what pages want.
    fn new(
        urdf: String,
        first: u16,
        lock: guard::Lock,
        stop: stop::Stop,
        patience: Patience,
    ) -> (Arc<Self>, Receiver<Asked>) {
        let (wishes, asked) = unbounded();
        let shared = Self {
            sheet: Mutex::default(),
            counts: Counts::default(),
            metrics: Mutex::default(),
            urdf: urdf.into(),
            wishes,
            lock,
            stop,
            connections: Arc::default(),
            first,
            pages: AtomicU64::new(1),
            patience,
        };
        (Arc::new(shared), asked)
    }

    /// What the pages are shown. A thread that panicked while it wrote has left whole cells behind.
    pub(crate) fn sheet(&self) -> MutexGuard<'_, Sheet> {
        self.sheet.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Asks the loop for something; whether it has room for it.
    fn ask(&self, asked: Asked) -> bool {
        // Pages are served by one thread: nobody comes in between.
        self.wishes.len() < WISHES && self.wishes.send(asked).is_ok()
    }

    /// Asks the loop for what a page leaves behind, for which there is always room.
    fn ask_last(&self, asked: Asked) {
        // At the end of the process the loop is gone before its pages.
        let _gone = self.wishes.send(asked);
    }

    /// What is scraped from now on.
    pub(crate) fn set_metrics(&self, metrics: String) {
        *self.metrics.lock().unwrap_or_else(PoisonError::into_inner) = metrics.into();
    }
}

/// The place of a page among those that may be open at once, until it is dropped.
struct Place {
    shared: Arc<Shared>,
    access: Access,
}

impl Place {
    /// Takes a place, where one is left. Pages without the token leave places for those with it.
    fn take(shared: &Arc<Shared>, access: Access) -> Option<Self> {
        let take = |places: &AtomicU64, most: u64| {
            let further = |open: u64| (open < most).then_some(open + 1);
            places.fetch_update(Ordering::Relaxed, Ordering::Relaxed, further).is_ok()
        };
        if access == Access::Read && !take(&shared.counts.readers, READERS_MAX) {
            return None;
        }
        if take(&shared.counts.open, PAGES_MOST) {
            return Some(Self { shared: Arc::clone(shared), access });
        }
        if access == Access::Read {
            shared.counts.readers.fetch_sub(1, Ordering::Relaxed);
        }
        None
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.shared.counts.open.fetch_sub(1, Ordering::Relaxed);
        if self.access == Access::Read {
            self.shared.counts.readers.fetch_sub(1, Ordering::Relaxed);
        }
    }
}

/// What is served, and where.
pub(crate) struct Serving {
    pub(crate) address: SocketAddr,
    /// Where pages found the server before.
    pub(crate) before: Door,
    pub(crate) urdf: String,
    /// The teacher who acts where a page names none.
    pub(crate) first: u16,
    pub(crate) open: ReadWithoutToken,
    /// The domain whose robot is stopped.
    pub(crate) domain: PathBuf,
    /// Whether the motor process runs on this machine.
    pub(crate) moves_here: bool,
    pub(crate) patience: Patience,
}

/// The server, while it is held.
pub(crate) struct Web {
    pub(crate) shared: Arc<Shared>,
    pub(crate) wishes: Receiver<Asked>,
    /// The address that people open.
    pub(crate) url: String,
    /// Whether it is served at every other address of this machine too.
    pub(crate) everywhere: bool,
    /// What the next life needs for pages to find it.
    pub(crate) door: Door,
    _stop: tokio::sync::oneshot::Sender<()>,
}

impl Web {
    /// Serves pages at an address: at the port and with the token of the life before, which pages
    /// know, or else at the next free port where the address's own is taken.
    ///
    /// # Errors
    ///
    /// The address is none of this machine, or the system has no thread or random number left.
    pub(crate) fn serve(serving: Serving) -> io::Result<Self> {
        let Serving { address, before, urdf, first, open, domain, moves_here, patience } = serving;
        let port = before.port.unwrap_or(address.port());
        let mut runtime = tokio::runtime::Builder::new_current_thread();
        // The emergency stop is raised beside all else.
        let runtime = runtime.enable_all().max_blocking_threads(1).build()?;
        let listener = {
            let _entered = runtime.enter();
            match listening(SocketAddr::new(address.ip(), port)) {
                Err(error) if error.kind() == io::ErrorKind::AddrInUse => {
                    listening(SocketAddr::new(address.ip(), 0))?
                }
                bound => bound?,
            }
        };
        let at = listener.local_addr()?;
        let token = before.token.map_or_else(Token::new, Ok)?;
        let door = Door { port: Some(at.port()), token: Some(token.clone()) };
        let query = format!("?token={}", token.as_str());
        let lock = guard::Lock { token, port: at.port(), open };
        let (shared, asked) = Shared::new(urdf, first, lock, stop::Stop::new(domain, moves_here), patience);
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
        // Where it is served at every address of this machine, this is the one that it has for sure.
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
        Ok(Self { shared, wishes: asked, url, everywhere, door, _stop: stop })
    }

    /// What was refused, or malformed.
    pub(crate) fn refused(&self) -> u64 {
        let counts = &self.shared.counts;
        let said = counts.malformed.load(Ordering::Relaxed) + counts.refused.load(Ordering::Relaxed);
        said + self.shared.connections.made_way()
    }

    /// Pages that are open.
    pub(crate) fn open(&self) -> u64 {
        self.shared.counts.open.load(Ordering::Relaxed)
    }
}

/// Listens at an address.
fn listening(address: SocketAddr) -> io::Result<TcpListener> {
    let socket = if address.is_ipv4() { TcpSocket::new_v4() } else { TcpSocket::new_v6() }?;
    // The robot before may have ended just now.
    socket.set_reuseaddr(true)?;
    socket.bind(address)?;
    socket.listen(BACKLOG)
}

/// What is answered to which request.
fn routes(state: &Arc<Shared>) -> Router {
    let part = |gzip: &'static [u8], kind: &'static str| {
        get(move |headers: HeaderMap| async move { file(gzip, kind, &headers) })
    };
    Router::new()
        .route("/", part(INDEX, "text/html; charset=utf-8"))
        .route("/page.js", part(SCRIPT, "text/javascript; charset=utf-8"))
        .route("/page.css", part(STYLE, "text/css; charset=utf-8"))
        .route("/leo.urdf", get(urdf))
        .route("/metrics", get(scraped))
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
    (headers, guard::page_headers(asked), gzip).into_response()
}

async fn urdf(State(shared): State<Arc<Shared>>) -> Response {
    ([(header::CONTENT_TYPE, "application/xml")], shared.urdf.clone()).into_response()
}

async fn scraped(State(shared): State<Arc<Shared>>) -> Response {
    let text = shared.metrics.lock().unwrap_or_else(PoisonError::into_inner).clone();
    ([(header::CONTENT_TYPE, metrics::CONTENT_TYPE)], text).into_response()
}
