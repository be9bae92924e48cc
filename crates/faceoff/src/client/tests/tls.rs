//! The client against a real server with TLS on a loopback port.

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

fn authority(name: &str) -> CertifiedIssuer<'static, KeyPair> {
    let mut params = CertificateParams::default();
    params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
    params.distinguished_name.push(DnType::CommonName, name);
    CertifiedIssuer::self_signed(params, KeyPair::generate().unwrap()).unwrap()
}

/// Starts a TLS proxy with a certificate for `name`; returns its address.
async fn start_tls_proxy(
    site: &Site,
    authority: &CertifiedIssuer<'static, KeyPair>,
    name: &str,
) -> SocketAddr {
    let key = KeyPair::generate().unwrap();
    let params = CertificateParams::new([name.to_owned()]).unwrap();
    let certificate = params.signed_by(&key, authority).unwrap();
    start_proxy_with(site, &certificate, &key).await
}

async fn start_proxy_with(site: &Site, certificate: &Certificate, key: &KeyPair) -> SocketAddr {
    let key = PrivateKeyDer::Pkcs8(PrivatePkcs8KeyDer::from(key.serialize_der()));
    let config = ServerConfig::builder()
        .with_no_client_auth()
        .with_single_cert(vec![certificate.der().clone()], key)
        .unwrap();
    let acceptor = TlsAcceptor::from(Arc::new(config));
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let url = reqwest::Url::parse(&site.url).unwrap();
    let server = format!("127.0.0.1:{}", url.port().unwrap());
    tokio::spawn(async move {
        while let Ok((connection, _)) = listener.accept().await {
            let (acceptor, server) = (acceptor.clone(), server.clone());
            tokio::spawn(async move {
                // A client that does not trust the certificate closes the connection.
                let Ok(mut plain) = acceptor.accept(connection).await else {
                    return;
                };
                let mut server = TcpStream::connect(server).await.unwrap();
                let _ = tokio::io::copy_bidirectional(&mut plain, &mut server).await;
            });
        }
    });
    address
}

fn write_ca_file(site: &Site, authority: &CertifiedIssuer<'static, KeyPair>) -> PathBuf {
    let file = site.folder.path().join("ca.pem");
    std::fs::write(&file, authority.pem()).unwrap();
    file
}

async fn refusal(client: &Client) -> String {
    format!("{:#}", client.season().await.unwrap_err())
}

#[tokio::test]
async fn server_certified_by_the_given_authority_is_trusted() {
    let site = start_site(BUNDLE_BYTES).await;
    let authority = authority("ours");
    let address = start_tls_proxy(&site, &authority, "localhost").await;
    let ca_file = write_ca_file(&site, &authority);
    let url = format!("https://localhost:{}/", address.port());
    let client = Client::new(&url, Some(ADMIN), Some(&ca_file)).unwrap();
    client.health().await.unwrap();
    // Request and response bodies pass through TLS.
    let team = client.create_team("Alpha").await.unwrap();
    let uploaded = client
        .with_token(&team.token)
        .upload(&create_bundle(&site))
        .await;
    let uploaded = uploaded.unwrap();
    let copy = site.folder.path().join("copy.tar.gz");
    let bar = ProgressBar::hidden();
    let done = client
        .download_submission(uploaded.id, &copy, &uploaded.blake3, &bar)
        .await;
    assert_eq!(done.unwrap().bytes, uploaded.bytes);
}

#[tokio::test]
async fn self_signed_certificate_is_trusted_if_given() {
    let site = start_site(SMALL_BUNDLE_BYTES).await;
    let key = KeyPair::generate().unwrap();
    let params = CertificateParams::new(["localhost".to_owned()]).unwrap();
    let certificate = params.self_signed(&key).unwrap();
    let address = start_proxy_with(&site, &certificate, &key).await;
    let file = site.folder.path().join("own.pem");
    std::fs::write(&file, certificate.pem()).unwrap();
    let url = format!("https://localhost:{}", address.port());
    let client = Client::new(&url, None, Some(&file)).unwrap();
    client.health().await.unwrap();
}

#[tokio::test]
async fn untrusted_tls_server_gets_no_token() {
    let site = start_site(SMALL_BUNDLE_BYTES).await;
    let (trusted, other) = (authority("trusted"), authority("other"));
    let ca_file = write_ca_file(&site, &trusted);
    let unknown = start_tls_proxy(&site, &other, "localhost").await;
    let url = format!("https://localhost:{}", unknown.port());
    let refused = refusal(&Client::new(&url, Some(ADMIN), Some(&ca_file)).unwrap()).await;
    for words in [
        url.as_str(),
        "unknown authority",
        "--ca-file",
        "UnknownIssuer",
    ] {
        assert!(refused.contains(words), "{refused}");
    }

    // An authority with the name of the trusted one, but with another key.
    let impostor = start_tls_proxy(&site, &authority("trusted"), "localhost").await;
    let url = format!("https://localhost:{}", impostor.port());
    let refused = refusal(&Client::new(&url, Some(ADMIN), Some(&ca_file)).unwrap()).await;
    assert!(refused.contains("unknown authority"), "{refused}");

    let other_host = start_tls_proxy(&site, &trusted, "faceoff.example.org").await;
    let url = format!("https://localhost:{}", other_host.port());
    let refused = refusal(&Client::new(&url, Some(ADMIN), Some(&ca_file)).unwrap()).await;
    assert!(refused.contains("another host"), "{refused}");

    // A server without TLS, at an address that begins with https.
    let without_tls = site.url.replace("http://", "https://");
    let refused = refusal(&Client::new(&without_tls, Some(ADMIN), Some(&ca_file)).unwrap()).await;
    assert!(refused.contains("begins with http://"), "{refused}");
}

#[tokio::test]
async fn ca_file_without_a_certificate_is_refused() {
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
