//! The security headers of the page, for the host that a request is for.

use axum::http::{HeaderMap, Uri, header};

/// The host that a request is for.
pub(super) fn host<'a>(headers: &'a HeaderMap, uri: &'a Uri) -> Option<&'a str> {
    let named = headers.get(header::HOST).and_then(|value| value.to_str().ok());
    named.or_else(|| uri.authority().map(axum::http::uri::Authority::as_str))
}

/// The security headers of an HTML response.
pub(super) fn page_headers(headers: &HeaderMap) -> [(header::HeaderName, String); 3] {
    [
        (header::CONTENT_SECURITY_POLICY, policy(headers, &Uri::from_static("/"))),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff".to_owned()),
        // With "no-referrer" a browser would send no origin with the stop button's POST.
        (header::REFERRER_POLICY, "same-origin".to_owned()),
    ]
}

/// The content security policy: the page may load from and connect to this server only.
fn policy(headers: &HeaderMap, uri: &Uri) -> String {
    // Some browsers do not count a WebSocket of the same server as 'self'. Host characters are checked so that a
    // forged Host header cannot inject directives.
    let is_host =
        |host: &&str| host.bytes().all(|byte| byte.is_ascii_alphanumeric() || b".-_:[]".contains(&byte));
    let live = host(headers, uri).filter(|host| !host.is_empty()).filter(is_host);
    let live = live.map_or(String::new(), |host| format!(" ws://{host} wss://{host}"));
    format!(
        "default-src 'self'; connect-src 'self'{live}; img-src 'self' data: blob:; style-src 'self'; \
         script-src 'self'; object-src 'none'; base-uri 'none'; frame-ancestors 'none'; form-action 'self'"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_may_connect_only_to_the_host_that_served_it() {
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
}
