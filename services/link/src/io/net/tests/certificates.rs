//! Certificates: which peers are accepted and which servers are trusted, tested with plain QUIC endpoints.

use std::net::{Ipv4Addr, SocketAddr};
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::time::Duration;

use config::Robot;
use config::leo::{Link, Side};
use quinn::crypto::rustls::{QuicClientConfig, QuicServerConfig};
use quinn::{ConnectionError, Endpoint};
use rustls::pki_types::pem::PemObject as _;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use rustls::server::WebPkiClientVerifier;
use rustls::{ClientConfig, RootCertStore, ServerConfig};
use tempfile::TempDir;
use tokio::task::JoinSet;
use tokio::time::timeout;

use crate::io::net::keys::protocol;
use crate::io::net::tests::compatibility;
use crate::io::net::{MessageKind, Net};

/// A certificate of the tests.
#[derive(Clone, Copy, Debug)]
struct Shown {
    /// Description for messages.
    what: &'static str,
    /// File name without its suffix.
    file: &'static str,
    /// Whether a listening machine accepts a client with it.
    is_let_in: bool,
    /// Whether a connecting machine accepts a server with it.
    is_believed: bool,
}

/// All but `stranger` are signed by one authority. Servers are addressed as `localhost`.
const SHOWN: [Shown; 8] = [
    Shown { what: "as the script makes it", file: "robot", is_let_in: true, is_believed: true },
    Shown { what: "another authority's", file: "stranger", is_let_in: false, is_believed: false },
    Shown { what: "expired", file: "expired", is_let_in: false, is_believed: false },
    Shown { what: "the authority's own", file: "authority", is_let_in: false, is_believed: false },
    Shown { what: "for servers alone", file: "server", is_let_in: false, is_believed: true },
    Shown { what: "for clients alone", file: "client", is_let_in: true, is_believed: false },
    Shown { what: "for no purpose in particular", file: "any", is_let_in: true, is_believed: true },
    // A client's name is not checked, only a server's.
    Shown { what: "with another name", file: "remote", is_let_in: true, is_believed: false },
];

/// Offset of TLS alerts among the QUIC error codes (RFC 9001, 4.8).
const ALERT: u64 = 0x100;
/// The alert for a client without a certificate (RFC 8446, 6).
const CERTIFICATE_REQUIRED: u64 = 116;
/// Generous: the machine may be loaded.
const MAX_WAIT: Duration = Duration::from_secs(90);

/// Creates keys for two machines as docs/more_than_one_machine.md describes.
fn keys() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../package/link_keys.sh");
    let made = Command::new(script)
        .arg(folder.path())
        .args(["robot=DNS:localhost", "remote=DNS:desk.local"])
        .status()
        .unwrap();
    assert!(made.success());
    folder
}

/// Signs a certificate for `localhost` with these extensions, valid for `days` days.
fn sign(folder: &Path, name: &str, extensions: &str, days: &str) {
    let extensions = format!("subjectAltName=DNS:localhost\n{extensions}");
    std::fs::write(folder.join("extensions"), extensions).unwrap();
    let (pem, private) = (format!("{name}.pem"), format!("{name}.key"));
    let request = format!(
        "req -new -newkey ec -pkeyopt ec_paramgen_curve:P-256 -noenc -subj /CN=some -keyout {private} -out request"
    );
    let signed = format!(
        "x509 -req -in request -CA authority.pem -CAkey authority.key -days {days} -extfile extensions -out {pem}"
    );
    for arguments in [request, signed] {
        let made = Command::new("openssl").args(arguments.split(' ')).current_dir(folder).output().unwrap();
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    }
}

/// The keys of everybody who is shown, in one folder; `None`, with a word why, where openssl is not there.
pub(in crate::io::net) fn everybody_or_skip() -> Option<TempDir> {
    if let Err(error) = Command::new("openssl").arg("version").output() {
        skip::skip(format_args!("the keys of a link are made with openssl: {error}"));
        return None;
    }
    let (ours, theirs) = (keys(), keys());
    let folder = ours.path();
    sign(folder, "expired", "extendedKeyUsage=serverAuth,clientAuth", "-1");
    sign(folder, "server", "extendedKeyUsage=serverAuth", "9");
    sign(folder, "client", "extendedKeyUsage=clientAuth", "9");
    sign(folder, "any", "", "9");
    for ending in ["pem", "key"] {
        let from = theirs.path().join(format!("robot.{ending}"));
        std::fs::copy(from, folder.join(format!("stranger.{ending}"))).unwrap();
    }
    Some(ours)
}

fn authority(folder: &Path) -> Arc<RootCertStore> {
    let mut store = RootCertStore::empty();
    store.add(CertificateDer::from_pem_file(folder.join("authority.pem")).unwrap()).unwrap();
    Arc::new(store)
}

pub(in crate::io::net) fn shown(
    folder: &Path,
    name: &str,
) -> (Vec<CertificateDer<'static>>, PrivateKeyDer<'static>) {
    let certificate = CertificateDer::from_pem_file(folder.join(format!("{name}.pem"))).unwrap();
    (vec![certificate], PrivateKeyDer::from_pem_file(folder.join(format!("{name}.key"))).unwrap())
}

/// The ALPN protocol for a connecting machine on this side.
fn spoken(side: Side) -> Vec<u8> {
    protocol(&Robot::load(None).unwrap().leo.link.robot, side)
}

/// A server with a certificate; returns its port too.
fn server(folder: &Path, name: &str) -> (Endpoint, u16) {
    let verifier = WebPkiClientVerifier::builder(authority(folder)).build().unwrap();
    let (chain, key) = shown(folder, name);
    let tls = ServerConfig::builder().with_client_cert_verifier(verifier);
    let mut tls = tls.with_single_cert(chain, key).unwrap();
    tls.alpn_protocols = vec![spoken(Side::Robot)];
    let crypto = QuicServerConfig::try_from(tls).unwrap();
    let at = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
    let endpoint = Endpoint::server(quinn::ServerConfig::with_crypto(Arc::new(crypto)), at).unwrap();
    let port = endpoint.local_addr().unwrap().port();
    (endpoint, port)
}

/// A client with a certificate, or without one.
pub(super) fn client(folder: &Path, name: Option<&str>) -> Endpoint {
    let tls = ClientConfig::builder().with_root_certificates(authority(folder));
    let mut tls = match name.map(|name| shown(folder, name)) {
        Some((chain, key)) => tls.with_client_auth_cert(chain, key).unwrap(),
        None => tls.with_no_client_auth(),
    };
    tls.alpn_protocols = vec![spoken(Side::Remote)];
    let crypto = QuicClientConfig::try_from(tls).unwrap();
    let mut endpoint = Endpoint::client(SocketAddr::from((Ipv4Addr::LOCALHOST, 0))).unwrap();
    endpoint.set_default_client_config(quinn::ClientConfig::new(Arc::new(crypto)));
    endpoint
}

/// The TLS alert that ended a connection.
fn alert(ended: &ConnectionError) -> u64 {
    let ConnectionError::ConnectionClosed(close) = ended else { panic!("it ended otherwise: {ended}") };
    u64::from(close.error_code).checked_sub(ALERT).expect("an alert")
}

/// A robot's link with the key `robot`.
fn link(folder: &Path, listen: &str, connect: Vec<String>) -> Link {
    let mut link = Robot::load(None).unwrap().leo.link;
    link.side = Side::Robot;
    link.listen = vec![listen.to_owned().try_into().unwrap()];
    link.connect = connect.into_iter().map(|endpoint| endpoint.try_into().unwrap()).collect();
    link.ca_certificate = folder.join("authority.pem");
    link.certificate = folder.join("robot.pem");
    link.private_key = folder.join("robot.key");
    link
}

/// An unused port.
pub(super) fn free_port() -> u16 {
    std::net::UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap().local_addr().unwrap().port()
}

/// Runs a future with a time-out of `MAX_WAIT`.
pub(super) fn within<T>(what: impl Future<Output = T>) -> T {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async { timeout(MAX_WAIT, what).await }).expect("it ends in time")
}

#[test]
fn a_peer_is_accepted_only_with_its_own_certificate_of_the_authority() {
    let Some(keys) = everybody_or_skip() else { return };
    let folder = keys.path();
    within(async {
        let servers = SHOWN.map(|shown| (shown, server(folder, shown.file)));
        let everywhere = servers.iter().map(|(_, (_, port))| format!("quic/localhost:{port}")).collect();
        let net = Net::start(
            &link(folder, &format!("quic/127.0.0.1:{}", free_port()), everywhere),
            compatibility(),
        )
        .unwrap();
        let mut comers = JoinSet::new();
        for (shown, (endpoint, _)) in servers {
            comers.spawn(async move {
                let comes = endpoint.accept().await.unwrap().accept().unwrap().await;
                (shown, comes.map(drop).map_err(|ended| alert(&ended)))
            });
        }
        while let Some(comer) = comers.join_next().await {
            let (Shown { what, is_believed, .. }, came) = comer.unwrap();
            match came {
                Ok(()) => assert!(is_believed, "{what}"),
                Err(alert) => assert!(!is_believed, "{what}: {alert}"),
            }
        }
        assert!(!net.is_over());
    });
}

#[test]
fn a_certificate_admits_only_the_machine_it_was_issued_for() {
    let Some(keys) = everybody_or_skip() else { return };
    let folder = keys.path();
    let at = SocketAddr::from((Ipv4Addr::LOCALHOST, free_port()));
    let net = Net::start(&link(folder, &format!("quic/{at}"), Vec::new()), compatibility()).unwrap();
    within(async {
        let mut comers = JoinSet::new();
        let all = SHOWN.iter().map(|shown| Some(*shown)).chain([None]);
        for shown in all {
            let endpoint = client(folder, shown.map(|shown| shown.file));
            comers.spawn(async move {
                // QUIC repeats the first packet until the machine listens.
                let ended = match endpoint.connect(at, "localhost").unwrap().await {
                    // An accepted client gets messages; a refused one gets an alert.
                    Ok(connection) => connection.read_datagram().await.map(drop),
                    Err(ended) => Err(ended),
                };
                (shown, ended.map_err(|ended| alert(&ended)))
            });
        }
        let mut left = SHOWN.len() + 1;
        while left > 0 {
            net.send(MessageKind::Heartbeat, b"hello".to_vec());
            let Ok(comer) = timeout(Duration::from_millis(20), comers.join_next()).await else { continue };
            left -= 1;
            match comer.unwrap().unwrap() {
                (Some(Shown { what, is_let_in, .. }), came) => {
                    assert_eq!(came.is_ok(), is_let_in, "{what}: {came:?}");
                }
                // A client without a certificate gets the matching alert.
                (None, came) => assert_eq!(came, Err(CERTIFICATE_REQUIRED)),
            }
        }
    });
    assert!(!net.is_over());
    assert!(net.receive().is_none(), "to be let in is not to be heard: none of them said a word of a link");
}
