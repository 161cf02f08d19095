//! One page: what it says, and what it is shown.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use axum::extract::State;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use clock::{Duration, Instant};
use message::{TeacherAct, TeacherActKind};
use serde_json::json;
use tokio::sync::mpsc;
use tokio::time::{MissedTickBehavior, interval};

use super::{Asked, PAGES_MOST, Shared};
use crate::requests::{Malformed, Wish, parse};

/// The largest message of a page, in bytes.
const MESSAGE_MOST: usize = 4096;
/// What a page is shown, it is shown this often at most.
const SHOWS: Duration = Duration::from_millis(33);
/// Messages of a page that are taken within a second.
const SECOND_MOST: u32 = 60;
/// Answers that wait for a page; a page that does not read them is shut.
const ANSWERS: usize = 128;

/// Opens the WebSocket of a page.
pub(super) async fn live(State(shared): State<Arc<Shared>>, upgrade: WebSocketUpgrade) -> Response {
    if shared.counts.open.load(Ordering::Relaxed) >= PAGES_MOST {
        let why = format!("{PAGES_MOST} pages are open, which is all there may be\n");
        return (StatusCode::SERVICE_UNAVAILABLE, why).into_response();
    }
    let upgrade = upgrade.max_message_size(MESSAGE_MOST).max_frame_size(MESSAGE_MOST);
    upgrade.on_upgrade(move |socket| async move {
        shared.counts.open.fetch_add(1, Ordering::Relaxed);
        let number = shared.pages.fetch_add(1, Ordering::Relaxed);
        let (answer, answers) = mpsc::channel(ANSWERS);
        let page = Page {
            shared: &shared,
            socket,
            // Hands are told apart as long as fewer pages than this are open, which is so.
            hand: u16::try_from(number % u64::from(u16::MAX)).unwrap_or(0),
            version: 0,
            answer,
            second: clock::now(),
            heard: 0,
        };
        page.live(answers).await;
        shared.counts.open.fetch_sub(1, Ordering::Relaxed);
    })
}

struct Page<'a> {
    shared: &'a Shared,
    socket: WebSocket,
    hand: u16,
    /// The version of the sheet that it was shown.
    version: u64,
    answer: mpsc::Sender<String>,
    /// When the present second began, and what was heard in it.
    second: Instant,
    heard: u32,
}

impl Page<'_> {
    async fn live(mut self, mut answers: mpsc::Receiver<String>) {
        let mut shows = interval(SHOWS);
        shows.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            let message = tokio::select! {
                message = self.socket.recv() => match message {
                    Some(Ok(Message::Text(text))) => self.hear(&text),
                    Some(Ok(Message::Binary(_))) => Some(self.malformed(&Malformed {
                        id: None,
                        reason: "a message is JSON text".to_owned(),
                    })),
                    Some(Ok(Message::Ping(_) | Message::Pong(_))) => None,
                    Some(Ok(Message::Close(_)) | Err(_)) | None => break,
                },
                answer = answers.recv() => answer,
                _ = shows.tick() => self.shown(),
            };
            // A page that does not read slows this task down, and nobody else: meanwhile what it is
            // shown next grows no longer, only newer.
            if let Some(message) = message
                && self.socket.send(Message::text(message)).await.is_err()
            {
                break;
            }
        }
        // What its hand holds goes back to where it was.
        let cancel = TeacherAct::new(TeacherActKind::Cancel, self.shared.first);
        self.ask(None, Wish::Act(Box::new(cancel)));
    }

    fn shown(&mut self) -> Option<String> {
        let sheet = self.shared.sheet();
        let message = sheet.since(self.version);
        self.version = sheet.version();
        message
    }

    /// What a message is answered with at once, if anything.
    fn hear(&mut self, text: &str) -> Option<String> {
        let now = clock::now();
        if now.since(self.second) >= Duration::from_secs(1) {
            (self.second, self.heard) = (now, 0);
        }
        self.heard += 1;
        match parse(text, self.shared.first) {
            Err(malformed) => Some(self.malformed(&malformed)),
            Ok((id, _)) if self.heard > SECOND_MOST => {
                let reason = format!("more than {SECOND_MOST} messages in a second: say less");
                Some(self.malformed(&Malformed { id: Some(id), reason }))
            }
            Ok((id, wish)) => {
                let busy = "the robot is busy: say it again";
                (!self.ask(Some(id), wish)).then(|| json!({ "answer": id, "error": busy }).to_string())
            }
        }
    }

    fn malformed(&self, malformed: &Malformed) -> String {
        self.shared.counts.malformed.fetch_add(1, Ordering::Relaxed);
        json!({ "answer": malformed.id, "error": malformed.reason }).to_string()
    }

    fn ask(&self, id: Option<u64>, wish: Wish) -> bool {
        let asked = Asked { page: self.hand, id, wish, answer: self.answer.clone() };
        self.shared.wishes.try_send(asked).is_ok()
    }
}
