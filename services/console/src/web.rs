//! The page's server: files, and one WebSocket per page. It runs on a thread of its own, and the
//! process's loop never waits for it.

mod connections;
mod door;
mod guard;
mod live;
mod pace;
#[cfg(test)]
mod tests;

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::{io, thread};

use axum::Router;
use axum::extract::State;
use axum::http::{HeaderMap, Uri, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use crossbeam::channel::{Receiver, Sender, unbounded};

use crate::requests::Wish;
use crate::sheet::Sheet;
pub(crate) use door::Door;
pub(crate) use guard::Token;
pub(crate) use live::Patience;

/// Wishes that wait for the loop; further ones are answered with an error.
const WISHES: usize = 256;
/// Pages at once.
const PAGES_MOST: u64 = 32;

/// Bodies of the files that the page is made of, compressed with gzip.
const INDEX: &[u8] = include_bytes!("../page/built/index.html.gz");
const SCRIPT: &[u8] = include_bytes!("../page/built/page.js.gz");
const STYLE: &[u8] = include_bytes!("../page/built/page.css.gz");

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
    pub(crate) malformed: AtomicU64,
    pub(crate) refused: AtomicU64,
}

/// What the loop and the server share.
#[derive(Debug)]
pub(crate) struct Shared {
    sheet: Mutex<Sheet>,
    pub(crate) counts: Counts,
    /// What the metrics were at the last look, in the OpenMetrics form.
    metrics: Mutex<String>,
    urdf: String,
    wishes: Sender<Asked>,
    token: Option<Token>,
    /// The teacher who acts where a page names none.
    first: u16,
    /// The next page's number.
    pages: AtomicU64,
    patience: Patience,
}

impl Shared {
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
        *self.metrics.lock().unwrap_or_else(PoisonError::into_inner) = metrics;
    }
}

/// The place of a page among those that may be open at once, until it is dropped.
struct Place {
    shared: Arc<Shared>,
}

impl Place {
    /// Takes a place, where one is left.
    fn take(shared: &Arc<Shared>) -> Option<Self> {
        let further = |open: u64| (open < PAGES_MOST).then_some(open + 1);
        let taken = shared.counts.open.fetch_update(Ordering::Relaxed, Ordering::Relaxed, further);
        taken.ok().map(|_before| Self { shared: Arc::clone(shared) })
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.shared.counts.open.fetch_sub(1, Ordering::Relaxed);
    }
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
    pub(crate) fn serve(
        address: SocketAddr,
        before: Door,
        urdf: &str,
        first: u16,
        patience: Patience,
    ) -> io::Result<Self> {
        let port = before.port.unwrap_or(address.port());
        let bound = TcpListener::bind(SocketAddr::new(address.ip(), port));
        let taken = |error: &io::Error| error.kind() == io::ErrorKind::AddrInUse;
        let listener = match bound {
            Err(error) if taken(&error) => TcpListener::bind(SocketAddr::new(address.ip(), 0))?,
            bound => bound?,
        };
        listener.set_nonblocking(true)?;
        let at = listener.local_addr()?;
        let token = match before.token {
            _ if at.ip().is_loopback() => None,
            Some(token) => Some(token),
            None => Some(Token::new()?),
        };
        let door = Door { port: Some(at.port()), token: token.clone() };
        let query = token.as_ref().map_or(String::new(), |token| format!("?token={}", token.as_str()));
        let (wishes, asked) = unbounded();
        let shared = Arc::new(Shared {
            sheet: Mutex::default(),
            counts: Counts::default(),
            metrics: Mutex::default(),
            urdf: urdf.to_owned(),
            wishes,
            token,
            first,
            pages: AtomicU64::new(1),
            patience,
        });
        let (stop, stopped) = tokio::sync::oneshot::channel();
        let state = Arc::clone(&shared);
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        thread::Builder::new().name("web".to_owned()).spawn(move || {
            runtime.block_on(async {
                let ends = async {
                    // The sender is dropped with the server.
                    let _ = stopped.await;
                };
                tokio::select! {
                    () = ends => {}
                    served = served(listener, state) => if let Err(error) = served {
                        tracing::error!(%error, "the page is no longer served");
                    },
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
        counts.malformed.load(Ordering::Relaxed) + counts.refused.load(Ordering::Relaxed)
    }

    /// Pages that are open.
    pub(crate) fn open(&self) -> u64 {
        self.shared.counts.open.load(Ordering::Relaxed)
    }
}

async fn served(listener: TcpListener, state: Arc<Shared>) -> io::Result<()> {
    let (listener, patience) = (tokio::net::TcpListener::from_std(listener)?, state.patience);
    let part = |gzip: &'static [u8], kind: &'static str| {
        get(
            move |headers: HeaderMap, uri: Uri| async move { file(gzip, kind, guard::policy(&headers, &uri)) },
        )
    };
    let routes = Router::new()
        .route("/", part(INDEX, "text/html; charset=utf-8"))
        .route("/page.js", part(SCRIPT, "text/javascript; charset=utf-8"))
        .route("/page.css", part(STYLE, "text/css; charset=utf-8"))
        .route("/leo.urdf", get(urdf))
        .route("/metrics", get(scraped))
        .route("/live", get(live::live))
        .layer(axum::middleware::from_fn_with_state(Arc::clone(&state), guard::guard))
        .with_state(state);
    connections::serve(listener, routes, patience).await;
    Ok(())
}

fn file(gzip: &'static [u8], kind: &'static str, policy: String) -> Response {
    let policy = [(header::CONTENT_SECURITY_POLICY, policy)];
    let headers = [
        (header::CONTENT_TYPE, kind),
        (header::CONTENT_ENCODING, "gzip"),
        (header::CACHE_CONTROL, "no-cache"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
    ];
    (headers, policy, gzip).into_response()
}

async fn urdf(State(shared): State<Arc<Shared>>) -> Response {
    ([(header::CONTENT_TYPE, "application/xml")], shared.urdf.clone()).into_response()
}

async fn scraped(State(shared): State<Arc<Shared>>) -> Response {
    let text = shared.metrics.lock().unwrap_or_else(PoisonError::into_inner).clone();
    ([(header::CONTENT_TYPE, metrics::CONTENT_TYPE)], text).into_response()
}
