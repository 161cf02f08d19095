//! The link's keys and certificates: the machine's own identity and the authority that it trusts.

use std::net::{IpAddr, Ipv4Addr};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use config::leo::{Link, RobotName, Side};
use quinn::crypto::rustls::{QuicClientConfig, QuicServerConfig};
use quinn::{ClientConfig, Connection, IdleTimeout, ServerConfig, TransportConfig, VarInt};
use rustls::client::danger::ServerCertVerifier;
use rustls::client::{Resumption, WebPkiServerVerifier};
use rustls::crypto::CryptoProvider;
use rustls::pki_types::pem::PemObject as _;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, ServerName, UnixTime};
use rustls::server::WebPkiClientVerifier;
use rustls::server::danger::ClientCertVerifier;
use rustls::sign::{CertifiedKey, SingleCertAndKey};
use rustls::{CertificateError, Error, RootCertStore, SupportedProtocolVersion};
use x509_parser::parse_x509_certificate;

use super::congestion::WithFloor;
use super::refusal::KeyFiles;
use super::verifier::{RecordingVerifier, RefusalRecord, RefusedCertificate};

/// QUIC requires TLS 1.3.
const VERSIONS: [&SupportedProtocolVersion; 1] = [&rustls::version::TLS13];
/// Idle time-out of a connection, in milliseconds; a new connection is made then.
const SILENT_MS: u32 = 2000;
/// Period of keep-alive packets on an idle connection.
const KEEP_ALIVE: Duration = Duration::from_millis(500);
/// Flow-control limit in bytes; the link's own window is smaller.
const UNDER_WAY: u32 = 16 * 1024 * 1024;
/// Size of the datagram send and receive buffers (heartbeats), in bytes.
const PULSES: usize = 16 * 1024;
/// Lifetime of a Retry token: it is used within the next round trip.
const PROOF_LIFETIME: Duration = Duration::from_secs(5);
/// Assumed round trip of an incoming connection before the first measurement. A closed connection stays in
/// memory for nine times as long. On a longer path the handshake is sent once more than necessary.
const FIRST_ROUND_TRIP: Duration = Duration::from_millis(100);
/// Limits of connection attempts that wait to be accepted: their number, and the bytes buffered for one and
/// for all.
const MAX_INCOMING: usize = 256;
const MAX_INCOMING_BYTES: u64 = 4 * 1024;
const MAX_INCOMING_BYTES_TOTAL: u64 = 64 * 1024;
/// Limit of out-of-order handshake data in bytes: a certificate chain takes about 4000.
const MAX_HANDSHAKE_BYTES: usize = 16 * 1024;

/// The configured keys or certificates of the link cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("leo.toml: `{key}` of [link]: {}: {reason}", file.display())]
pub struct KeyError {
    key: &'static str,
    file: PathBuf,
    reason: String,
}

/// The machine's identity and the verifier of the peer's certificate.
#[derive(Clone)]
pub(crate) struct Keys {
    pub(crate) files: KeyFiles,
    /// Configuration of the endpoint. It is created once, because its key signs the Retry tokens.
    pub(crate) server: ServerConfig,
    identity: Identity,
    transport: Arc<TransportConfig>,
}

type Unusable = Box<dyn std::error::Error>;

impl Keys {
    /// Reads the key files of a link.
    pub(crate) fn read(link: &Link) -> Result<Self, KeyError> {
        let provider = Arc::new(rustls::crypto::ring::default_provider());
        let wrong = |key, file: &Path, error: &dyn std::fmt::Display| KeyError {
            key,
            file: file.to_owned(),
            reason: error.to_string(),
        };
        let authority = || -> Result<RootCertStore, Box<dyn std::error::Error>> {
            let mut store = RootCertStore::empty();
            for certificate in CertificateDer::pem_slice_iter(budget::text(&link.ca_certificate)?.as_bytes())
            {
                store.add(certificate?)?;
            }
            Ok(store)
        };
        let unknown = |error: &dyn std::fmt::Display| wrong("ca_certificate", &link.ca_certificate, error);
        let authority = Arc::new(authority().map_err(|error| unknown(&error))?);
        let unusable = |error: &dyn std::fmt::Display| wrong("certificate", &link.certificate, error);
        let text = budget::text(&link.certificate).map_err(|error| unusable(&error))?;
        let chain = CertificateDer::pem_slice_iter(text.as_bytes()).collect::<Result<Vec<_>, _>>();
        let chain = chain.map_err(|error| unusable(&error))?;
        let no_key = |error: &dyn std::fmt::Display| wrong("private_key", &link.private_key, error);
        let text = budget::text(&link.private_key).map_err(|error| no_key(&error))?;
        let key = PrivateKeyDer::from_pem_slice(text.as_bytes()).map_err(|error| no_key(&error))?;
        let shown =
            CertifiedKey::from_der(chain.clone(), key, &provider).map_err(|error| unusable(&error))?;

        let clients =
            WebPkiClientVerifier::builder_with_provider(Arc::clone(&authority), Arc::clone(&provider))
                .build();
        let servers = WebPkiServerVerifier::builder_with_provider(authority, Arc::clone(&provider)).build();
        let other = if link.side == Side::Remote { Side::Robot } else { Side::Remote };
        let identity = Identity {
            provider,
            chain,
            shown: Arc::new(SingleCertAndKey::from(shown)),
            clients: clients.map_err(|error| unknown(&error))?,
            servers: servers.map_err(|error| unknown(&error))?,
            comes: protocol(&link.robot, other),
            goes: protocol(&link.robot, link.side),
        };
        let crypto = identity.server(Arc::clone(&identity.clients)).map_err(|error| unusable(&error))?;
        let mut incoming = transport();
        incoming.initial_rtt(FIRST_ROUND_TRIP);
        let mut server = ServerConfig::with_crypto(Arc::new(crypto));
        server
            .transport_config(Arc::new(incoming))
            .retry_token_lifetime(PROOF_LIFETIME)
            .max_incoming(MAX_INCOMING)
            .incoming_buffer_size(MAX_INCOMING_BYTES)
            .incoming_buffer_size_total(MAX_INCOMING_BYTES_TOTAL);
        Ok(Self { files: KeyFiles::of(link), server, identity, transport: Arc::new(transport()) })
    }

    /// Checks locally whether the peer would refuse this machine's certificate, in the roles that the
    /// configuration uses. Returns the reason.
    pub(crate) fn own_refusal(&self, link: &Link, now: UnixTime) -> Option<String> {
        let Identity { chain, clients, servers, .. } = &self.identity;
        let (certificate, rest) = chain.split_first()?;
        // Only the peer knows the expected name. It is checked last, and its mismatch is ignored here.
        let name = ServerName::from(IpAddr::from(Ipv4Addr::LOCALHOST));
        let as_server = || servers.verify_server_cert(certificate, rest, &name, &[], now).map(drop);
        let as_client = || clients.verify_client_cert(certificate, rest, now).map(drop);
        let listens = (!link.listen.is_empty()).then(as_server);
        let connects = (!link.connect.is_empty()).then(as_client);
        let error = [listens, connects].into_iter().flatten().filter_map(Result::err).find_map(refusal)?;
        Some(self.files.explain_refused_own(&RefusedCertificate { certificate: certificate.clone(), error }))
    }

    /// Configuration of one incoming connection, with the record of a refused certificate.
    pub(crate) fn for_incoming(&self) -> Result<(Arc<ServerConfig>, RefusalRecord), Unusable> {
        let (verifier, record) = RecordingVerifier::new(&self.identity.clients);
        let mut server = self.server.clone();
        server.crypto = Arc::new(self.identity.server(verifier)?);
        Ok((Arc::new(server), record))
    }

    /// Configuration of one outgoing connection, with the record of a refused certificate.
    pub(crate) fn for_outgoing(&self) -> Result<(ClientConfig, RefusalRecord), Unusable> {
        let (verifier, record) = RecordingVerifier::new(&self.identity.servers);
        let mut client = ClientConfig::new(Arc::new(self.identity.client(verifier)?));
        client.transport_config(Arc::clone(&self.transport));
        Ok((client, record))
    }
}

/// The error of a certificate, unless it is only the name.
fn refusal(error: Error) -> Option<CertificateError> {
    let Error::InvalidCertificate(error) = error else { return None };
    let is_of_name = matches!(error, CertificateError::NotValidForNameContext { .. });
    (!is_of_name).then_some(error)
}

/// The machine's certificate and the verifiers of the peers'.
#[derive(Clone)]
struct Identity {
    provider: Arc<CryptoProvider>,
    chain: Vec<CertificateDer<'static>>,
    shown: Arc<SingleCertAndKey>,
    clients: Arc<dyn ClientCertVerifier>,
    servers: Arc<dyn ServerCertVerifier>,
    /// ALPN protocols of incoming and of outgoing connections.
    comes: Vec<u8>,
    goes: Vec<u8>,
}

impl Identity {
    fn server(&self, verifier: Arc<dyn ClientCertVerifier>) -> Result<QuicServerConfig, Unusable> {
        let server = rustls::ServerConfig::builder_with_provider(Arc::clone(&self.provider));
        let server = server.with_protocol_versions(&VERSIONS)?.with_client_cert_verifier(verifier);
        let mut server = server.with_cert_resolver(Arc::<SingleCertAndKey>::clone(&self.shown));
        server.alpn_protocols = vec![self.comes.clone()];
        // Every connection presents its certificate: no session resumption, no early data.
        server.send_tls13_tickets = 0;
        server.max_early_data_size = 0;
        Ok(QuicServerConfig::try_from(server)?)
    }

    fn client(&self, verifier: Arc<dyn ServerCertVerifier>) -> Result<QuicClientConfig, Unusable> {
        let client = rustls::ClientConfig::builder_with_provider(Arc::clone(&self.provider));
        let client = client.with_protocol_versions(&VERSIONS)?;
        let client = client.dangerous().with_custom_certificate_verifier(verifier);
        let mut client = client.with_client_cert_resolver(Arc::<SingleCertAndKey>::clone(&self.shown));
        client.alpn_protocols = vec![self.goes.clone()];
        client.resumption = Resumption::disabled();
        Ok(QuicClientConfig::try_from(client)?)
    }
}

/// The ALPN protocol (RFC 7301): robot name and side of the connecting machine. Connections between different
/// robots or between two machines of one side fail in the handshake.
pub(crate) fn protocol(robot: &RobotName, side: Side) -> Vec<u8> {
    let side = if side == Side::Remote { "remote" } else { "robot" };
    format!("leo-link/{}/{side}", robot.as_str()).into_bytes()
}

fn transport() -> TransportConfig {
    let mut transport = TransportConfig::default();
    transport
        .max_idle_timeout(Some(IdleTimeout::from(VarInt::from_u32(SILENT_MS))))
        .keep_alive_interval(Some(KEEP_ALIVE))
        .crypto_buffer_size(MAX_HANDSHAKE_BYTES)
        // No streams until the peer has proven to be compatible: see `accept_bundles`.
        .max_concurrent_uni_streams(VarInt::from_u32(0))
        .max_concurrent_bidi_streams(VarInt::from_u32(0))
        .stream_receive_window(VarInt::from_u32(UNDER_WAY))
        .receive_window(VarInt::from_u32(UNDER_WAY))
        .send_window(u64::from(UNDER_WAY))
        .datagram_send_buffer_size(PULSES)
        .datagram_receive_buffer_size(Some(PULSES))
        .congestion_controller_factory(Arc::new(WithFloor::default()));
    transport
}

/// Allows the peer one unidirectional stream for batches.
pub(crate) fn accept_bundles(connection: &Connection) {
    connection.set_max_concurrent_uni_streams(VarInt::from_u32(1));
}

/// Whether the peer's certificate has expired. The handshake checks this only once.
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
    use crate::io::net::tests::certificates::{everybody_or_skip, shown};

    #[test]
    fn a_certificate_is_good_for_as_long_as_it_says() {
        const DAY_S: u64 = 24 * 60 * 60;
        let Some(keys) = everybody_or_skip() else { return };
        let now = UnixTime::now();
        let after = |days: u64| UnixTime::since_unix_epoch(Duration::from_secs(now.as_secs() + days * DAY_S));
        let good =
            |name, days| shown(keys.path(), name).0.iter().all(|shown| is_good_until(shown, after(days)));
        // Validity: nine days, 825 days, and until yesterday.
        assert_eq!([0, 8, 10].map(|days| good("any", days)), [true, true, false]);
        assert_eq!([0, 824, 826].map(|days| good("robot", days)), [true, true, false]);
        assert!(!good("expired", 0));
    }

    #[test]
    fn a_defect_of_the_own_certificate_is_reported_before_any_refusal() {
        let Some(keys) = everybody_or_skip() else { return };
        let mut link = config::Robot::load(None).unwrap().leo.link;
        link.ca_certificate = keys.path().join("authority.pem");
        let here = vec!["quic/127.0.0.1:1".to_owned().try_into().unwrap()];
        let nowhere = Vec::new();
        let mut told = |name: &str, listen: &Vec<_>, connect: &Vec<_>| {
            (link.listen, link.connect) = (listen.clone(), connect.clone());
            link.certificate = keys.path().join(format!("{name}.pem"));
            link.private_key = keys.path().join(format!("{name}.key"));
            Keys::read(&link).unwrap().own_refusal(&link, UnixTime::now())
        };
        for name in ["robot", "any", "remote"] {
            assert_eq!(told(name, &here, &here), None, "{name}");
        }
        // Certificates for one role only.
        assert_eq!((told("server", &here, &nowhere), told("client", &nowhere, &here)), (None, None));
        for (name, listen, connect, why) in [
            ("expired", &here, &nowhere, "it expired on"),
            ("expired", &nowhere, &here, "it expired on"),
            ("stranger", &here, &here, "its issuer has the name of the authority of this machine"),
            ("authority", &here, &here, "it is the certificate of an authority"),
            ("server", &here, &here, "its extendedKeyUsage does not allow"),
            ("client", &here, &here, "its extendedKeyUsage does not allow"),
        ] {
            let told = told(name, listen, connect).unwrap();
            assert!(told.contains(&format!("{name}.pem")) && told.contains(why), "{name}: {told}");
        }
    }

    #[test]
    fn a_file_that_holds_no_key_is_named() {
        let Some(keys) = everybody_or_skip() else { return };
        let mut link = config::Robot::load(None).unwrap().leo.link;
        link.ca_certificate = keys.path().join("authority.pem");
        link.certificate = keys.path().join("robot.pem");
        link.private_key = keys.path().join("robot.pem");
        let told = Keys::read(&link).err().unwrap().to_string();
        assert!(told.contains("`private_key` of [link]") && told.contains("robot.pem"), "{told}");
        // The key of another certificate.
        link.private_key = keys.path().join("any.key");
        assert!(Keys::read(&link).err().unwrap().to_string().contains("`certificate` of [link]"));
    }
}
