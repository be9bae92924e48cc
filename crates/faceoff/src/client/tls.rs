//! Trusted certificate authorities: the machine's, and those of a file that the user names.

use anyhow::{Context, ensure};
use rustls::{
    ClientConfig, RootCertStore,
    pki_types::{CertificateDer, pem::PemObject},
};
use std::{io, path::Path};

/// The configuration for servers without TLS: it trusts no authority.
pub fn plain_client_config() -> ClientConfig {
    with_roots(RootCertStore::empty())
}

/// The configuration for servers with TLS. It trusts the authorities of the machine (`SSL_CERT_FILE` and
/// `SSL_CERT_DIR`, if set) and of `ca_file`.
///
/// # Errors
/// If `ca_file` has no certificate, or neither source has an authority.
pub fn tls_client_config(ca_file: Option<&Path>) -> anyhow::Result<ClientConfig> {
    let mut roots = RootCertStore::empty();
    if let Some(file) = ca_file {
        let reading = || format!("reading the certificate authorities of {}", file.display());
        let pem = std::fs::read(file).with_context(reading)?;
        let certificates = CertificateDer::pem_slice_iter(&pem)
            .collect::<Result<Vec<_>, _>>()
            .with_context(reading)?;
        ensure!(
            !certificates.is_empty(),
            "{} has no certificate; expected PEM, which begins with -----BEGIN CERTIFICATE-----",
            file.display()
        );
        for certificate in certificates {
            roots.add(certificate).with_context(reading)?;
        }
    }
    let found = rustls_native_certs::load_native_certs();
    // A machine has hundreds of certificates; a few that cannot be parsed do not spoil the rest.
    roots.add_parsable_certificates(found.certs);
    let cause = match found.errors.first() {
        Some(error) => format!(" ({error})"),
        None => String::new(),
    };
    ensure!(
        !roots.is_empty(),
        "this machine has no certificate authorities to verify a TLS server with{cause}: install the package \
        ca-certificates, or name a file with --ca-file or FACEOFF_CA_FILE"
    );
    Ok(with_roots(roots))
}

fn with_roots(roots: RootCertStore) -> ClientConfig {
    ClientConfig::builder()
        .with_root_certificates(roots)
        .with_no_client_auth()
}

/// Advice for an error that TLS has caused.
pub(super) fn advice(error: &anyhow::Error) -> Option<&'static str> {
    use rustls::{CertificateError, Error};
    let tls_error = error.chain().find_map(find_tls_error)?;
    Some(match tls_error {
        // Another authority with the same name gives a bad signature.
        Error::InvalidCertificate(
            CertificateError::UnknownIssuer | CertificateError::BadSignature,
        ) => {
            "the server's certificate is signed by an unknown authority; if your organisers run their own authority, \
            name its file (PEM) with --ca-file or FACEOFF_CA_FILE"
        }
        Error::InvalidCertificate(
            CertificateError::NotValidForName | CertificateError::NotValidForNameContext { .. },
        ) => "the server's certificate belongs to another host; is the address right?",
        Error::InvalidCertificate(
            CertificateError::Expired
            | CertificateError::ExpiredContext { .. }
            | CertificateError::NotValidYet
            | CertificateError::NotValidYetContext { .. },
        ) => {
            "the server's certificate has expired or is not valid yet, or this machine's clock is wrong; ask the organisers"
        }
        Error::InvalidMessage(_) => {
            "if the server does not use TLS, its address begins with http://"
        }
        _ => "the TLS connection failed; ask the organisers which certificate the server has",
    })
}

/// The TLS error inside any number of I/O errors.
fn find_tls_error<'a>(cause: &'a (dyn std::error::Error + 'static)) -> Option<&'a rustls::Error> {
    match cause.downcast_ref::<io::Error>() {
        Some(wrapped) => find_tls_error(wrapped.get_ref()?),
        None => cause.downcast_ref(),
    }
}
