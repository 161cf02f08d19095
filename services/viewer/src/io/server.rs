//! The server of the viewers, in a thread of its own.

use std::io;
use std::net::TcpListener as Socket;
use std::sync::Arc;
use std::thread::JoinHandle;

use clock::Duration;
use tokio::net::TcpListener;
use tokio::sync::watch;
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};

use super::listener::Listener;
use super::session;
use super::shared::{Shared, stopped};

/// Maximum number of connections, those included that are not yet viewers.
const MAX_CONNECTIONS: usize = 64;
/// Pause after a failed accept, for example when file descriptors are exhausted.
const ACCEPT_RETRY: Duration = Duration::from_millis(100);
/// Time-out for the sessions to end.
const END_TIMEOUT: Duration = Duration::from_millis(1500);

/// A running server. Dropping it ends it.
#[derive(Debug)]
pub(super) struct Server {
    stop: watch::Sender<bool>,
    thread: Option<JoinHandle<io::Result<()>>>,
}

impl Server {
    /// Starts to serve a hub.
    ///
    /// # Errors
    ///
    /// The thread could not be started.
    pub(super) fn start(listener: Listener, shared: Arc<Shared>) -> io::Result<Self> {
        let (stop, stopped) = watch::channel(false);
        let runtime = tokio::runtime::Builder::new_current_thread().enable_io().enable_time().build()?;
        let socket = listener.into_socket();
        let thread = std::thread::Builder::new()
            .name("viewer-server".to_owned())
            .spawn(move || runtime.block_on(serve(socket, shared, stopped)))?;
        Ok(Self { stop, thread: Some(thread) })
    }

    /// Whether it ended by itself. [`Self::stop`] returns the cause.
    pub(super) fn has_ended(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Says farewell to the viewers and ends.
    ///
    /// # Errors
    ///
    /// The server ended before, because of an error.
    pub(super) fn stop(mut self) -> io::Result<()> {
        self.end()
    }

    fn end(&mut self) -> io::Result<()> {
        self.stop.send_replace(true);
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(outcome)) => outcome,
            Some(Err(_panicked)) => Err(io::Error::other("the thread of the server panicked")),
            None => Ok(()),
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        if let Err(error) = self.end() {
            tracing::warn!(%error, "the viewers were not served any more");
        }
    }
}

async fn serve(socket: Socket, shared: Arc<Shared>, mut stop: watch::Receiver<bool>) -> io::Result<()> {
    let listener = TcpListener::from_std(socket)?;
    let mut sessions = JoinSet::new();
    loop {
        tokio::select! {
            () = stopped(&mut stop) => break,
            Some(_ended) = sessions.join_next() => {}
            accepted = listener.accept(), if sessions.len() < MAX_CONNECTIONS => match accepted {
                Ok((stream, _from)) => {
                    sessions.spawn(session::serve(stream, Arc::clone(&shared), stop.clone()));
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
    drop(listener);
    let ended = async { while sessions.join_next().await.is_some() {} };
    // Sessions that do not end by then are aborted with the runtime.
    let _late = timeout(END_TIMEOUT, ended).await;
    Ok(())
}
