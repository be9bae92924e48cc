//! The client against the real site behind TLS on a loopback port.

use super::*;
use rcgen::{
    BasicConstraints, Certificate, CertificateParams, CertifiedIssuer, DnType, IsCa, KeyPair,
};
use rustls::{
    ServerConfig,
    pki_types::{PrivateKeyDer, PrivatePkcs8KeyDer},
};
use std::{net::SocketAddr, path::PathBuf, sync::Arc};
use tokio::net::{TcpListener, TcpStream};
use tokio_rustls::TlsAcceptor;

/// An authority of this name.
fn authority(name: &str) -> CertifiedIssuer<'static, KeyPair> {
    let mut params = CertificateParams::default();
    params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
    params.distinguished_name.push(DnType::CommonName, name);
    CertifiedIssuer::self_signed(params, KeyPair::generate().unwrap()).unwrap()
}

/// What stands before a server and takes TLS off, with a certificate for this name; where.
async fn behind_tls(
    site: &Site,
    authority: &CertifiedIssuer<'static, KeyPair>,
    name: &str,
) -> SocketAddr {
    let key = KeyPair::generate().unwrap();
    let params = CertificateParams::new([name.to_owned()]).unwrap();
    let certificate = params.signed_by(&key, authority).unwrap();
    with_certificate(site, &certificate, &key).await
}

async fn with_certificate(site: &Site, certificate: &Certificate, key: &KeyPair) -> SocketAddr {
    let key = PrivateKeyDer::Pkcs8(PrivatePkcs8KeyDer::from(key.serialize_der()));
    let config = ServerConfig::builder()
        .with_no_client_auth()
        .with_single_cert(vec![certificate.der().clone()], key)
        .unwrap();
    let acceptor = TlsAcceptor::from(Arc::new(config));
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let at = listener.local_addr().unwrap();
    let url = reqwest::Url::parse(&site.url).unwrap();
    let server = format!("127.0.0.1:{}", url.port().unwrap());
    tokio::spawn(async move {
        while let Ok((connection, _)) = listener.accept().await {
            let (acceptor, server) = (acceptor.clone(), server.clone());
            tokio::spawn(async move {
                // Whoever does not believe the certificate goes.
                let Ok(mut plain) = acceptor.accept(connection).await else {
                    return;
                };
                let mut server = TcpStream::connect(server).await.unwrap();
                let _ = tokio::io::copy_bidirectional(&mut plain, &mut server).await;
            });
        }
    });
    at
}

fn file_of(site: &Site, authority: &CertifiedIssuer<'static, KeyPair>) -> PathBuf {
    let file = site.folder.path().join("ca.pem");
    std::fs::write(&file, authority.pem()).unwrap();
    file
}

async fn refusal(client: &Client) -> String {
    format!("{:#}", client.season().await.unwrap_err())
}

#[tokio::test]
async fn a_server_behind_tls_is_believed_by_whose_authority_is_named() {
    let site = site(1 << 20).await;
    let authority = authority("ours");
    let at = behind_tls(&site, &authority, "localhost").await;
    let ca_file = file_of(&site, &authority);
    let url = format!("https://localhost:{}/", at.port());
    let client = Client::new(&url, Some(ADMIN), Some(&ca_file)).unwrap();
    client.health().await.unwrap();
    // Bodies of both directions, by a token.
    let team = client.create_team("Alpha").await.unwrap();
    let uploaded = client.with_token(&team.token).upload(&bundle(&site)).await;
    let uploaded = uploaded.unwrap();
    let again = site.folder.path().join("again.tar.gz");
    let bar = ProgressBar::hidden();
    let done = client
        .download_submission(uploaded.id, &again, &uploaded.blake3, &bar)
        .await;
    assert_eq!(done.unwrap().bytes, uploaded.bytes);
}

#[tokio::test]
async fn a_certificate_that_has_signed_itself_is_believed_where_it_is_named() {
    let site = site(64).await;
    let key = KeyPair::generate().unwrap();
    let params = CertificateParams::new(["localhost".to_owned()]).unwrap();
    let certificate = params.self_signed(&key).unwrap();
    let at = with_certificate(&site, &certificate, &key).await;
    let file = site.folder.path().join("own.pem");
    std::fs::write(&file, certificate.pem()).unwrap();
    let url = format!("https://localhost:{}", at.port());
    let client = Client::new(&url, None, Some(&file)).unwrap();
    client.health().await.unwrap();
}

#[tokio::test]
async fn a_server_behind_tls_that_cannot_be_known_gets_no_token() {
    let site = site(64).await;
    let (ours, theirs) = (authority("ours"), authority("theirs"));
    let ca_file = file_of(&site, &ours);
    let unknown = behind_tls(&site, &theirs, "localhost").await;
    let url = format!("https://localhost:{}", unknown.port());
    let refused = refusal(&Client::new(&url, Some(ADMIN), Some(&ca_file)).unwrap()).await;
    for words in [url.as_str(), "no authority", "--ca-file", "UnknownIssuer"] {
        assert!(refused.contains(words), "{refused}");
    }

    // An authority that calls itself like ours.
    let pretended = behind_tls(&site, &authority("ours"), "localhost").await;
    let url = format!("https://localhost:{}", pretended.port());
    let refused = refusal(&Client::new(&url, Some(ADMIN), Some(&ca_file)).unwrap()).await;
    assert!(refused.contains("no authority"), "{refused}");

    let another = behind_tls(&site, &ours, "faceoff.example.org").await;
    let url = format!("https://localhost:{}", another.port());
    let refused = refusal(&Client::new(&url, Some(ADMIN), Some(&ca_file)).unwrap()).await;
    assert!(refused.contains("another host's"), "{refused}");

    // The same server without TLS.
    let plain = site.url.replace("http://", "https://");
    let refused = refusal(&Client::new(&plain, Some(ADMIN), Some(&ca_file)).unwrap()).await;
    assert!(refused.contains("begins with http://"), "{refused}");
}

#[tokio::test]
async fn a_file_without_a_certificate_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |file: &Path| {
        let error = Client::new("https://localhost", None, Some(file)).unwrap_err();
        format!("{error:#}")
    };
    let file = folder.path().join("ca.pem");
    assert!(refused(&file).contains("reading the certificate authorities of"));
    std::fs::write(&file, "nothing of that kind\n").unwrap();
    assert!(refused(&file).contains("has no certificate"));
}
