//! Access control of the page: tokens, hosts and origins.

use std::net::IpAddr;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::{fmt, io};

use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode, Uri, header};
use axum::middleware::Next;
use axum::response::Response;
use config::leo::ReadWithoutToken;
use ring::hmac;
use subtle::ConstantTimeEq as _;

use super::connections::{Class, Connection};
use super::page_headers::host;
use super::{Shared, notice};

/// Random bytes of a token.
const TOKEN_BYTES: usize = 16;
/// What the token authenticates for the cookie. The cookie's value is this authentication code.
const COOKIE_PURPOSE: &[u8] = b"cookie of leo's page";
/// The path that raises the emergency stop; needs no token.
pub(super) const STOP: &str = "/stop";

/// The secret required to command the robot: 128 random bits as hexadecimal digits.
#[derive(Clone)]
pub(crate) struct Token(String);

impl Token {
    pub(crate) fn new() -> io::Result<Self> {
        let mut bytes = [0_u8; TOKEN_BYTES];
        getrandom::fill(&mut bytes).map_err(|error| io::Error::other(error.to_string()))?;
        Ok(Self(hexadecimal(&bytes)))
    }

    /// Parses a stored token; `None` if malformed.
    pub(crate) fn read(text: &str) -> Option<Self> {
        let is_token = text.len() == 2 * TOKEN_BYTES && text.bytes().all(|byte| byte.is_ascii_hexdigit());
        is_token.then(|| Self(text.to_owned()))
    }

    pub(crate) fn as_str(&self) -> &str {
        &self.0
    }

    /// Constant-time comparison.
    fn is(&self, presented: &str) -> bool {
        self.0.as_bytes().ct_eq(presented.as_bytes()).into()
    }

    /// The value of the cookie: HMAC-SHA-256 with the token as key. The token cannot be computed from it.
    fn cookie(&self) -> String {
        let key = hmac::Key::new(hmac::HMAC_SHA256, self.0.as_bytes());
        hexadecimal(hmac::sign(&key, COOKIE_PURPOSE).as_ref())
    }

    /// Constant-time comparison with the cookie.
    fn is_cookie(&self, presented: &str) -> bool {
        self.cookie().as_bytes().ct_eq(presented.as_bytes()).into()
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

impl fmt::Debug for Token {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("Token(..)")
    }
}

/// The permission of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Access {
    /// Everything that the page can do.
    Command,
    /// Watch, and raise the emergency stop.
    Read,
}

/// Why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum AccessError {
    NoHost,
    OtherHost,
    OtherOrigin,
    NoToken,
    WrongToken,
}

impl AccessError {
    /// Status, heading and text of the answer.
    const fn answer(self) -> (StatusCode, &'static str, &'static str) {
        let token = "Open the whole address that `leo run` prints, with its `?token=…`. Programs send the \
                     header `Authorization: Bearer …`. The user who runs the robot finds its token in the file \
                     `page_token` of Leo's state directory: ~/.local/state/leo, or /var/lib/leo of the service. \
                     Stopping the robot needs none.";
        let refused = match self {
            Self::NoToken => return (StatusCode::UNAUTHORIZED, "This page needs its token", token),
            Self::WrongToken => return (StatusCode::UNAUTHORIZED, "This token is not the robot's", token),
            Self::NoHost => "The request names no host.",
            Self::OtherHost => {
                "Open this page by the number of its address, as `leo run` prints it: http://…/?token=…"
            }
            Self::OtherOrigin => "A page of another origin may not talk to this robot.",
        };
        (StatusCode::FORBIDDEN, "Refused", refused)
    }
}

/// Middleware: passes permitted requests on with their [`Access`] and refuses all others.
pub(super) async fn guard(State(shared): State<Arc<Shared>>, mut request: Request, next: Next) -> Response {
    let asks = AccessRequest { method: request.method(), headers: request.headers(), uri: request.uri() };
    let judged = asks.access(&shared.policy);
    let connection = request.extensions().get::<Arc<Connection>>();
    match judged {
        Ok(access) => {
            if let Some(connection) = connection {
                if access == Access::Command {
                    connection.set_class(Class::Authorised);
                } else if asks.is_stop() {
                    connection.set_class(Class::Stopping);
                }
            }
            let cookie = asks.is_login().then(|| shared.policy.set_cookie());
            request.extensions_mut().insert(access);
            let mut response = next.run(request).await;
            if let Some(Ok(cookie)) = cookie.map(HeaderValue::try_from) {
                let headers = response.headers_mut();
                headers.insert(header::SET_COOKIE, cookie);
                headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
            }
            response
        }
        Err(why) => {
            shared.counts.refused.fetch_add(1, Ordering::Relaxed);
            let (status, heading, words) = why.answer();
            let mut refused = notice::answer(asks.headers, status, heading, words);
            // Close the connection, so that its slot is free at once.
            refused.headers_mut().insert(header::CONNECTION, HeaderValue::from_static("close"));
            refused
        }
    }
}

/// The token, and what is accessible without it.
#[derive(Debug)]
pub(crate) struct AccessPolicy {
    pub(crate) token: Token,
    /// The port of the server, part of the cookie's name: browsers share cookies between the ports of a host.
    pub(crate) port: u16,
    pub(crate) open: ReadWithoutToken,
}

impl AccessPolicy {
    fn cookie_name(&self) -> String {
        format!("leo_{}", self.port)
    }

    /// The header value that stores the cookie in a browser.
    fn set_cookie(&self) -> String {
        format!("{}={}; Path=/; HttpOnly; SameSite=Strict", self.cookie_name(), self.token.cookie())
    }
}

/// The parts of a request that decide on its access.
struct AccessRequest<'a> {
    method: &'a Method,
    headers: &'a HeaderMap,
    uri: &'a Uri,
}

impl AccessRequest<'_> {
    fn access(&self, policy: &AccessPolicy) -> Result<Access, AccessError> {
        let presented = self.token();
        let is_known = presented.is_some_and(|presented| policy.token.is(presented));
        let has_cookie =
            self.cookie(&policy.cookie_name()).is_some_and(|presented| policy.token.is_cookie(presented));
        let host = host(self.headers, self.uri).ok_or(AccessError::NoHost)?;
        // DNS rebinding: a foreign site whose name resolves to this machine would count as same-origin.
        // Such a request has neither the token nor the cookie.
        let host = HostName::parse(host).ok_or(AccessError::OtherHost)?;
        if !is_known && !has_cookie && !host.is_own() {
            return Err(AccessError::OtherHost);
        }
        if text(self.headers, header::ORIGIN).is_some_and(|origin| !host.is_of_origin(origin)) {
            return Err(AccessError::OtherOrigin);
        }
        // A page on another port of this host may ask too; browsers mark such requests as same-site.
        let is_plain = self.method.is_safe() && self.uri.path() != "/live";
        let site = self.headers.get("sec-fetch-site").and_then(|site| site.to_str().ok());
        if !is_plain && matches!(site, Some("cross-site" | "same-site")) {
            return Err(AccessError::OtherOrigin);
        }
        if is_known {
            return Ok(Access::Command);
        }
        let is_page_open = policy.open == ReadWithoutToken::Page;
        let is_open = match self.uri.path() {
            // The notice shown without a token uses the page's style sheet.
            "/page.css" | STOP => true,
            "/metrics" => policy.open != ReadWithoutToken::Nothing,
            // The script would store a wrong token of the address.
            "/" => (has_cookie || is_page_open) && self.token_of_address().is_none(),
            "/page.js" => has_cookie || is_page_open,
            "/leo.urdf" | "/live" => is_page_open,
            _ => false,
        };
        match (is_open, presented) {
            (true, _) => Ok(Access::Read),
            (false, None) => Err(AccessError::NoToken),
            (false, Some(_)) => Err(AccessError::WrongToken),
        }
    }

    fn is_stop(&self) -> bool {
        self.uri.path() == STOP && self.method == Method::POST
    }

    /// Whether this is the printed address with the right token, if the request is permitted at all.
    fn is_login(&self) -> bool {
        self.uri.path() == "/" && self.token_of_address().is_some()
    }

    /// The token of the request: from the query, or the authorization header.
    fn token(&self) -> Option<&str> {
        let bearer = || {
            let (scheme, token) = text(self.headers, header::AUTHORIZATION)?.split_once(' ')?;
            scheme.eq_ignore_ascii_case("bearer").then_some(token)
        };
        self.token_of_address().or_else(bearer)
    }

    fn token_of_address(&self) -> Option<&str> {
        self.uri.query()?.split('&').find_map(|pair| pair.strip_prefix("token="))
    }

    fn cookie(&self, name: &str) -> Option<&str> {
        let cookies =
            self.headers.get_all(header::COOKIE).into_iter().filter_map(|value| value.to_str().ok());
        let mut pairs =
            cookies.flat_map(|cookies| cookies.split(';')).filter_map(|pair| pair.trim().split_once('='));
        pairs.find(|(known, _)| *known == name).map(|(_, value)| value)
    }
}

fn text(headers: &HeaderMap, name: header::HeaderName) -> Option<&str> {
    headers.get(name).and_then(|value| value.to_str().ok())
}

/// The host that a request is for. Names are compared as RFC 9110 and RFC 3986 do: without regard to case, with the
/// default port where none is written, and a dot at the end of a complete name means nothing.
#[derive(Debug, PartialEq, Eq)]
struct HostName {
    name: String,
    /// The port, if one is written.
    port: Option<u16>,
}

impl HostName {
    /// Parses `name` or `name:port`; an IPv6 address is in brackets. `None` without a name, or with a port that is no
    /// number.
    fn parse(host: &str) -> Option<Self> {
        let (name, port) =
            if host.ends_with(']') { (host, "") } else { host.rsplit_once(':').unwrap_or((host, "")) };
        let port = if port.is_empty() { None } else { Some(port.parse().ok()?) };
        let name = name.strip_suffix('.').unwrap_or(name).to_ascii_lowercase();
        (!name.is_empty()).then_some(Self { name, port })
    }

    /// Whether it cannot be a DNS name under foreign control: an IP address or a local name.
    fn is_own(&self) -> bool {
        let name = self.name.trim_start_matches('[').trim_end_matches(']');
        let is_local = !name.contains('.') || name.ends_with(".local") || name.ends_with(".localhost");
        name.parse::<IpAddr>().is_ok() || (is_local && !name.is_empty())
    }

    /// Whether a page of this origin was served by this host. A host without a port has the default one of the
    /// origin's scheme.
    fn is_of_origin(&self, origin: &str) -> bool {
        let Some((scheme, host)) = origin.split_once("://") else { return false };
        let default_port = if scheme.eq_ignore_ascii_case("https") { 443 } else { 80 };
        let port = |host: &Self| host.port.unwrap_or(default_port);
        Self::parse(host).is_some_and(|origin| origin.name == self.name && port(&origin) == port(self))
    }
}

#[cfg(test)]
mod tests;
