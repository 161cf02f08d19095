//! The first request of a viewer.

use tokio_tungstenite::tungstenite::handshake::server::{ErrorResponse, Request};
use tokio_tungstenite::tungstenite::http::StatusCode;
use tokio_tungstenite::tungstenite::http::header::{ORIGIN, SEC_WEBSOCKET_PROTOCOL};

use super::shared::Shared;
use crate::protocol::SUBPROTOCOLS;
use crate::{ClientId, MAX_CLIENTS};

/// Why a viewer is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum HandshakeError {
    /// It is a web page of a foreign site. Every page that a browser of this machine shows could connect.
    #[error("web pages of this origin are not admitted: start `leo view` with --origin")]
    Origin,
    /// It speaks another protocol.
    #[error("this address speaks {}: open it in Foxglove or Lichtblick", SUBPROTOCOLS.join(" and "))]
    Protocol,
    /// There are too many.
    #[error("{MAX_CLIENTS} viewers are connected, which is the maximum")]
    Full,
}

impl HandshakeError {
    /// The response that says so.
    pub(super) fn response(self) -> ErrorResponse {
        let mut response = ErrorResponse::new(Some(format!("{self}\n")));
        *response.status_mut() = match self {
            Self::Origin => StatusCode::FORBIDDEN,
            Self::Protocol => StatusCode::BAD_REQUEST,
            Self::Full => StatusCode::SERVICE_UNAVAILABLE,
        };
        response
    }
}

/// Adds a viewer to the hub. Returns its number, and the newest protocol that both sides speak.
///
/// # Errors
///
/// It is a web page of a foreign site, it speaks another protocol, or there are too many viewers.
pub(super) fn admit(request: &Request, shared: &Shared) -> Result<(ClientId, &'static str), HandshakeError> {
    let headers = request.headers();
    let origin = headers.get(ORIGIN).map(|origin| String::from_utf8_lossy(origin.as_bytes()));
    if !shared.admits(origin.as_deref()) {
        return Err(HandshakeError::Origin);
    }
    let lines = headers.get_all(SEC_WEBSOCKET_PROTOCOL).iter().filter_map(|line| line.to_str().ok());
    let offered: Vec<&str> = lines.flat_map(|line| line.split(',')).map(str::trim).collect();
    let spoken = SUBPROTOCOLS.into_iter().find(|known| offered.contains(known));
    let spoken = spoken.ok_or(HandshakeError::Protocol)?;
    let client = shared.hub().join().ok_or(HandshakeError::Full)?;
    Ok((client, spoken))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Hub, Origins};

    #[test]
    fn the_newest_common_protocol_is_spoken_and_others_are_refused() {
        let shared = Shared::new(Hub::new(String::new()), Origins::default());
        let spoken = |headers: &[(&str, &str)]| {
            let request = headers
                .iter()
                .fold(Request::builder(), |request, (name, value)| request.header(*name, *value));
            admit(&request.body(()).unwrap(), &shared).map(|(_, spoken)| spoken)
        };
        let protocol = "sec-websocket-protocol";
        assert_eq!(spoken(&[(protocol, "foxglove.websocket.v1")]), Ok("foxglove.websocket.v1"));
        let both = "foxglove.websocket.v1, foxglove.sdk.v1";
        assert_eq!(spoken(&[(protocol, both)]), Ok("foxglove.sdk.v1"));
        assert_eq!(spoken(&[(protocol, "other"), (protocol, both)]), Ok("foxglove.sdk.v1"));
        assert_eq!(spoken(&[(protocol, "foxglove.sdk.v2")]), Err(HandshakeError::Protocol));
        assert_eq!(spoken(&[]), Err(HandshakeError::Protocol));
        let foreign = [(protocol, both), ("origin", "https://evil.example")];
        assert_eq!(spoken(&foreign), Err(HandshakeError::Origin));
        while spoken(&[(protocol, both)]).is_ok() {}
        assert_eq!(spoken(&[(protocol, both)]), Err(HandshakeError::Full));
        assert_eq!(shared.hub().totals().clients, 16);
    }

    #[test]
    fn a_refusal_has_a_status_and_a_reason() {
        let errors = [HandshakeError::Origin, HandshakeError::Protocol, HandshakeError::Full];
        let said = errors.map(|error| {
            let response = error.response();
            format!("{} {}", response.status(), response.into_body().unwrap_or_default())
        });
        insta::assert_snapshot!(said.concat());
    }
}
