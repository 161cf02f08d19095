//! The WebSocket session of one page.

use std::convert::Infallible;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use axum::Extension;
use axum::extract::State;
use axum::extract::ws::{CloseFrame, Message, WebSocket, WebSocketUpgrade, close_code};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use clock::Duration;
use message::{TeacherAct, TeacherActKind};
use serde_json::json;
use tokio::sync::mpsc;
use tokio::time::{MissedTickBehavior, interval, timeout};

use super::rate_limit::{MAX_MESSAGES_PER_SECOND, RateLimit, Verdict};
use super::{Access, MAX_PAGES, MAX_READERS, PageSlot, Shared};
use crate::io::requester::{QueuedRequest, Requester};
use crate::requests::{Malformed, PageRequest, number, parse};
use crate::state_store::StateStore;

/// Maximum size of a page's message, in bytes.
const MAX_MESSAGE_BYTES: usize = 4096;
/// The first message to a page without the token.
const READ_ACCESS: &str = r#"{"access":"read"}"#;
/// The answer to a command of a page without the token.
const READ_ONLY: &str =
    "this page may only watch and stop the robot: open the whole address that `leo run` prints";
/// Minimum interval between two state updates of a page.
const MIN_UPDATE_INTERVAL: Duration = Duration::from_millis(33);
/// Maximum number of consecutive unanswered pings.
const MAX_UNANSWERED_PINGS: u32 = 6;
/// Size of the answer queue of a page; further answers are dropped.
const ANSWER_QUEUE_SIZE: usize = 128;

/// Time-outs of the pages and connections.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Timeouts {
    /// Interval of the pings, which the browser answers, and of the heartbeat that tells the page that the server
    /// is alive.
    pub(crate) beat: Duration,
    /// Send time-out: a page that does not read is closed.
    pub(crate) send: Duration,
    /// Time-out of a request head, and of an idle keep-alive connection.
    pub(crate) request_head: Duration,
    /// Maximum lifetime of an HTTP connection; browsers open another one.
    pub(crate) connection: Duration,
}

impl Default for Timeouts {
    fn default() -> Self {
        Self {
            beat: Duration::from_secs(1),
            send: Duration::from_secs(5),
            request_head: Duration::from_secs(1),
            connection: Duration::from_secs(60),
        }
    }
}

/// Why a session ends.
#[derive(Debug)]
enum End {
    /// The page closed, or does not answer or read.
    Left,
    /// A protocol violation; the close frame contains a WebSocket close code and the reason.
    Shut(u16, String),
}

/// Opens the WebSocket of a page.
pub(super) async fn live(
    State(shared): State<Arc<Shared>>,
    Extension(access): Extension<Access>,
    upgrade: WebSocketUpgrade,
) -> Response {
    // The slot is taken before the next request is handled, and is freed whenever the session ends.
    let Some(slot) = PageSlot::take(&shared, access) else {
        let (max, which) = match access {
            Access::Command => (MAX_PAGES, ""),
            Access::Read => (MAX_READERS, " without the token"),
        };
        let why = format!("{max} pages{which} are open, which is the maximum\n");
        return (StatusCode::SERVICE_UNAVAILABLE, why).into_response();
    };
    let upgrade = upgrade.max_message_size(MAX_MESSAGE_BYTES).max_frame_size(MAX_MESSAGE_BYTES);
    upgrade.on_upgrade(move |socket| async move {
        let shared = &slot.shared;
        let number = shared.pages.fetch_add(1, Ordering::Relaxed);
        let (answer, answers) = mpsc::channel(ANSWER_QUEUE_SIZE);
        let page = Page {
            shared,
            socket,
            access,
            // Hand numbers are unique because fewer than 65535 pages are open at once.
            hand: u16::try_from(number % u64::from(u16::MAX)).unwrap_or(0),
            version: 0,
            answer,
            rate_limit: RateLimit::default(),
            unanswered: 0,
            is_quiet: true,
        };
        page.live(answers).await;
    })
}

struct Page<'a> {
    shared: &'a Shared,
    socket: WebSocket,
    access: Access,
    hand: u16,
    /// The version of the state that the page has.
    version: u64,
    answer: mpsc::Sender<String>,
    rate_limit: RateLimit,
    /// Pings since the last message of the page.
    unanswered: u32,
    /// Whether nothing was sent since the last ping.
    is_quiet: bool,
}

impl Page<'_> {
    async fn live(mut self, answers: mpsc::Receiver<String>) {
        let Err(end) = self.run_session(answers).await;
        if self.access == Access::Command {
            self.release();
        }
        if let End::Shut(code, reason) = end {
            let close = Message::Close(Some(CloseFrame { code, reason: reason.into() }));
            // A failed close frame does not matter.
            let _sent = self.send(close).await;
        }
    }

    /// Cancels the act of the page's hand: what it holds goes back.
    fn release(&self) {
        let cancel = TeacherAct::new(TeacherActKind::Cancel, self.shared.first);
        self.shared.ask_unbounded(self.request(None, PageRequest::Act(Box::new(cancel))));
    }

    fn request(&self, id: Option<u64>, page_request: PageRequest) -> QueuedRequest {
        let requester = Requester { page: self.answer.clone(), id };
        QueuedRequest { page: self.hand, page_request, requester }
    }

    async fn run_session(&mut self, mut answers: mpsc::Receiver<String>) -> Result<Infallible, End> {
        if self.access == Access::Read {
            self.send(Message::text(READ_ACCESS)).await?;
        }
        let mut shows = interval(MIN_UPDATE_INTERVAL);
        shows.set_missed_tick_behavior(MissedTickBehavior::Delay);
        // The first message is the full state, so the first heartbeat comes one interval later.
        let beat = self.shared.timeouts.beat;
        let mut beats = interval(beat);
        beats.reset();
        beats.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            let text = tokio::select! {
                message = self.socket.recv() => self.hear(message)?,
                answer = answers.recv() => answer,
                _ = shows.tick() => self.shown(),
                _ = beats.tick() => self.beat().await?,
            };
            // A slow reader delays only this task. Updates are deltas to the newest state, so no backlog builds up.
            if let Some(text) = text {
                self.is_quiet = false;
                self.send(Message::text(text)).await?;
            }
        }
    }

    /// Sends a message, with a time-out.
    async fn send(&mut self, message: Message) -> Result<(), End> {
        match timeout(self.shared.timeouts.send, self.socket.send(message)).await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_)) | Err(_) => Err(End::Left),
        }
    }

    /// Pings the page. If nothing else was sent since the last ping, also returns a heartbeat message.
    async fn beat(&mut self) -> Result<Option<String>, End> {
        if self.unanswered >= MAX_UNANSWERED_PINGS {
            return Err(End::Left);
        }
        self.unanswered += 1;
        self.send(Message::Ping(axum::body::Bytes::new())).await?;
        let is_quiet = std::mem::replace(&mut self.is_quiet, true);
        Ok(is_quiet.then(|| StateStore::empty_delta(self.version)))
    }

    fn shown(&mut self) -> Option<String> {
        let state_store = self.shared.state_store();
        let message = state_store.since(self.version);
        self.version = state_store.version();
        message
    }

    /// Handles a message and returns the immediate answer, if any.
    fn hear(&mut self, message: Option<Result<Message, axum::Error>>) -> Result<Option<String>, End> {
        let message = match message {
            Some(Ok(message)) => message,
            Some(Err(error)) => return Err(self.broken(error)),
            None => return Err(End::Left),
        };
        self.unanswered = 0;
        let taken = self.rate_limit.hear(clock::now());
        if taken == Verdict::Flood {
            self.count();
            return Err(End::Shut(close_code::POLICY, "far too many messages in a second".to_owned()));
        }
        let too_many = |id| Malformed {
            id,
            reason: format!("more than {MAX_MESSAGES_PER_SECOND} messages in a second: send fewer"),
        };
        match message {
            Message::Text(text) if taken == Verdict::TooMany => {
                Ok(Some(self.malformed(&too_many(number(&text)))))
            }
            Message::Binary(_) if taken == Verdict::TooMany => Ok(Some(self.malformed(&too_many(None)))),
            Message::Text(text) => Ok(self.say(&text)),
            Message::Binary(_) => {
                let reason = "a message is JSON text".to_owned();
                Ok(Some(self.malformed(&Malformed { id: None, reason })))
            }
            Message::Ping(_) | Message::Pong(_) => Ok(None),
            Message::Close(_) => Err(End::Left),
        }
    }

    fn say(&self, text: &str) -> Option<String> {
        match parse(text, self.shared.first) {
            Err(malformed) => Some(self.malformed(&malformed)),
            Ok((id, _)) if self.access == Access::Read => {
                self.count();
                Some(json!({ "answer": id, "error": READ_ONLY }).to_string())
            }
            Ok((id, page_request)) => {
                let asked = self.request(Some(id), page_request);
                let busy = "the robot is busy: try again";
                (!self.shared.ask(asked)).then(|| json!({ "answer": id, "error": busy }).to_string())
            }
        }
    }

    /// Maps a WebSocket error to the end of the session.
    fn broken(&self, error: axum::Error) -> End {
        use tungstenite::error::ProtocolError::ResetWithoutClosingHandshake;
        let Ok(error) = error.into_inner().downcast::<tungstenite::Error>() else { return End::Left };
        let (code, reason) = if matches!(*error, tungstenite::Error::Capacity(_)) {
            (close_code::SIZE, format!("a message has at most {MAX_MESSAGE_BYTES} bytes"))
        } else if matches!(*error, tungstenite::Error::Utf8(_)) {
            (close_code::INVALID, "a message is JSON text".to_owned())
        } else if matches!(&*error, tungstenite::Error::Protocol(what) if *what != ResetWithoutClosingHandshake)
        {
            (close_code::PROTOCOL, error.to_string())
        } else {
            return End::Left;
        };
        self.count();
        End::Shut(code, reason)
    }

    fn malformed(&self, malformed: &Malformed) -> String {
        self.count();
        json!({ "answer": malformed.id, "error": malformed.reason }).to_string()
    }

    fn count(&self) {
        self.shared.counts.malformed.fetch_add(1, Ordering::Relaxed);
    }
}
