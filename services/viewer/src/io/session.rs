//! The connection of one viewer.

use std::convert::Infallible;
use std::sync::Arc;

use clock::Duration;
use futures_util::{SinkExt as _, StreamExt as _};
use tokio::net::TcpStream;
use tokio::sync::watch;
use tokio::time::{MissedTickBehavior, interval, timeout};
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::handshake::server::{Request, Response};
use tokio_tungstenite::tungstenite::http::HeaderValue;
use tokio_tungstenite::tungstenite::http::header::SEC_WEBSOCKET_PROTOCOL;
use tokio_tungstenite::tungstenite::protocol::frame::coding::CloseCode;
use tokio_tungstenite::tungstenite::protocol::{CloseFrame, WebSocketConfig};
use tokio_tungstenite::tungstenite::{Error, Message};

use super::handshake::{HandshakeError, admit};
use super::shared::{Shared, stopped};
use crate::{ClientId, Outgoing};

/// Maximum size of a client's message, in bytes: a subscription of a thousand channels.
const MAX_MESSAGE_BYTES: usize = 64 << 10;
/// Time-out of the first request of a connection.
const HANDSHAKE_TIMEOUT: Duration = Duration::from_secs(5);
/// Time-out of one message: a client that takes none is disconnected.
const SEND_TIMEOUT: Duration = Duration::from_secs(10);
/// Time-out of the farewell to a client, and of its answer.
const CLOSE_TIMEOUT: Duration = Duration::from_secs(1);
/// Interval of the pings, which every WebSocket answers.
const PING_INTERVAL: Duration = Duration::from_secs(5);
/// Maximum number of consecutive unanswered pings.
const MAX_UNANSWERED_PINGS: u32 = 4;

/// Why a session ends.
#[derive(Debug)]
enum End {
    /// The client closed the connection, or neither reads nor answers.
    Left,
    /// The client violated the protocol.
    Wrong(CloseCode, String),
    /// The server ends.
    Stopped,
}

/// Serves a connection until it ends, or until `stop` is set.
pub(super) async fn serve(stream: TcpStream, shared: Arc<Shared>, mut stop: watch::Receiver<bool>) {
    // Without it, small messages would wait for the acknowledgement of earlier ones.
    let _slower = stream.set_nodelay(true);
    let config = WebSocketConfig::default()
        .max_message_size(Some(MAX_MESSAGE_BYTES))
        .max_frame_size(Some(MAX_MESSAGE_BYTES));
    let mut joined = None;
    #[expect(clippy::result_large_err, reason = "the library wants a whole response")]
    let negotiate = |request: &Request, mut response: Response| {
        let (client, spoken) = admit(request, &shared).map_err(HandshakeError::response)?;
        joined = Some(client);
        response.headers_mut().insert(SEC_WEBSOCKET_PROTOCOL, HeaderValue::from_static(spoken));
        Ok(response)
    };
    let handshake = tokio_tungstenite::accept_hdr_async_with_config(stream, negotiate, Some(config));
    let shaken = tokio::select! {
        shaken = timeout(HANDSHAKE_TIMEOUT, handshake) => shaken.ok().and_then(Result::ok),
        () = stopped(&mut stop) => None,
    };
    let Some(client) = joined else { return };
    if let Some(socket) = shaken {
        let mut session = Session { socket, client, shared: &shared, unanswered: 0 };
        let Err(end) = session.run(&mut stop).await;
        session.close(end).await;
    }
    shared.hub().leave(client);
}

struct Session<'a> {
    socket: WebSocketStream<TcpStream>,
    client: ClientId,
    shared: &'a Shared,
    /// Pings since the last message of the client.
    unanswered: u32,
}

impl Session<'_> {
    async fn run(&mut self, stop: &mut watch::Receiver<bool>) -> Result<Infallible, End> {
        let mut news = self.shared.news();
        let mut pings = interval(PING_INTERVAL);
        pings.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            let must_take = self.shared.hub().must_take(self.client);
            // The branches take turns at random, so a stream of messages keeps no request waiting.
            tokio::select! {
                () = stopped(stop) => return Err(End::Stopped),
                message = self.socket.next(), if !must_take => self.hear(message)?,
                outgoing = next(self.shared, self.client, &mut news) => {
                    self.send(match outgoing {
                        Outgoing::Text(text) => Message::text(text),
                        Outgoing::Binary(bytes) => Message::binary(bytes),
                    }).await?;
                }
                _ = pings.tick() => {
                    if self.unanswered >= MAX_UNANSWERED_PINGS {
                        return Err(End::Left);
                    }
                    self.unanswered += 1;
                    self.send(Message::Ping(Vec::new().into())).await?;
                }
            }
        }
    }

    /// Sends a message. It waits for the network, not for the client's queue, so the memory of a slow client is bounded.
    async fn send(&mut self, message: Message) -> Result<(), End> {
        match timeout(SEND_TIMEOUT, self.socket.send(message)).await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_)) | Err(_) => Err(End::Left),
        }
    }

    fn hear(&mut self, message: Option<Result<Message, Error>>) -> Result<(), End> {
        self.unanswered = 0;
        match message {
            Some(Ok(Message::Text(text))) => self.shared.hub().hear(self.client, &text),
            Some(Ok(Message::Binary(_))) => self.shared.hub().hear_unsupported(self.client),
            Some(Ok(Message::Ping(_) | Message::Pong(_) | Message::Frame(_))) => {}
            Some(Ok(Message::Close(_))) | None => return Err(End::Left),
            Some(Err(Error::Capacity(_))) => {
                let reason = format!("a message has at most {MAX_MESSAGE_BYTES} bytes");
                return Err(End::Wrong(CloseCode::Size, reason));
            }
            Some(Err(Error::Protocol(error))) => {
                return Err(End::Wrong(CloseCode::Protocol, error.to_string()));
            }
            Some(Err(_)) => return Err(End::Left),
        }
        Ok(())
    }

    async fn close(&mut self, end: End) {
        let (code, reason) = match end {
            End::Left => return,
            End::Wrong(code, reason) => (code, reason),
            End::Stopped => (CloseCode::Away, "leo view ends".to_owned()),
        };
        let frame = CloseFrame { code, reason: reason.into() };
        // A connection that is closed with unread messages of the client would discard the farewell. A client that does
        // not take it learns the end from the connection.
        let farewell = async {
            if self.socket.close(Some(frame)).await.is_ok() {
                while let Some(Ok(_unread)) = self.socket.next().await {}
            }
        };
        let _closed = timeout(CLOSE_TIMEOUT, farewell).await;
    }
}

/// Waits for the next message for a client.
async fn next(shared: &Shared, client: ClientId, news: &mut watch::Receiver<()>) -> Outgoing {
    loop {
        if let Some(outgoing) = shared.hub().next(client) {
            return outgoing;
        }
        if news.changed().await.is_err() {
            // The sender lives as long as the hub, which `shared` borrows.
            std::future::pending::<()>().await;
        }
    }
}
