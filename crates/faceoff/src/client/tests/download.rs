//! Downloads that break, against the real site.

use super::*;
use faceoff_api::views::submission::SubmissionView;
use std::path::{Path, PathBuf};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::{TcpListener, TcpStream},
};

/// A submission that is larger than a connection's buffers, and its team's client.
async fn large(site: &Site) -> (Client, SubmissionView) {
    let team = site.organiser.create_team("Alpha").await.unwrap();
    let client = site.organiser.with_token(&team.token);
    let folder = bundle(site);
    let mut weights = vec![0; 8 << 20];
    blake3::Hasher::new().finalize_xof().fill(&mut weights);
    std::fs::write(folder.join("weights.npz"), weights).unwrap();
    let uploaded = client.upload(&folder).await.unwrap();
    (client, uploaded)
}

async fn get(
    client: &Client,
    of: &SubmissionView,
    file: &Path,
) -> anyhow::Result<super::super::Downloaded> {
    let bar = ProgressBar::hidden();
    client
        .download_submission(of.id, file, &of.blake3, &bar)
        .await
}

fn beside(file: &Path, end: &str) -> PathBuf {
    PathBuf::from(format!("{}{end}", file.display()))
}

/// What stands before a server and hangs up after so many bytes of an answer.
async fn hangs_up(site: &Site, after: u64) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let url = format!("http://{}", listener.local_addr().unwrap());
    let port = reqwest::Url::parse(&site.url).unwrap().port().unwrap();
    tokio::spawn(async move {
        while let Ok((client, _)) = listener.accept().await {
            let server = TcpStream::connect(("127.0.0.1", port)).await.unwrap();
            tokio::spawn(async move {
                let (mut asks, mut hears) = client.into_split();
                let (answers, mut listens) = server.into_split();
                let passed_on = tokio::spawn(async move {
                    let mut some = answers.take(after);
                    let _ = tokio::io::copy(&mut some, &mut hears).await;
                    let _ = hears.shutdown().await;
                });
                let asked = tokio::io::copy(&mut asks, &mut listens);
                tokio::select! { _ = asked => {}, _ = passed_on => {} }
            });
        }
    });
    url
}

#[tokio::test]
async fn a_download_that_broke_off_goes_on_where_it_was() {
    let site = site(32 << 20).await;
    let (client, uploaded) = large(&site).await;
    let file = site.folder.path().join("again.tar.gz");
    let token = client.token.clone();
    let broken = hangs_up(&site, 1 << 20).await;
    let through = Client::new(&broken, token.as_deref(), None).unwrap();
    let error = get(&through, &uploaded, &file).await.unwrap_err();
    let told = format!("{error:#}");
    assert!(
        told.contains("the same command goes on from there"),
        "{told}"
    );
    assert!(!file.exists());
    let begun = std::fs::metadata(beside(&file, ".part")).unwrap().len();
    assert!(begun > 0 && begun < uploaded.bytes, "{begun}");

    let done = get(&client, &uploaded, &file).await.unwrap();
    assert_eq!((done.resumed_at, done.bytes), (begun, uploaded.bytes));
    assert_eq!(
        (done.blake3.as_str(), done.checked),
        (uploaded.blake3.as_str(), true)
    );
    for end in [".part", ".part.etag"] {
        assert!(!beside(&file, end).exists(), "{end} is left");
    }
}

#[tokio::test]
async fn what_is_no_beginning_of_the_file_is_not_gone_on_with() {
    let site = site(32 << 20).await;
    let (client, uploaded) = large(&site).await;
    let file = site.folder.path().join("again.tar.gz");
    let whole = get(&client, &uploaded, &file).await.unwrap();
    assert_eq!(whole.resumed_at, 0);
    let bytes = std::fs::read(&file).unwrap();
    let tag = format!("\"blake3-{}\"", uploaded.blake3);
    let begin = |part: &[u8], tag: Option<&str>| {
        std::fs::write(beside(&file, ".part"), part).unwrap();
        match tag {
            Some(tag) => std::fs::write(beside(&file, ".part.etag"), tag).unwrap(),
            None => assert!(!beside(&file, ".part.etag").exists()),
        }
    };
    // Of nobody knows what, and of another file: anew.
    begin(&bytes[..1000], None);
    assert_eq!(get(&client, &uploaded, &file).await.unwrap().resumed_at, 0);
    begin(&bytes[..1000], Some("\"blake3-00\""));
    assert_eq!(get(&client, &uploaded, &file).await.unwrap().resumed_at, 0);
    // More than there is.
    begin(&[&bytes[..], b"x"].concat(), Some(&tag));
    assert_eq!(get(&client, &uploaded, &file).await.unwrap().resumed_at, 0);
    // All of it but the name.
    begin(&bytes, Some(&tag));
    assert_eq!(get(&client, &uploaded, &file).await.unwrap(), whole);
    // Damaged: that is found out, and nothing of it kept.
    begin(&[0; 1000], Some(&tag));
    let told = format!("{:#}", get(&client, &uploaded, &file).await.unwrap_err());
    assert!(told.contains("it was changed on the way"), "{told}");
    assert!(!beside(&file, ".part").exists() && !beside(&file, ".part.etag").exists());
    assert_eq!(get(&client, &uploaded, &file).await.unwrap(), whole);
    assert_eq!(std::fs::read(&file).unwrap(), bytes);
}
