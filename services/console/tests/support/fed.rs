//! The page's server without a network, for tests and the fuzz target: takes a browser's input as bytes.

use std::net::{IpAddr, Ipv4Addr};
use std::path::PathBuf;
use std::sync::Arc;

use clock::Duration;
use config::leo::ReadWithoutToken;
use crossbeam::channel::Receiver;
use hyper_util::service::TowerToHyperService;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::time::timeout;

use super::guard::AccessPolicy;
use super::stop::Stop;
use super::{Shared, Timeouts, Token, connections, routes};
use crate::io::requester::QueuedRequest;

/// The token of the test server.
const TOKEN: &str = "00112233445566778899aabbccddeeff";
/// Content that requires the token.
const SECRET: &str = "what needs the token";
/// Maximum size of an answer; more than the whole page.
const MAX_ANSWER_BYTES: u64 = 1 << 20;
/// An idle connection must be closed within this time. The paused clock advances it at once.
const CLOSE_TIMEOUT: Duration = Duration::from_secs(120);
/// The request head that opens a page's WebSocket.
const UPGRADE: &str = "GET /live HTTP/1.1\r\nHost: 127.0.0.1:7780\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
                       Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";

/// A test server that scripts are played to.
pub struct FedPage {
    runtime: tokio::runtime::Runtime,
    shared: Arc<Shared>,
    pending_requests: Receiver<QueuedRequest>,
}

/// The result of a script.
#[derive(Debug)]
pub struct Fed {
    /// The bytes of the answer.
    pub answer: Vec<u8>,
    /// Number of requests passed to the robot.
    pub pending_requests: usize,
}

impl FedPage {
    /// A server whose content requires the token.
    ///
    /// # Errors
    ///
    /// The async runtime cannot be created.
    pub fn new() -> std::io::Result<Self> {
        let token = Token::read(TOKEN).ok_or(std::io::ErrorKind::InvalidInput)?;
        let policy = AccessPolicy { token, port: 7780, open: ReadWithoutToken::Nothing };
        // There is no motor process, so a stop has no effect.
        let stop = Stop::new(PathBuf::new(), false);
        // A short heartbeat closes silent pages soon.
        let timeouts = Timeouts { beat: Duration::from_millis(50), ..Timeouts::default() };
        let (shared, pending_requests) = Shared::new(SECRET.to_owned(), 1, policy, stop, timeouts);
        shared.set_metrics(SECRET.to_owned());
        shared.state_store().put("secret", &SECRET);
        let runtime =
            tokio::runtime::Builder::new_current_thread().enable_all().start_paused(true).build()?;
        Ok(Self { runtime, shared, pending_requests })
    }

    /// Plays a script: its first byte selects the kind of connection, the others are sent on it.
    ///
    /// # Panics
    ///
    /// Content was shown or a request executed without the token, or a connection was not closed.
    pub fn play(&self, script: &[u8]) -> Fed {
        let (kind, rest) = script.split_first().map_or((0, script), |(kind, rest)| (kind % 4, rest));
        let known = format!("{UPGRADE}Authorization: Bearer {TOKEN}\r\n\r\n");
        let bytes = match kind {
            0 => rest.to_vec(),
            1 => [UPGRADE.as_bytes(), rest, b"\r\n\r\n"].concat(),
            2 => [known.as_bytes(), rest].concat(),
            _ => {
                let messages = rest.split(|byte| *byte == b'\n').flat_map(frame);
                known.bytes().chain(messages).collect()
            }
        };
        let fed = self.feed(&bytes);
        let holds = |text: &[u8], what: &str| text.windows(what.len()).any(|some| some == what.as_bytes());
        let is_known = holds(&bytes, TOKEN);
        assert!(is_known || fed.pending_requests == 0, "something is done without the token");
        assert!(is_known || !holds(&fed.answer, SECRET), "something is shown without the token");
        assert_eq!(
            self.shared.counts.open.load(std::sync::atomic::Ordering::Relaxed),
            0,
            "a page stays open"
        );
        fed
    }

    /// Sends bytes on a connection, and nothing after them.
    fn feed(&self, bytes: &[u8]) -> Fed {
        let shared = &self.shared;
        let answer = self.runtime.block_on(async {
            let (server, client) = tokio::io::duplex(64 << 10);
            let connection = shared.connections.enter(IpAddr::V4(Ipv4Addr::LOCALHOST), clock::now());
            let routes = TowerToHyperService::new(routes(shared));
            let served = tokio::spawn(connections::answer(server, routes, shared.timeouts, connection));
            let (reads, mut writes) = tokio::io::split(client);
            let mut answer = Vec::new();
            let talk = async {
                let says = async {
                    // The server may close the connection before all is sent.
                    let _said = writes.write_all(bytes).await;
                };
                let hears = async {
                    let _heard = reads.take(MAX_ANSWER_BYTES).read_to_end(&mut answer).await;
                };
                tokio::join!(says, hears);
                served.await
            };
            let talked = timeout(CLOSE_TIMEOUT, talk).await;
            assert!(matches!(talked, Ok(Ok(()))), "it panicked, or is not shut: {talked:?}");
            answer
        });
        Fed { answer, pending_requests: self.pending_requests.try_iter().count() }
    }
}

/// A text as a WebSocket frame of a client.
fn frame(text: &[u8]) -> Vec<u8> {
    let length = text.len();
    let head = match (u8::try_from(length), u16::try_from(length)) {
        (Ok(short), _) if short < 126 => vec![0x81, 0x80 | short],
        (_, Ok(medium)) => [&[0x81, 0x80 | 126][..], &medium.to_be_bytes()].concat(),
        _ => [&[0x81, 0x80 | 127][..], &u64::try_from(length).unwrap_or(u64::MAX).to_be_bytes()].concat(),
    };
    // A masking key of zero.
    [&head, &[0; 4][..], text].concat()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn said(fed: &Fed) -> String {
        String::from_utf8_lossy(&fed.answer).into_owned()
    }

    #[test]
    fn bytes_reach_the_server_and_its_pages() {
        let page = FedPage::new().unwrap();
        let asked = page.play(b"\0GET /metrics HTTP/1.1\r\nHost: leo\r\n\r\n");
        assert!(said(&asked).starts_with("HTTP/1.1 401"), "{asked:?}");
        let known = format!("\0GET /metrics?token={TOKEN} HTTP/1.1\r\nHost: leo\r\n\r\n");
        assert!(said(&page.play(known.as_bytes())).ends_with(SECRET));
        let upgraded = page.play(b"\x01Cookie: leo_7780=0\r\nOrigin: http://127.0.0.1:7780");
        assert!(said(&upgraded).starts_with("HTTP/1.1 401"), "{upgraded:?}");
        let wished = page.play(b"\x03{\"do\":\"undo\",\"id\":5}\n{\"do\":\"arm\",\"id\":6}\nno message");
        assert!(said(&wished).starts_with("HTTP/1.1 101"), "{wished:?}");
        // The third request releases what the page's hand holds.
        assert_eq!(wished.pending_requests, 3, "{wished:?}");
        let frames = page.play(&[2, 0x81, 0x80 | 2, 0, 0, 0, 0, b'{', b'}']);
        assert!(said(&frames).contains("missing field"), "{frames:?}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(512))]
        #[test]
        fn arbitrary_bytes_of_a_browser_cause_no_panic(
            kind in 0_u8..4,
            words in proptest::collection::vec(prop_oneof![
                Just(b"GET /live HTTP/1.1\r\n".to_vec()),
                Just(b"POST /stop HTTP/1.1\r\nHost: leo\r\n\r\n".to_vec()),
                Just(b"Host: 127.0.0.1:7780\r\n".to_vec()),
                Just(b"Cookie: a=b; leo_7780=\r\n".to_vec()),
                Just(b"Transfer-Encoding: chunked\r\n".to_vec()),
                Just(b"Content-Length: 99999999999\r\n".to_vec()),
                Just(b"\r\n".to_vec()),
                Just(b"{\"do\":\"say\",\"id\":1,\"text\":\"".to_vec()),
                Just(b"\"}\n".to_vec()),
                proptest::collection::vec(any::<u8>(), 0..64),
            ], 0..12),
        ) {
            let page = FedPage::new().unwrap();
            let mut script = vec![kind];
            words.iter().for_each(|word| script.extend(word));
            page.play(&script);
        }
    }
}
