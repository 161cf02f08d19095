//! Explains why a certificate or a name ended a connection: which certificate, why, and what to do.
#![expect(
    clippy::wildcard_enum_match_arm,
    reason = "the libraries name many errors, and those without a sentence of their own keep the library's"
)]

use std::path::Path;

use config::leo::Link;
use quinn::{ConnectionError, VarInt};
use rustls::{AlertDescription, CertificateError};
use x509_parser::certificate::X509Certificate;
use x509_parser::parse_x509_certificate;

use super::verifier::{RefusalRecord, RefusedCertificate};

/// Close code: the peer's certificate has expired.
pub(super) const EXPIRED: VarInt = VarInt::from_u32(2);
/// Offset of TLS alerts among the QUIC error codes (RFC 9001, 4.8).
const FIRST_ALERT: u64 = 0x100;
const SIGN: &str = "Sign a new one with package/link_keys.sh";
const ONE_AUTHORITY: &str =
    "Both machines need certificates of one authority, made with package/link_keys.sh in one folder";
const CLOCKS: &str = "Compare the clocks of both machines";

/// Paths of this machine's files, as the messages name them.
#[derive(Clone, Debug)]
pub(crate) struct KeyFiles {
    authority: String,
    certificate: String,
}

impl KeyFiles {
    pub(crate) fn of(link: &Link) -> Self {
        let shown = |file: &Path| file.display().to_string();
        Self { authority: shown(&link.ca_certificate), certificate: shown(&link.certificate) }
    }

    /// Explains why there is no connection with the machine at `peer`, or none any more.
    pub(crate) fn explain(&self, peer: &str, record: &RefusalRecord, ended: &ConnectionError) -> String {
        if let Some(refused) = record.refused() {
            return self.explain_refused_peer(peer, &refused);
        }
        match ended {
            ConnectionError::TransportError(error) => match alert(u64::from(error.code)) {
                Some(alert) => self.explain_alert_sent(peer, alert, &error.reason),
                None => format!("no connection with {peer}: {error}"),
            },
            ConnectionError::ConnectionClosed(close) => match alert(u64::from(close.error_code)) {
                Some(alert) => self.explain_alert_received(peer, alert),
                None => format!("{peer} ended the connection: {close}"),
            },
            ConnectionError::ApplicationClosed(close) if close.error_code == EXPIRED => {
                self.explain_alert_received(peer, AlertDescription::CertificateExpired)
            }
            ConnectionError::TimedOut => format!(
                "no connection with {peer}: no answer. Check that its link runs, and that the firewalls let UDP through"
            ),
            other => format!("no connection with {peer}: {other}"),
        }
    }

    /// The message for a connected peer whose certificate expires.
    pub(crate) fn expired(peer: &str) -> String {
        format!("the certificate of {peer} is refused from now on: it has expired. {CLOCKS}. {SIGN}")
    }

    /// Whether the peer ended the connection because of this machine's certificate or protocol.
    pub(crate) fn is_refusal(ended: &ConnectionError) -> bool {
        match ended {
            ConnectionError::ConnectionClosed(close) => alert(u64::from(close.error_code)).is_some(),
            ConnectionError::ApplicationClosed(close) => close.error_code == EXPIRED,
            _ => false,
        }
    }

    fn explain_refused_peer(&self, peer: &str, refused: &RefusedCertificate) -> String {
        let (called, why) = self.describe(refused);
        format!("the certificate of {peer}{called} is refused: {why}")
    }

    /// The message about this machine's own certificate.
    pub(crate) fn explain_refused_own(&self, refused: &RefusedCertificate) -> String {
        let (called, why) = self.describe(refused);
        format!(
            "the other machine will refuse the certificate of this one ({}){called}: {why}",
            self.certificate
        )
    }

    /// The names of a certificate and the reason of its refusal.
    fn describe(&self, refused: &RefusedCertificate) -> (String, String) {
        // Bytes that rustls could not parse are not parsed again.
        let is_readable = !matches!(refused.error, CertificateError::BadEncoding);
        let parsed = is_readable.then(|| parse_x509_certificate(&refused.certificate).ok()).flatten();
        let certificate = parsed.as_ref().map(|(_, certificate)| certificate);
        let called = certificate.map_or_else(String::new, |certificate| format!(" ({})", name(certificate)));
        (called, self.why(&refused.error, certificate))
    }

    fn why(&self, error: &CertificateError, certificate: Option<&X509Certificate<'_>>) -> String {
        let Self { authority, .. } = self;
        let from_to = certificate.map(|certificate| certificate.validity());
        match error {
            CertificateError::Expired | CertificateError::ExpiredContext { .. } => {
                let when = from_to.map_or_else(String::new, |validity| format!(" on {}", validity.not_after));
                format!("it expired{when}. {CLOCKS}. {SIGN}")
            }
            CertificateError::NotValidYet | CertificateError::NotValidYetContext { .. } => {
                let when =
                    from_to.map_or_else(String::new, |validity| format!(" before {}", validity.not_before));
                format!("it is not valid{when}. {CLOCKS}. {SIGN}")
            }
            CertificateError::UnknownIssuer if certificate.is_some_and(is_self_signed) => {
                format!("it is self-signed. {SIGN}, by the authority of this machine ({authority})")
            }
            CertificateError::UnknownIssuer => {
                format!("its issuer is not the authority of this machine ({authority}). {ONE_AUTHORITY}")
            }
            CertificateError::BadSignature => format!(
                "its issuer has the name of the authority of this machine ({authority}) and another key. \
                 {ONE_AUTHORITY}"
            ),
            CertificateError::NotValidForNameContext { expected, presented } => format!(
                "it is for {}, and `connect` of [link] expects {}. {SIGN} that has this name, or correct `connect`",
                if presented.is_empty() { "no name".to_owned() } else { presented.join(", ") },
                expected.to_str()
            ),
            CertificateError::InvalidPurposeContext { .. } => format!(
                "its extendedKeyUsage does not allow this side of a connection. {SIGN}: it allows both sides"
            ),
            CertificateError::Other(_) if certificate.is_some_and(|certificate| certificate.is_ca()) => {
                format!("it is the certificate of an authority, not of a machine. {SIGN}")
            }
            other => format!("{other}. {SIGN}"),
        }
    }

    /// Explains a handshake that this machine ended for another reason than the peer's certificate.
    fn explain_alert_sent(&self, peer: &str, alert: AlertDescription, reason: &str) -> String {
        match alert {
            AlertDescription::CertificateRequired => format!(
                "{peer} sent no certificate. A link needs one from the authority of this machine ({}), made with \
                 package/link_keys.sh",
                self.authority
            ),
            AlertDescription::NoApplicationProtocol => other_robot(peer),
            other => format!("no connection with {peer}: {other:?}: {reason}"),
        }
    }

    /// Explains a connection that the peer ended with this alert.
    fn explain_alert_received(&self, peer: &str, alert: AlertDescription) -> String {
        let why = match alert {
            AlertDescription::CertificateExpired => {
                format!("it has expired or is not valid yet, by the clock of that machine. {CLOCKS}. {SIGN}")
            }
            AlertDescription::UnknownCA => {
                format!("its issuer is not the authority of that machine. {ONE_AUTHORITY}")
            }
            AlertDescription::DecryptError => {
                format!(
                    "its issuer has the name of the authority of that machine and another key. {ONE_AUTHORITY}"
                )
            }
            AlertDescription::UnsupportedCertificate => {
                format!(
                    "its extendedKeyUsage does not allow this side of a connection. {SIGN}: it allows both sides"
                )
            }
            AlertDescription::BadCertificate => format!(
                "it does not have the name that `connect` of that machine expects, or its issuer is not known there. \
                 {SIGN} that has this name, or correct `connect` there"
            ),
            AlertDescription::CertificateUnknown | AlertDescription::CertificateRevoked => {
                format!("that machine does not accept it. {SIGN}")
            }
            AlertDescription::CertificateRequired => {
                format!("that machine requires a certificate and received none. {SIGN}")
            }
            AlertDescription::NoApplicationProtocol => return other_robot(peer),
            other => return format!("{peer} closed the connection with the TLS alert {other:?}"),
        };
        format!("{peer} refuses the certificate of this machine ({}): {why}", self.certificate)
    }
}

fn other_robot(peer: &str) -> String {
    format!(
        "no connection with {peer}: its link belongs to another robot, or has the same side as this one. Both machines \
         need the same `robot` in [link] of leo.toml, and different values of `side`"
    )
}

fn alert(code: u64) -> Option<AlertDescription> {
    let number = code.checked_sub(FIRST_ALERT)?;
    u8::try_from(number).ok().map(AlertDescription::from)
}

/// The subject and the issuer of a certificate.
fn name(certificate: &X509Certificate<'_>) -> String {
    let (subject, issuer) = (certificate.subject().to_string(), certificate.issuer().to_string());
    printable(&format!("{subject}, issued by {issuer}"))
}

/// Makes text from an untrusted peer printable: limits its length and replaces control characters.
fn printable(text: &str) -> String {
    text.chars().map(|letter| if letter.is_control() { '?' } else { letter }).take(MAX_NAME).collect()
}

/// Maximum length of a certificate's names in messages, in characters.
const MAX_NAME: usize = 160;

/// Whether a certificate names itself as its issuer. Called only if no known authority signed it.
fn is_self_signed(certificate: &X509Certificate<'_>) -> bool {
    certificate.subject() == certificate.issuer()
}

#[cfg(test)]
mod tests;
