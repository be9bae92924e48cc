//! Interrupted downloads, against a real server.

use super::*;
use faceoff_api::views::submission::SubmissionView;
use std::path::Path;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::{TcpListener, TcpStream},
};

/// The bundle limit of the servers, more than enough for [`upload_large`].
const LARGE_BUNDLE_BYTES: u64 = 32 << 20;

/// Uploads a submission that is larger than the buffers of a connection; returns its team's client.
async fn upload_large(site: &Site) -> (Client, SubmissionView) {
    let team = site.organiser.create_team("Alpha").await.unwrap();
    let client = site.organiser.with_token(&team.token);
    let folder = create_bundle(site);
    // Pseudorandom bytes, because the bundle is compressed.
    let mut weights = vec![0; 8 << 20];
    blake3::Hasher::new().finalize_xof().fill(&mut weights);
    std::fs::write(folder.join("weights.npz"), weights).unwrap();
    let uploaded = client.upload(&folder).await.unwrap();
    (client, uploaded)
}

async fn download(
    client: &Client,
    submission: &SubmissionView,
    file: &Path,
) -> anyhow::Result<super::super::DownloadedFile> {
    let bar = ProgressBar::hidden();
    client
        .download_submission(submission.id, file, &submission.blake3, &bar)
        .await
}

/// Starts a proxy that closes each connection after `limit` bytes of the response; returns its URL.
async fn start_breaking_proxy(site: &Site, limit: u64) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let url = format!("http://{}", listener.local_addr().unwrap());
    let port = reqwest::Url::parse(&site.url).unwrap().port().unwrap();
    tokio::spawn(async move {
        while let Ok((client, _)) = listener.accept().await {
            let server = TcpStream::connect(("127.0.0.1", port)).await.unwrap();
            tokio::spawn(async move {
                let (mut client_read, mut client_write) = client.into_split();
                let (server_read, mut server_write) = server.into_split();
                let response = tokio::spawn(async move {
                    let mut beginning = server_read.take(limit);
                    let _ = tokio::io::copy(&mut beginning, &mut client_write).await;
                    let _ = client_write.shutdown().await;
                });
                let request = tokio::io::copy(&mut client_read, &mut server_write);
                tokio::select! { _ = request => {}, _ = response => {} }
            });
        }
    });
    url
}

#[tokio::test]
async fn interrupted_download_is_resumed() {
    let site = start_site(LARGE_BUNDLE_BYTES).await;
    let (client, uploaded) = upload_large(&site).await;
    let file = site.folder.path().join("again.tar.gz");
    let token = client.token.clone();
    let proxy = start_breaking_proxy(&site, 1 << 20).await;
    let proxied = Client::new(&proxy, token.as_deref(), None).unwrap();
    let error = download(&proxied, &uploaded, &file).await.unwrap_err();
    let message = format!("{error:#}");
    assert!(
        message.contains("run the same command again to resume it"),
        "{message}"
    );
    assert!(!file.exists());
    let partial_bytes = std::fs::metadata(with_suffix(&file, ".part"))
        .unwrap()
        .len();
    assert!(
        partial_bytes > 0 && partial_bytes < uploaded.bytes,
        "{partial_bytes}"
    );

    let resumed = download(&client, &uploaded, &file).await.unwrap();
    assert_eq!(
        (resumed.resumed_at, resumed.bytes),
        (partial_bytes, uploaded.bytes)
    );
    assert_eq!(
        (resumed.blake3.as_str(), resumed.checked),
        (uploaded.blake3.as_str(), true)
    );
    for suffix in [".part", ".part.etag"] {
        assert!(!with_suffix(&file, suffix).exists(), "{suffix} is left");
    }
}

#[tokio::test]
async fn foreign_partial_file_is_not_resumed() {
    let site = start_site(LARGE_BUNDLE_BYTES).await;
    let (client, uploaded) = upload_large(&site).await;
    let file = site.folder.path().join("again.tar.gz");
    let whole = download(&client, &uploaded, &file).await.unwrap();
    assert_eq!(whole.resumed_at, 0);
    let bytes = std::fs::read(&file).unwrap();
    let tag = format!("\"blake3-{}\"", uploaded.blake3);
    let write_partial_file = |part: &[u8], tag: Option<&str>| {
        std::fs::write(with_suffix(&file, ".part"), part).unwrap();
        match tag {
            Some(tag) => std::fs::write(with_suffix(&file, ".part.etag"), tag).unwrap(),
            None => assert!(!with_suffix(&file, ".part.etag").exists()),
        }
    };
    // Without an ETag, or with that of another file, the download starts at 0.
    write_partial_file(&bytes[..1000], None);
    assert_eq!(
        download(&client, &uploaded, &file)
            .await
            .unwrap()
            .resumed_at,
        0
    );
    write_partial_file(&bytes[..1000], Some("\"blake3-00\""));
    assert_eq!(
        download(&client, &uploaded, &file)
            .await
            .unwrap()
            .resumed_at,
        0
    );
    // The partial file is longer than the file.
    write_partial_file(&[&bytes[..], b"x"].concat(), Some(&tag));
    assert_eq!(
        download(&client, &uploaded, &file)
            .await
            .unwrap()
            .resumed_at,
        0
    );
    // The partial file is complete: no byte is left to request, so the file is downloaded again.
    write_partial_file(&bytes, Some(&tag));
    assert_eq!(download(&client, &uploaded, &file).await.unwrap(), whole);
    // Damage is detected, and the partial file is deleted.
    write_partial_file(&[0; 1000], Some(&tag));
    let message = format!(
        "{:#}",
        download(&client, &uploaded, &file).await.unwrap_err()
    );
    assert!(message.contains("it was damaged in transfer"), "{message}");
    assert!(!with_suffix(&file, ".part").exists() && !with_suffix(&file, ".part.etag").exists());
    assert_eq!(download(&client, &uploaded, &file).await.unwrap(), whole);
    assert_eq!(std::fs::read(&file).unwrap(), bytes);
}
