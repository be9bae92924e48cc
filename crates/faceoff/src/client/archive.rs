//! The season's archive, downloaded.

use super::Client;
use anyhow::{Context, bail};
use faceoff_api::requests::ArchiveQuery;
use faceoff_archive::{Edition, Manifest, check};
use futures::StreamExt;
use reqwest::Method;
use std::{
    io::ErrorKind,
    path::{Path, PathBuf},
    time::Duration,
};
use tokio::{
    fs::{self, File},
    io::AsyncWriteExt,
};

/// Longest silence of the server: it copies its database, and reads what it has no hash of, before the first byte.
const PATIENCE: Duration = Duration::from_secs(3600);

impl Client {
    /// Organiser: downloads the season's archive to a new file, and holds it against its manifest.
    ///
    /// # Errors
    /// If the file exists, or the server cannot be reached or refuses, or what came is not whole: no file is left then.
    pub async fn season_archive(
        &self,
        edition: Edition,
        file: &Path,
    ) -> anyhow::Result<(Manifest, u64)> {
        if fs::try_exists(file).await.unwrap_or(true) {
            bail!(
                "{} exists and was left as it is; name another file",
                file.display()
            );
        }
        let patient = Self {
            http: self.address.http(PATIENCE)?,
            ..self.clone()
        };
        let query = ArchiveQuery {
            edition: Some(edition),
        };
        let request = patient
            .request(Method::GET, "/season/archive")
            .query(&query);
        let response = patient.send(request).await?;
        let mut name = file.as_os_str().to_owned();
        name.push(".part");
        let partial = PathBuf::from(name);
        let fetched = fetch(response, &partial).await;
        let checked = match fetched {
            Ok(bytes) => whole(&partial).await.map(|manifest| (manifest, bytes)),
            Err(error) => Err(error),
        };
        if checked.is_err() {
            // It is of no use; the error tells more than that it stayed.
            let _ = fs::remove_file(&partial).await;
            return checked;
        }
        fs::rename(&partial, file)
            .await
            .with_context(|| format!("naming {}", file.display()))?;
        checked
    }
}

/// Writes the body of an answer to a file; its length.
async fn fetch(response: reqwest::Response, partial: &Path) -> anyhow::Result<u64> {
    let writing = || format!("writing {}", partial.display());
    // what a download that was killed has left
    match fs::remove_file(partial).await {
        Err(error) if error.kind() != ErrorKind::NotFound => {
            return Err(error).with_context(writing);
        }
        _ => {}
    }
    // It may hold all that the organiser knows.
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
            format!("the download broke off after {bytes} bytes; the server's log may say why. Try again")
        })?;
        bytes += piece.len() as u64;
        writer.write_all(&piece).await.with_context(writing)?;
    }
    writer.sync_all().await.with_context(writing)?;
    Ok(bytes)
}

/// The manifest of an archive that is as it says.
async fn whole(archive: &Path) -> anyhow::Result<Manifest> {
    let archive = archive.to_owned();
    tokio::task::spawn_blocking(move || check(&archive))
        .await
        .context("reading the archive")?
        .context("what was downloaded is not whole; try again")
}
