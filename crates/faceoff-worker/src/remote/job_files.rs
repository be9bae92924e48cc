//! The files of a job on a remote worker: over the server's HTTP with the job's *grant* (a sealed permission), or by links to
//! an S3 bucket.

use super::transfer::{FileTransfer, check_status};
use anyhow::Context as _;
use faceoff_types::BundleRef;
use faceoff_wire::remote::ObjectLinks;
use futures::TryStreamExt as _;
use reqwest::{Client, Method, RequestBuilder, header};
use std::path::Path;
use tokio::io::AsyncWriteExt as _;
use tokio_util::io::ReaderStream;

/// Access to the files of a job.
#[derive(Debug, Default)]
pub(super) struct JobFiles {
    pub(super) grant: String,
    /// Base URL of the server's files.
    pub(super) files_url: String,
    /// Links to a bucket, if files are transferred through one.
    pub(super) objects: Option<ObjectLinks>,
}

/// The request for a file.
struct FileRequest {
    method: Method,
    url: String,
    /// Is the grant sent? Links need none.
    needs_grant: bool,
}

impl JobFiles {
    /// Fetches a bundle, with retries while the server is unreachable, until the job `has_ended`.
    pub(super) async fn fetch_bundle(
        &self,
        transfer: &FileTransfer,
        bundle: &BundleRef,
        archive: &Path,
        has_ended: impl Fn() -> bool,
    ) -> anyhow::Result<()> {
        let blake3 = &bundle.blake3;
        let links = self.objects.as_ref().map(|objects| &objects.bundles);
        let link = links.map(|links| links.get(blake3));
        let source = self.file_request(Method::GET, &format!("bundles/{blake3}"), link)?;
        transfer
            .run(
                async |http, progress| {
                    let response = check_status(self.request(http, &source).send().await?).await?;
                    let mut file = tokio::fs::File::create(archive).await?;
                    let mut chunks = response.bytes_stream();
                    while let Some(chunk) = chunks.try_next().await? {
                        progress.add(chunk.len());
                        file.write_all(&chunk).await?;
                    }
                    file.flush().await?;
                    Ok(())
                },
                has_ended,
            )
            .await
            .with_context(|| format!("fetching the bundle {}", without_query(&source.url)))
    }

    /// Stores a file under this name, with retries as in [`Self::fetch_bundle`].
    pub(super) async fn store(
        &self,
        transfer: &FileTransfer,
        name: &str,
        file: &Path,
        has_ended: impl Fn() -> bool,
    ) -> anyhow::Result<()> {
        let links = self.objects.as_ref().map(|objects| &objects.files);
        let link = links.map(|links| links.get(name));
        let target = self.file_request(Method::PUT, &format!("files/{name}"), link)?;
        transfer
            .run(
                async |http, progress| {
                    let body = tokio::fs::File::open(file).await?;
                    let bytes = body.metadata().await?.len();
                    progress.set_total(bytes);
                    let progress = progress.clone();
                    let chunks =
                        ReaderStream::new(body).inspect_ok(move |chunk| progress.add(chunk.len()));
                    let response = self
                        .request(http, &target)
                        .header(header::CONTENT_LENGTH, bytes)
                        .body(reqwest::Body::wrap_stream(chunks))
                        .send()
                        .await?;
                    let _ = check_status(response).await?;
                    Ok(())
                },
                has_ended,
            )
            .await
            .with_context(|| format!("storing a file at {}", without_query(&target.url)))
    }

    /// The request for a file. Without a bucket, `link` is `None`; with one, it is the link to the file, if the job has one.
    fn file_request(
        &self,
        method: Method,
        path: &str,
        link: Option<Option<&String>>,
    ) -> anyhow::Result<FileRequest> {
        let (url, needs_grant) = match link {
            Some(Some(link)) => (link.clone(), false),
            Some(None) => anyhow::bail!("the job has no link to {path}"),
            None => (format!("{}/work/{path}", self.files_url), true),
        };
        Ok(FileRequest {
            method,
            url,
            needs_grant,
        })
    }

    fn request(&self, http: &Client, file: &FileRequest) -> RequestBuilder {
        let request = http.request(file.method.clone(), &file.url);
        if file.needs_grant {
            return request.header(header::AUTHORIZATION, format!("Grant {}", self.grant));
        }
        request
    }
}

/// A URL as it may appear in messages: without the query, which may contain credentials.
fn without_query(url: &str) -> &str {
    url.split('?').next().unwrap_or_default()
}
