//! One page: what it says, and what it is shown.

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

use super::pace::{Pace, SECOND_MOST, Taken};
use super::{Access, Asked, PAGES_MOST, Place, READERS_MAX, Shared};
use crate::requests::{Malformed, Wish, number, parse};
use crate::sheet::Sheet;

/// The largest message of a page, in bytes.
const MESSAGE_MOST: usize = 4096;
/// What a page without the token is answered.
const READ_ONLY: &str =
    "this page may look and stop the robot, and nothing else: open the whole address that `leo run` prints";
/// What a page is shown, it is shown this often at most.
const SHOWS: Duration = Duration::from_millis(33);
/// Beats that a page may leave unanswered, one after the other.
const UNANSWERED_MOST: u32 = 6;
/// Answers that wait while something is on its way to a page; further ones are lost.
const ANSWERS: usize = 128;

/// How long pages are waited for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patience {
    /// It is asked this often whether a page is there, which its browser answers; and a page hears this
    /// often that Leo is.
    pub(crate) beat: Duration,
    /// A page that takes longer for what is sent to it does not read, and is shut.
    pub(crate) send: Duration,
    /// A connection on which the head of a request takes longer than this is shut, and one that is not used for so long.
    pub(crate) question: Duration,
    /// A connection on which files are asked for ends after so long; browsers open another one.
    pub(crate) connection: Duration,
}

impl Default for Patience {
    fn default() -> Self {
        Self {
            beat: Duration::from_secs(1),
            send: Duration::from_secs(5),
            question: Duration::from_secs(1),
            connection: Duration::from_secs(60),
        }
    }
}

/// Why a page is no longer served.
#[derive(Debug)]
enum End {
    /// It has left, or does not answer or read.
    Left,
    /// It said what it may not, and is told so as it is shut: a code of the protocol, and the reason.
    Shut(u16, String),
}

/// Opens the WebSocket of a page.
pub(super) async fn live(
    State(shared): State<Arc<Shared>>,
    Extension(access): Extension<Access>,
    upgrade: WebSocketUpgrade,
) -> Response {
    // It is taken before anybody else asks, and free again wherever the page ends.
    let Some(place) = Place::take(&shared, access) else {
        let (most, which) = match access {
            Access::Command => (PAGES_MOST, ""),
            Access::Read => (READERS_MAX, " without the token"),
        };
        let why = format!("{most} pages{which} are open, which is all there may be\n");
        return (StatusCode::SERVICE_UNAVAILABLE, why).into_response();
    };
    let upgrade = upgrade.max_message_size(MESSAGE_MOST).max_frame_size(MESSAGE_MOST);
    upgrade.on_upgrade(move |socket| async move {
        let shared = &place.shared;
        let number = shared.pages.fetch_add(1, Ordering::Relaxed);
        let (answer, answers) = mpsc::channel(ANSWERS);
        let page = Page {
            shared,
            socket,
            access,
            // Hands are told apart as long as fewer pages than this are open, which is so.
            hand: u16::try_from(number % u64::from(u16::MAX)).unwrap_or(0),
            version: 0,
            answer,
            pace: Pace::default(),
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
    /// The version of the sheet that it was shown.
    version: u64,
    answer: mpsc::Sender<String>,
    pace: Pace,
    /// Beats since anything was heard.
    unanswered: u32,
    /// Whether nothing was sent since the last beat.
    is_quiet: bool,
}

impl Page<'_> {
    async fn live(mut self, answers: mpsc::Receiver<String>) {
        let Err(end) = self.talk(answers).await;
        if self.access == Access::Command {
            self.let_go();
        }
        if let End::Shut(code, reason) = end {
            let close = Message::Close(Some(CloseFrame { code, reason: reason.into() }));
            // Whether it is heard is its own affair.
            let _told = self.send(close).await;
        }
    }

    /// What its hand holds goes back to where it was.
    fn let_go(&self) {
        let cancel = TeacherAct::new(TeacherActKind::Cancel, self.shared.first);
        self.shared.ask_last(Asked {
            page: self.hand,
            id: None,
            wish: Wish::Act(Box::new(cancel)),
            answer: self.answer.clone(),
        });
    }

    async fn talk(&mut self, mut answers: mpsc::Receiver<String>) -> Result<Infallible, End> {
        let mut shows = interval(SHOWS);
        shows.set_missed_tick_behavior(MissedTickBehavior::Delay);
        // The first thing that a page hears is what there is.
        let beat = self.shared.patience.beat;
        let mut beats = interval(beat);
        beats.reset();
        beats.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            let said = tokio::select! {
                message = self.socket.recv() => self.hear(message)?,
                answer = answers.recv() => answer,
                _ = shows.tick() => self.shown(),
                _ = beats.tick() => self.beat().await?,
            };
            // A page that reads slowly slows this task down, and nobody else: meanwhile what it is
            // shown next grows no longer, only newer.
            if let Some(said) = said {
                self.is_quiet = false;
                self.send(Message::text(said)).await?;
            }
        }
    }

    /// Sends something to a page that reads.
    async fn send(&mut self, message: Message) -> Result<(), End> {
        match timeout(self.shared.patience.send, self.socket.send(message)).await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_)) | Err(_) => Err(End::Left),
        }
    }

    /// Asks whether the page is there. One that was sent nothing else is told that Leo is.
    async fn beat(&mut self) -> Result<Option<String>, End> {
        if self.unanswered >= UNANSWERED_MOST {
            return Err(End::Left);
        }
        self.unanswered += 1;
        self.send(Message::Ping(axum::body::Bytes::new())).await?;
        let is_quiet = std::mem::replace(&mut self.is_quiet, true);
        Ok(is_quiet.then(|| Sheet::nothing_since(self.version)))
    }

    fn shown(&mut self) -> Option<String> {
        let sheet = self.shared.sheet();
        let message = sheet.since(self.version);
        self.version = sheet.version();
        message
    }

    /// What is answered at once, if anything.
    fn hear(&mut self, message: Option<Result<Message, axum::Error>>) -> Result<Option<String>, End> {
        let message = match message {
            Some(Ok(message)) => message,
            Some(Err(error)) => return Err(self.broken(error)),
            None => return Err(End::Left),
        };
        self.unanswered = 0;
        let taken = self.pace.hear(clock::now());
        if taken == Taken::Flood {
            self.count();
            return Err(End::Shut(close_code::POLICY, "far too many messages in a second".to_owned()));
        }
        let too_many =
            |id| Malformed { id, reason: format!("more than {SECOND_MOST} messages in a second: say less") };
        match message {
            Message::Text(text) if taken == Taken::TooMany => {
                Ok(Some(self.malformed(&too_many(number(&text)))))
            }
            Message::Binary(_) if taken == Taken::TooMany => Ok(Some(self.malformed(&too_many(None)))),
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
            Ok((id, wish)) => {
                let asked = Asked { page: self.hand, id: Some(id), wish, answer: self.answer.clone() };
                let busy = "the robot is busy: say it again";
                (!self.shared.ask(asked)).then(|| json!({ "answer": id, "error": busy }).to_string())
            }
        }
    }

    /// What becomes of a page whose messages cannot be read any further.
    fn broken(&self, error: axum::Error) -> End {
        use tungstenite::error::ProtocolError::ResetWithoutClosingHandshake;
        let Ok(error) = error.into_inner().downcast::<tungstenite::Error>() else { return End::Left };
        let (code, reason) = if matches!(*error, tungstenite::Error::Capacity(_)) {
            (close_code::SIZE, format!("a message has at most {MESSAGE_MOST} bytes"))
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
