//! Certificate verifiers that record what they refuse.

use std::sync::{Arc, Mutex, PoisonError};

use rustls::client::danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier};
use rustls::pki_types::{CertificateDer, ServerName, UnixTime};
use rustls::server::danger::{ClientCertVerified, ClientCertVerifier};
use rustls::{CertificateError, DigitallySignedStruct, DistinguishedName, Error, SignatureScheme};

/// A refused certificate and the reason.
#[derive(Clone, Debug)]
pub(crate) struct RefusedCertificate {
    pub(crate) certificate: CertificateDer<'static>,
    pub(crate) error: CertificateError,
}

/// The verifier of one connection; it decides as `inner` does and records a refusal.
///
/// rustls reports a refusal as text and drops the certificate, but the link's messages need both.
#[derive(Debug)]
pub(crate) struct RecordingVerifier<V: ?Sized> {
    inner: Arc<V>,
    record: RefusalRecord,
}

/// What the verifier of a connection refused, if anything.
#[derive(Clone, Debug, Default)]
pub(crate) struct RefusalRecord(Arc<Mutex<Option<RefusedCertificate>>>);

impl RefusalRecord {
    pub(crate) fn refused(&self) -> Option<RefusedCertificate> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn keep<T>(&self, certificate: &CertificateDer<'_>, verified: Result<T, Error>) -> Result<T, Error> {
        if let Err(Error::InvalidCertificate(error)) = &verified {
            let refused =
                RefusedCertificate { certificate: certificate.clone().into_owned(), error: error.clone() };
            *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(refused);
        }
        verified
    }
}

impl<V: ?Sized> RecordingVerifier<V> {
    pub(crate) fn new(inner: &Arc<V>) -> (Arc<Self>, RefusalRecord) {
        let record = RefusalRecord::default();
        (Arc::new(Self { inner: Arc::clone(inner), record: record.clone() }), record)
    }
}

/// The methods of a verifier that concern signatures are those of `inner`.
macro_rules! delegate_signatures {
    () => {
        fn verify_tls12_signature(
            &self,
            message: &[u8],
            certificate: &CertificateDer<'_>,
            signature: &DigitallySignedStruct,
        ) -> Result<HandshakeSignatureValid, Error> {
            self.inner.verify_tls12_signature(message, certificate, signature)
        }

        fn verify_tls13_signature(
            &self,
            message: &[u8],
            certificate: &CertificateDer<'_>,
            signature: &DigitallySignedStruct,
        ) -> Result<HandshakeSignatureValid, Error> {
            self.inner.verify_tls13_signature(message, certificate, signature)
        }

        fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
            self.inner.supported_verify_schemes()
        }
    };
}

impl ClientCertVerifier for RecordingVerifier<dyn ClientCertVerifier> {
    fn root_hint_subjects(&self) -> &[DistinguishedName] {
        self.inner.root_hint_subjects()
    }

    fn verify_client_cert(
        &self,
        end_entity: &CertificateDer<'_>,
        intermediates: &[CertificateDer<'_>],
        now: UnixTime,
    ) -> Result<ClientCertVerified, Error> {
        self.record.keep(end_entity, self.inner.verify_client_cert(end_entity, intermediates, now))
    }

    delegate_signatures!();
}

impl ServerCertVerifier for RecordingVerifier<dyn ServerCertVerifier> {
    fn verify_server_cert(
        &self,
        end_entity: &CertificateDer<'_>,
        intermediates: &[CertificateDer<'_>],
        server_name: &ServerName<'_>,
        ocsp_response: &[u8],
        now: UnixTime,
    ) -> Result<ServerCertVerified, Error> {
        let verified =
            self.inner.verify_server_cert(end_entity, intermediates, server_name, ocsp_response, now);
        self.record.keep(end_entity, verified)
    }

    delegate_signatures!();
}
