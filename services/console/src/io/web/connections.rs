//! HTTP connections: their number, their time-outs, and the eviction of old ones.

mod table;

use std::io;
use std::pin::pin;
use std::sync::Arc;

use axum::Router;
use clock::Duration;
use hyper::server::conn::http1;
use hyper::service::{Service as _, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpListener;
use tokio::time::{sleep, timeout};

use super::{Shared, Timeouts};
pub(super) use table::{Class, Connection, Table};

/// Pause after a failed accept, for example when file descriptors are exhausted.
const ACCEPT_RETRY: Duration = Duration::from_millis(100);
/// Size of the read buffer of a connection. Longer request heads are refused (431).
const MAX_HEAD_BYTES: usize = 16 << 10;
/// Maximum number of header fields of a request.
const MAX_HEADER_FIELDS: usize = 64;

/// Accepts and serves connections for as long as it is polled. At a limit an old connection is evicted; accepting
/// pauses until that one has reached its minimum age.
pub(super) async fn serve(listener: TcpListener, routes: Router, shared: Arc<Shared>) {
    let table = Arc::clone(&shared.connections);
    loop {
        match listener.accept().await {
            Ok((stream, from)) => {
                while let Some(wait) = table.wait_for_room(from.ip(), clock::now()) {
                    sleep(wait).await;
                }
                let connection = table.enter(from.ip(), clock::now());
                let (routes, timeouts) = (TowerToHyperService::new(routes.clone()), shared.timeouts);
                let served = tokio::spawn(answer(stream, routes, timeouts, Arc::clone(&connection)));
                connection.ends_with(served.abort_handle());
            }
            // The client closed the connection before it was accepted.
            Err(error) if error.kind() == io::ErrorKind::ConnectionAborted => {}
            Err(error) => {
                tracing::debug!(%error, "no connection is accepted for a moment");
                sleep(ACCEPT_RETRY).await;
            }
        }
    }
}

/// Serves one connection until it ends, is upgraded to a WebSocket, reaches its time-out, or is evicted.
pub(super) async fn answer(
    stream: impl AsyncRead + AsyncWrite + Send + Unpin + 'static,
    routes: TowerToHyperService<Router>,
    timeouts: Timeouts,
    connection: Arc<Connection>,
) {
    connection.begins(clock::now());
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(timeouts.request_head);
    http.max_buf_size(MAX_HEAD_BYTES).max_headers(MAX_HEADER_FIELDS);
    let service = service_fn(move |mut request: hyper::Request<hyper::body::Incoming>| {
        request.extensions_mut().insert(Arc::clone(&connection));
        routes.call(request)
    });
    let served = http.serve_connection(TokioIo::new(stream), service).with_upgrades();
    let mut served = pin!(served);
    // Errors of a connection concern only the browser.
    if timeout(timeouts.connection, served.as_mut()).await.is_err() {
        served.as_mut().graceful_shutdown();
        let _ended = timeout(timeouts.send, served).await;
    }
}
