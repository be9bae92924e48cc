//! Download of the season's archive: one file with the season's data and a *manifest*, which lists its files with their hashes.
//! The *edition* says whether it is for the public or for organisers.

use super::{Client, with_suffix};
use anyhow::{Context, bail};
use faceoff_api::requests::ArchiveQuery;
use faceoff_archive::{Edition, Manifest, check};
use faceoff_dataset::allow_missing;
use futures::StreamExt;
use reqwest::Method;
use std::{path::Path, time::Duration};
use tokio::{
    fs::{self, File},
    io::AsyncWriteExt,
};

/// Longest silence of the server. It is long, since the server copies its database and hashes new files before it sends the first byte.
const READ_TIMEOUT: Duration = Duration::from_secs(3600);

impl Client {
    /// Organiser: downloads the season's archive to a new file and checks it against its manifest.
    ///
    /// # Errors
    /// If the file exists, the server cannot be reached or refuses, or the download is incomplete. A failed download leaves no
    /// file.
    pub async fn download_season_archive(
        &self,
        edition: Edition,
        file: &Path,
    ) -> anyhow::Result<(Manifest, u64)> {
        if fs::try_exists(file).await.unwrap_or(true) {
            bail!(
                "{} already exists and was not changed; name another file",
                file.display()
            );
        }
        let patient_client = Self {
            http: self.address.http(READ_TIMEOUT)?,
            ..self.clone()
        };
        let query = ArchiveQuery {
            edition: Some(edition),
        };
        let request = patient_client
            .request(Method::GET, "/season/archive")
            .query(&query);
        let response = patient_client.send(request).await?;
        let partial = with_suffix(file, ".part");
        let fetched = fetch(response, &partial).await;
        let checked = match fetched {
            Ok(bytes) => check_archive(&partial)
                .await
                .map(|manifest| (manifest, bytes)),
            Err(error) => Err(error),
        };
        if checked.is_err() {
            // The first error is more useful than a failure to remove the partial file.
            let _ = fs::remove_file(&partial).await;
            return checked;
        }
        fs::rename(&partial, file)
            .await
            .with_context(|| format!("naming {}", file.display()))?;
        checked
    }
}

/// Writes the body of a response to the file `partial` and returns its length in bytes.
async fn fetch(response: reqwest::Response, partial: &Path) -> anyhow::Result<u64> {
    let writing = || format!("writing {}", partial.display());
    // A download that was killed may have left a partial file.
    allow_missing(fs::remove_file(partial).await).with_context(writing)?;
    // The archive may contain everything that only organisers may read.
    let mut writer = File::options()
        .write(true)
        .create_new(true)
        .mode(0o600)
        .open(partial)
        .await
        .with_context(writing)?;
    let mut bytes = 0;
    let mut stream = response.bytes_stream();
    while let Some(piece) = stream.next().await {
        let piece = piece.with_context(|| {
            format!("the download was interrupted after {bytes} bytes; the server's log may have the reason. Try again")
        })?;
        bytes += piece.len() as u64;
        writer.write_all(&piece).await.with_context(writing)?;
    }
    writer.sync_all().await.with_context(writing)?;
    Ok(bytes)
}

/// Checks an archive against its manifest and returns the manifest.
async fn check_archive(archive: &Path) -> anyhow::Result<Manifest> {
    let archive = archive.to_owned();
    tokio::task::spawn_blocking(move || check(&archive))
        .await
        .context("reading the archive")?
        .context("the downloaded archive is incomplete; try again")
}
