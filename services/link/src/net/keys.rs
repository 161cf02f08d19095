//! What a machine shows, and whom it believes.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use config::leo::{Link, RobotName, Side};
use quinn::crypto::rustls::{QuicClientConfig, QuicServerConfig};
use quinn::{ClientConfig, Connection, IdleTimeout, ServerConfig, TransportConfig, VarInt};
use rustls::client::Resumption;
use rustls::pki_types::pem::PemObject as _;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, UnixTime};
use rustls::server::WebPkiClientVerifier;
use rustls::{RootCertStore, SupportedProtocolVersion};
use x509_parser::parse_x509_certificate;

use super::congestion::WithFloor;

/// TLS 1.3 alone, which QUIC is made of.
const VERSIONS: [&SupportedProtocolVersion; 1] = [&rustls::version::TLS13];
/// Whoever is silent for so long is connected to anew, in milliseconds.
const SILENT_MS: u32 = 2000;
/// Said this often where there is nothing else to say.
const KEEP_ALIVE: Duration = Duration::from_millis(500);
/// A stream has so many bytes under way at most: the link's own window is smaller.
const UNDER_WAY: u32 = 16 * 1024 * 1024;
/// Pulses that wait to be sent, and to be read, in bytes.
const PULSES: usize = 16 * 1024;

/// Why the link's keys cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("leo.toml: `{key}` of [link]: {}: {reason}", file.display())]
pub struct KeyError {
    key: &'static str,
    file: PathBuf,
    reason: String,
}

/// How this machine is connected to, and how it connects.
#[derive(Clone)]
pub(crate) struct Keys {
    pub(crate) server: ServerConfig,
    pub(crate) client: ClientConfig,
}

impl Keys {
    /// Reads those of a link.
    pub(crate) fn read(link: &Link) -> Result<Self, KeyError> {
        let provider = Arc::new(rustls::crypto::ring::default_provider());
        let wrong = |key, file: &Path, error: &dyn std::fmt::Display| KeyError {
            key,
            file: file.to_owned(),
            reason: error.to_string(),
        };
        let authority = || -> Result<RootCertStore, Box<dyn std::error::Error>> {
            let mut store = RootCertStore::empty();
            for certificate in CertificateDer::pem_file_iter(&link.authority)? {
                store.add(certificate?)?;
            }
            Ok(store)
        };
        let authority = Arc::new(authority().map_err(|error| wrong("authority", &link.authority, &error))?);
        let chain =
            CertificateDer::pem_file_iter(&link.certificate).and_then(Iterator::collect::<Result<Vec<_>, _>>);
        let chain = chain.map_err(|error| wrong("certificate", &link.certificate, &error))?;
        let key = PrivateKeyDer::from_pem_file(&link.private_key);
        let key = key.map_err(|error| wrong("private_key", &link.private_key, &error))?;

        let verifier =
            WebPkiClientVerifier::builder_with_provider(Arc::clone(&authority), Arc::clone(&provider))
                .build();
        let verifier = verifier.map_err(|error| wrong("authority", &link.authority, &error))?;
        let unusable = |error: &dyn std::fmt::Display| wrong("certificate", &link.certificate, error);
        let server = rustls::ServerConfig::builder_with_provider(Arc::clone(&provider));
        let server = server.with_protocol_versions(&VERSIONS).map_err(|error| unusable(&error))?;
        let server =
            server.with_client_cert_verifier(verifier).with_single_cert(chain.clone(), key.clone_key());
        let mut server = server.map_err(|error| unusable(&error))?;
        let client = rustls::ClientConfig::builder_with_provider(provider);
        let client = client.with_protocol_versions(&VERSIONS).map_err(|error| unusable(&error))?;
        let client = client.with_root_certificates(authority).with_client_auth_cert(chain, key);
        let mut client = client.map_err(|error| unusable(&error))?;

        let other = if link.side == Side::Away { Side::Robot } else { Side::Away };
        server.alpn_protocols = vec![protocol(&link.robot, other)];
        client.alpn_protocols = vec![protocol(&link.robot, link.side)];
        // Every connection shows its certificate: none goes on from an earlier one.
        server.send_tls13_tickets = 0;
        client.resumption = Resumption::disabled();
        let server = QuicServerConfig::try_from(server).map_err(|error| unusable(&error))?;
        let client = QuicClientConfig::try_from(client).map_err(|error| unusable(&error))?;
        let transport = Arc::new(transport());
        let mut server = ServerConfig::with_crypto(Arc::new(server));
        server.transport_config(Arc::clone(&transport));
        let mut client = ClientConfig::new(Arc::new(client));
        client.transport_config(transport);
        Ok(Self { server, client })
    }
}

/// What is spoken, as the handshake agrees on it (ALPN, RFC 7301): with which robot, and on which side of its link who
/// connects is. Robots of one network, and two machines of one side, part before a word is said.
pub(crate) fn protocol(robot: &RobotName, side: Side) -> Vec<u8> {
    let side = if side == Side::Away { "away" } else { "robot" };
    format!("leo-link/{}/{side}", robot.as_str()).into_bytes()
}

fn transport() -> TransportConfig {
    let mut transport = TransportConfig::default();
    transport
        .max_idle_timeout(Some(IdleTimeout::from(VarInt::from_u32(SILENT_MS))))
        .keep_alive_interval(Some(KEEP_ALIVE))
        // One for the bundles, and none that answers.
        .max_concurrent_uni_streams(VarInt::from_u32(1))
        .max_concurrent_bidi_streams(VarInt::from_u32(0))
        .stream_receive_window(VarInt::from_u32(UNDER_WAY))
        .receive_window(VarInt::from_u32(UNDER_WAY))
        .send_window(u64::from(UNDER_WAY))
        .datagram_send_buffer_size(PULSES)
        .datagram_receive_buffer_size(Some(PULSES))
        .congestion_controller_factory(Arc::new(WithFloor::default()));
    transport
}

/// Whether a certificate that was shown has expired since: the handshake has looked once.
pub(crate) fn has_expired(connection: &Connection, now: UnixTime) -> bool {
    let shown =
        connection.peer_identity().and_then(|shown| shown.downcast::<Vec<CertificateDer<'static>>>().ok());
    shown.is_none_or(|shown| shown.iter().any(|certificate| !is_good_until(certificate, now)))
}

fn is_good_until(certificate: &CertificateDer<'_>, now: UnixTime) -> bool {
    let Ok((_, certificate)) = parse_x509_certificate(certificate) else { return false };
    u64::try_from(certificate.validity().not_after.timestamp()).is_ok_and(|last| now.as_secs() <= last)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::net::tests::certificates::{everybody_or_skip, shown};

    #[test]
    fn a_certificate_is_good_for_as_long_as_it_says() {
        const DAY_S: u64 = 24 * 60 * 60;
        let Some(keys) = everybody_or_skip() else { return };
        let now = UnixTime::now();
        let after = |days: u64| UnixTime::since_unix_epoch(Duration::from_secs(now.as_secs() + days * DAY_S));
        let good =
            |name, days| shown(keys.path(), name).0.iter().all(|shown| is_good_until(shown, after(days)));
        // Signed for nine days, for 825, and until yesterday.
        assert_eq!([0, 8, 10].map(|days| good("any", days)), [true, true, false]);
        assert_eq!([0, 824, 826].map(|days| good("robot", days)), [true, true, false]);
        assert!(!good("expired", 0));
    }

    #[test]
    fn a_file_that_holds_no_key_is_named() {
        let Some(keys) = everybody_or_skip() else { return };
        let mut link = config::Robot::load(None).unwrap().leo.link;
        link.authority = keys.path().join("authority.pem");
        link.certificate = keys.path().join("robot.pem");
        link.private_key = keys.path().join("robot.pem");
        let told = Keys::read(&link).err().unwrap().to_string();
        assert!(told.contains("`private_key` of [link]") && told.contains("robot.pem"), "{told}");
        // One of somebody else.
        link.private_key = keys.path().join("any.key");
        assert!(Keys::read(&link).err().unwrap().to_string().contains("`certificate` of [link]"));
    }
}
