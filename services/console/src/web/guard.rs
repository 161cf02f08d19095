//! Who may look, and from where.

use std::net::IpAddr;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::{fmt, io};

use axum::extract::{Request, State};
use axum::http::{HeaderMap, StatusCode, Uri, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use super::Shared;

/// Random bytes of a token.
const BYTES: usize = 16;

/// What somebody on another machine has to know: 128 random bits, written as hexadecimal digits.
#[derive(Clone)]
pub(crate) struct Token(String);

impl Token {
    pub(crate) fn new() -> io::Result<Self> {
        let mut bytes = [0_u8; BYTES];
        getrandom::fill(&mut bytes).map_err(|error| io::Error::other(error.to_string()))?;
        Ok(Self(bytes.iter().map(|byte| format!("{byte:02x}")).collect()))
    }

    /// A token that was written down; `None` for what is none.
    pub(crate) fn read(text: &str) -> Option<Self> {
        let is_token = text.len() == 2 * BYTES && text.bytes().all(|byte| byte.is_ascii_hexdigit());
        is_token.then(|| Self(text.to_owned()))
    }

    pub(crate) fn as_str(&self) -> &str {
        &self.0
    }

    /// Takes the same time wherever the first difference is.
    fn is(&self, said: &str) -> bool {
        let differing =
            self.0.bytes().zip(said.bytes()).fold(0, |differing, (one, other)| differing | (one ^ other));
        self.0.len() == said.len() && differing == 0
    }
}

impl fmt::Debug for Token {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("Token(..)")
    }
}

/// Lets pass whoever may look.
pub(super) async fn guard(State(shared): State<Arc<Shared>>, request: Request, next: Next) -> Response {
    match refusal(shared.token.as_ref(), request.headers(), request.uri()) {
        None => next.run(request).await,
        Some(why) => {
            shared.counts.refused.fetch_add(1, Ordering::Relaxed);
            (StatusCode::FORBIDDEN, format!("{why}\n")).into_response()
        }
    }
}

/// Why somebody may not look, if so.
fn refusal(token: Option<&Token>, headers: &HeaderMap, uri: &Uri) -> Option<&'static str> {
    let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
    let Some(host) = host(headers, uri) else { return Some("the request names no host") };
    // A page of elsewhere whose name was made to point here would be read as ours.
    if token.is_none() && !is_numbered(host) {
        return Some("open this page by the address that `leo run` prints, as in http://127.0.0.1:7780/");
    }
    if let Some(origin) = text(header::ORIGIN)
        && origin.split_once("://").map(|(_, origin)| origin) != Some(host)
    {
        return Some("a page of another origin may not talk to this robot");
    }
    // The page's own files are no secret, and they are fetched without its query.
    let is_file = matches!(uri.path(), "/page.js" | "/page.css");
    let said = uri.query().unwrap_or("").split('&').find_map(|pair| pair.strip_prefix("token="));
    if let Some(token) = token
        && !is_file
        && !said.is_some_and(|said| token.is(said))
    {
        return Some("this address needs the token that `leo run` prints: http://HOST:PORT/?token=…");
    }
    None
}

/// The host that a request is for.
fn host<'a>(headers: &'a HeaderMap, uri: &'a Uri) -> Option<&'a str> {
    let named = headers.get(header::HOST).and_then(|value| value.to_str().ok());
    named.or_else(|| uri.authority().map(axum::http::uri::Authority::as_str))
}

/// What a page may load and reach that was asked for as a request says, which may pass: this server alone.
pub(super) fn policy(headers: &HeaderMap, uri: &Uri) -> String {
    // Not every browser takes a WebSocket of its own server for a part of 'self'. What else could stand in
    // a header is no host, and would be read as something of its own.
    let is_host =
        |host: &&str| host.bytes().all(|byte| byte.is_ascii_alphanumeric() || b".-_:[]".contains(&byte));
    let live = host(headers, uri).filter(|host| !host.is_empty()).filter(is_host);
    let live = live.map_or(String::new(), |host| format!(" ws://{host} wss://{host}"));
    format!(
        "default-src 'self'; connect-src 'self'{live}; img-src 'self' data: blob:; style-src 'self'; \
         script-src 'self'; object-src 'none'; base-uri 'none'; frame-ancestors 'none'; form-action 'none'"
    )
}

/// Whether a host is this machine by number, or "localhost".
fn is_numbered(host: &str) -> bool {
    let name = if host.ends_with(']') { host } else { host.rsplit_once(':').map_or(host, |(name, _)| name) };
    let name = name.trim_start_matches('[').trim_end_matches(']');
    name == "localhost" || name.parse::<IpAddr>().is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(token: Option<&Token>, host: &str, origin: Option<&str>, path: &str) -> Option<&'static str> {
        let mut headers = HeaderMap::new();
        headers.insert(header::HOST, host.parse().unwrap());
        if let Some(origin) = origin {
            headers.insert(header::ORIGIN, origin.parse().unwrap());
        }
        refusal(token, &headers, &path.parse().unwrap())
    }

    #[test]
    fn only_this_machines_own_pages_may_look() {
        for host in ["127.0.0.1:7780", "localhost:7780", "[::1]:7780", "localhost", "[::1]"] {
            assert_eq!(answer(None, host, None, "/live"), None, "{host}");
            assert_eq!(answer(None, host, Some(&format!("http://{host}")), "/live"), None, "{host}");
        }
        assert!(answer(None, "evil.example:7780", None, "/").is_some());
        assert!(answer(None, "127.0.0.1:7780", Some("http://evil.example"), "/live").is_some());
        assert!(answer(None, "127.0.0.1:7780", Some("http://127.0.0.1:80"), "/live").is_some());
        assert!(answer(None, "127.0.0.1:7780", Some("null"), "/live").is_some());
    }

    #[test]
    fn a_page_may_reach_the_host_that_it_was_asked_of_and_nobody_else() {
        let reached = |host: &str| {
            let headers = HeaderMap::from_iter([(header::HOST, host.parse().unwrap())]);
            let policy = policy(&headers, &Uri::from_static("/"));
            policy.split("; ").find(|rule| rule.starts_with("connect-src")).unwrap().to_owned()
        };
        assert_eq!(reached("127.0.0.1:7780"), "connect-src 'self' ws://127.0.0.1:7780 wss://127.0.0.1:7780");
        assert_eq!(reached("leo.local"), "connect-src 'self' ws://leo.local wss://leo.local");
        for other in ["leo *", "leo; script-src *", "leo,x", "*", "leo/x", ""] {
            assert_eq!(reached(other), "connect-src 'self'", "{other}");
        }
    }

    #[test]
    fn another_machine_needs_the_token() {
        let token = Token::new().unwrap();
        let host = "robot.local:7780";
        assert!(answer(Some(&token), host, None, "/live").is_some());
        assert!(answer(Some(&token), host, None, "/live?token=1234").is_some());
        assert_eq!(answer(Some(&token), host, None, &format!("/live?token={}", token.as_str())), None);
        assert_eq!(answer(Some(&token), host, None, "/page.js"), None);
        assert_ne!(token.as_str(), Token::new().unwrap().as_str());
        assert_eq!(format!("{token:?}"), "Token(..)");
    }
}
