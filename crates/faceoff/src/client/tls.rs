//! Whom to believe that they are the server: the machine's certificate authorities, and one that the user names.

use anyhow::{Context, ensure};
use rustls::{
    ClientConfig, RootCertStore,
    pki_types::{CertificateDer, pem::PemObject},
};
use std::{io, path::Path};

/// For servers without TLS: nobody is believed, and nobody asked.
pub fn none() -> ClientConfig {
    config(RootCertStore::empty())
}

/// For servers behind TLS: the machine's authorities (those of `SSL_CERT_FILE` and `SSL_CERT_DIR`, where these are set)
/// and those of `ca_file`.
///
/// # Errors
/// If that file has none, or there is none at all.
pub fn trusting(ca_file: Option<&Path>) -> anyhow::Result<ClientConfig> {
    let mut roots = RootCertStore::empty();
    if let Some(file) = ca_file {
        let reading = || format!("reading the certificate authorities of {}", file.display());
        let pem = std::fs::read(file).with_context(reading)?;
        let named = CertificateDer::pem_slice_iter(&pem)
            .collect::<Result<Vec<_>, _>>()
            .with_context(reading)?;
        ensure!(
            !named.is_empty(),
            "{} has no certificate; expected PEM, which begins with -----BEGIN CERTIFICATE-----",
            file.display()
        );
        for certificate in named {
            roots.add(certificate).with_context(reading)?;
        }
    }
    let found = rustls_native_certs::load_native_certs();
    // Of a machine's hundreds a few that are not understood are no reason to refuse the others.
    roots.add_parsable_certificates(found.certs);
    let why = match found.errors.first() {
        Some(error) => format!(" ({error})"),
        None => String::new(),
    };
    ensure!(
        !roots.is_empty(),
        "this machine has no certificate authorities by which to know a server behind TLS{why}: install the package \
         ca-certificates, or name a file with --ca-file or FACEOFF_CA_FILE"
    );
    Ok(config(roots))
}

fn config(roots: RootCertStore) -> ClientConfig {
    ClientConfig::builder()
        .with_root_certificates(roots)
        .with_no_client_auth()
}

/// What to do about a connection that TLS has refused, if that is why there is none.
pub(super) fn advice(error: &anyhow::Error) -> Option<&'static str> {
    use rustls::{CertificateError as Bad, Error};
    let refused = error.chain().find_map(inside)?;
    Some(match refused {
        // Of another authority of the same name, too.
        Error::InvalidCertificate(Bad::UnknownIssuer | Bad::BadSignature) => {
            "no authority that this machine knows has signed the server's certificate; if it is your organisers' own, \
             name its file (PEM) with --ca-file or FACEOFF_CA_FILE"
        }
        Error::InvalidCertificate(Bad::NotValidForName | Bad::NotValidForNameContext { .. }) => {
            "the server's certificate is another host's; is the address right?"
        }
        Error::InvalidCertificate(
            Bad::Expired
            | Bad::ExpiredContext { .. }
            | Bad::NotValidYet
            | Bad::NotValidYetContext { .. },
        ) => {
            "the server's certificate is out of date, or this machine's clock is wrong; ask the organisers"
        }
        Error::InvalidMessage(_) => {
            "is it a server without TLS? then its address begins with http://"
        }
        _ => "TLS was refused; ask the organisers which certificate the server has",
    })
}

/// TLS's own error, in however many of input and output it comes.
fn inside<'a>(cause: &'a (dyn std::error::Error + 'static)) -> Option<&'a rustls::Error> {
    match cause.downcast_ref::<io::Error>() {
        Some(wrapped) => inside(wrapped.get_ref()?),
        None => cause.downcast_ref(),
    }
}
