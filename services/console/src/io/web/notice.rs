//! The page shown instead of the real one: an explanation, and the emergency stop button.

use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{Html, IntoResponse as _, Response};

use super::page_headers::page_headers;

const NOTICE: &str = include_str!("../../../page/notice.html");

/// Responds with HTML if the client accepts it, otherwise with plain text.
pub(super) fn answer(headers: &HeaderMap, status: StatusCode, heading: &str, words: &str) -> Response {
    let accepted = headers.get(header::ACCEPT).and_then(|value| value.to_str().ok());
    let mut response = if accepted.is_some_and(|accepted| accepted.contains("text/html")) {
        let html = NOTICE.replace("{heading}", &escaped(heading)).replace("{words}", &escaped(words));
        (status, page_headers(headers), Html(html)).into_response()
    } else {
        (status, format!("{words}\n")).into_response()
    };
    if status == StatusCode::UNAUTHORIZED {
        let scheme = header::HeaderValue::from_static("Bearer");
        response.headers_mut().insert(header::WWW_AUTHENTICATE, scheme);
    }
    let no_store = header::HeaderValue::from_static("no-store");
    response.headers_mut().insert(header::CACHE_CONTROL, no_store);
    response
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_escaped_in_html() {
        assert_eq!(escaped("<a> & b"), "&lt;a&gt; &amp; b");
    }
}
