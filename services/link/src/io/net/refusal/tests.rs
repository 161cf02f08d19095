use quinn::{ApplicationClose, ConnectionClose};
use rustls::pki_types::CertificateDer;
use rustls::pki_types::pem::PemObject as _;

use super::*;
use crate::io::net::tests::certificates::everybody_or_skip;

fn files() -> KeyFiles {
    KeyFiles { authority: "authority.pem".to_owned(), certificate: "remote.pem".to_owned() }
}

fn ended_by(alert: AlertDescription) -> ConnectionError {
    let error_code = quinn_proto::TransportErrorCode::crypto(alert.into());
    ConnectionError::ConnectionClosed(ConnectionClose {
        error_code,
        frame_type: None,
        reason: bytes::Bytes::new(),
    })
}

#[test]
fn each_tls_alert_names_the_own_certificate_and_what_to_do() {
    let table = [
        (AlertDescription::CertificateExpired, "clocks"),
        (AlertDescription::UnknownCA, "package/link_keys.sh"),
        (AlertDescription::DecryptError, "package/link_keys.sh"),
        (AlertDescription::UnsupportedCertificate, "package/link_keys.sh"),
        (AlertDescription::BadCertificate, "`connect`"),
        (AlertDescription::CertificateUnknown, "package/link_keys.sh"),
        (AlertDescription::CertificateRequired, "package/link_keys.sh"),
    ];
    let mut wording = String::new();
    for (alert, what_to_do) in table {
        let ended = ended_by(alert);
        assert!(KeyFiles::is_refusal(&ended), "{alert:?}");
        let told = files().explain("robot.local", &RefusalRecord::default(), &ended);
        assert!(told.starts_with("robot.local ") && told.contains("remote.pem"), "{told}");
        assert!(told.contains(what_to_do), "{alert:?}: {told}");
        wording += &format!("{alert:?}\n    {told}\n");
    }
    let other = files().explain(
        "robot.local",
        &RefusalRecord::default(),
        &ended_by(AlertDescription::NoApplicationProtocol),
    );
    assert!(other.contains("`robot` in [link]"), "{other}");
    insta::assert_snapshot!(wording + &other);
}

#[test]
fn a_machine_that_does_not_answer_is_named_with_what_to_do() {
    let told =
        files().explain("quic/robot.local:7447", &RefusalRecord::default(), &ConnectionError::TimedOut);
    assert!(told.contains("quic/robot.local:7447"), "{told}");
    insta::assert_snapshot!(told);
}

#[test]
fn a_certificate_that_expires_while_connected_is_named_on_both_sides() {
    let close = ApplicationClose { error_code: EXPIRED, reason: bytes::Bytes::new() };
    let ended = ConnectionError::ApplicationClosed(close);
    assert!(KeyFiles::is_refusal(&ended));
    let there = files().explain("robot.local", &RefusalRecord::default(), &ended);
    let here = KeyFiles::expired("192.0.2.7");
    assert!(there.contains("remote.pem") && here.contains("192.0.2.7"), "{there}\n{here}");
    insta::assert_snapshot!(format!("{there}\n{here}"));
}

#[test]
fn the_names_of_a_certificate_are_printed_without_control_characters() {
    assert_eq!(printable("CN=a\u{1b}[2Jb"), "CN=a?[2Jb");
    assert_eq!(printable(&"x".repeat(9_999)).len(), MAX_NAME);
    let Some(keys) = everybody_or_skip() else { return };
    let read = |name: &str| CertificateDer::from_pem_file(keys.path().join(name)).unwrap();
    let (robot, authority) = (read("robot.pem"), read("authority.pem"));
    let parse = |der: &[u8]| name(&parse_x509_certificate(der).unwrap().1);
    assert_eq!(parse(&robot), "CN=robot, issued by CN=the authority of a link of Leo");
    assert!(is_self_signed(&parse_x509_certificate(&authority).unwrap().1));
    assert!(!is_self_signed(&parse_x509_certificate(&robot).unwrap().1));
}

#[test]
fn a_certificate_with_any_byte_changed_is_reported_without_a_panic() {
    let Some(keys) = everybody_or_skip() else { return };
    let whole = CertificateDer::from_pem_file(keys.path().join("robot.pem")).unwrap();
    for place in 0..whole.len() {
        for change in [0x01, 0x03, 0x20, 0x7f, 0x80, 0xff] {
            let mut damaged = whole.to_vec();
            damaged[place] ^= change;
            for error in
                [CertificateError::UnknownIssuer, CertificateError::Expired, CertificateError::BadEncoding]
            {
                let certificate = CertificateDer::from(damaged.clone());
                let told =
                    files().explain_refused_peer("192.0.2.7", &RefusedCertificate { certificate, error });
                assert!(
                    told.starts_with("the certificate of 192.0.2.7") && told.contains("link_keys.sh"),
                    "{told}"
                );
                assert!(!told.contains(char::is_control), "{told:?}");
            }
        }
    }
}
