//! Browsers' connections: how many, and for how long each may ask for files.

use std::io;
use std::pin::pin;
use std::sync::Arc;

use axum::Router;
use clock::Duration;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::time::{sleep, timeout};

use super::Patience;

/// Connections at once on which files are asked for; further ones wait until one ends. A page's own is
/// counted among the pages.
const CONNECTIONS_MOST: usize = 64;
/// How long nothing is accepted where the system has no room for another connection.
const NO_ROOM: Duration = Duration::from_millis(100);

/// Serves whoever comes, for as long as it is waited for.
pub(super) async fn serve(listener: TcpListener, routes: Router, patience: Patience) {
    let places = Arc::new(Semaphore::new(CONNECTIONS_MOST));
    while let Ok(place) = Arc::clone(&places).acquire_owned().await {
        match listener.accept().await {
            Ok((stream, _from)) => {
                let routes = routes.clone();
                tokio::spawn(async move {
                    answer(stream, routes, patience).await;
                    drop(place);
                });
            }
            // Who came has gone again.
            Err(error) if error.kind() == io::ErrorKind::ConnectionAborted => {}
            Err(error) => {
                tracing::debug!(%error, "no connection is accepted for a moment");
                sleep(NO_ROOM).await;
            }
        }
    }
}

/// Answers what is asked on a connection until it ends, becomes a page's, or has lasted long enough: who
/// keeps one open without asking, asks letter by letter or does not read keeps nobody else out for long.
async fn answer(stream: TcpStream, routes: Router, patience: Patience) {
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(patience.question);
    let connection =
        http.serve_connection(TokioIo::new(stream), TowerToHyperService::new(routes)).with_upgrades();
    let mut connection = pin!(connection);
    // What became of it is the browser's own affair.
    if timeout(patience.connection, connection.as_mut()).await.is_err() {
        connection.as_mut().graceful_shutdown();
        let _ended = timeout(patience.send, connection).await;
    }
}
