//! The files of an order, as a worker has them: by the server's own HTTP with the order's grant, or by links to a bucket.

use super::transfer::{Carrier, good};
use anyhow::Context as _;
use faceoff_types::BundleRef;
use faceoff_wire::remote::Objects;
use futures::TryStreamExt as _;
use reqwest::{Client, Method, RequestBuilder, header};
use std::path::Path;
use tokio::io::AsyncWriteExt as _;
use tokio_util::io::ReaderStream;

/// Where they are, and what opens them.
#[derive(Debug, Default)]
pub(super) struct OrderFiles {
    pub(super) grant: String,
    /// The address of the server's files.
    pub(super) server: String,
    /// Links to a bucket, if they are there.
    pub(super) objects: Option<Objects>,
}

/// How one is asked for.
struct Place {
    method: Method,
    url: String,
    /// Whether the grant is shown. A link opens by itself what it leads to.
    granted: bool,
}

impl OrderFiles {
    /// Fetches a bundle's archive, again while whoever has it is away and the order has not `ended`.
    pub(super) async fn fetch_bundle(
        &self,
        by: &Carrier,
        bundle: &BundleRef,
        archive: &Path,
        ended: impl Fn() -> bool,
    ) -> anyhow::Result<()> {
        let blake3 = &bundle.blake3;
        let links = self.objects.as_ref().map(|objects| &objects.bundles);
        let link = links.map(|links| links.get(blake3));
        let from = self.place(Method::GET, &format!("bundles/{blake3}"), link)?;
        by.carry(
            async |http, moved| {
                let answer = good(self.request(http, &from).send().await?).await?;
                let mut file = tokio::fs::File::create(archive).await?;
                let mut bytes = answer.bytes_stream();
                while let Some(piece) = bytes.try_next().await? {
                    moved.add(piece.len());
                    file.write_all(&piece).await?;
                }
                file.flush().await?;
                Ok(())
            },
            ended,
        )
        .await
        .with_context(|| format!("fetching the bundle {}", shown(&from.url)))
    }

    /// Stores a file under this name, likewise.
    pub(super) async fn store(
        &self,
        by: &Carrier,
        name: &str,
        file: &Path,
        ended: impl Fn() -> bool,
    ) -> anyhow::Result<()> {
        let links = self.objects.as_ref().map(|objects| &objects.files);
        let link = links.map(|links| links.get(name));
        let to = self.place(Method::PUT, &format!("files/{name}"), link)?;
        by.carry(
            async |http, moved| {
                let body = tokio::fs::File::open(file).await?;
                let bytes = body.metadata().await?.len();
                moved.of(bytes);
                let moves = moved.clone();
                let pieces =
                    ReaderStream::new(body).inspect_ok(move |piece| moves.add(piece.len()));
                let answer = self
                    .request(http, &to)
                    .header(header::CONTENT_LENGTH, bytes)
                    .body(reqwest::Body::wrap_stream(pieces))
                    .send()
                    .await?;
                let _ = good(answer).await?;
                Ok(())
            },
            ended,
        )
        .await
        .with_context(|| format!("storing a file at {}", shown(&to.url)))
    }

    /// A link's, if files go by links.
    fn place(
        &self,
        method: Method,
        path: &str,
        link: Option<Option<&String>>,
    ) -> anyhow::Result<Place> {
        let (url, granted) = match link {
            Some(Some(link)) => (link.clone(), false),
            Some(None) => anyhow::bail!("the order has no link to {path}"),
            None => (format!("{}/work/{path}", self.server), true),
        };
        Ok(Place {
            method,
            url,
            granted,
        })
    }

    fn request(&self, http: &Client, place: &Place) -> RequestBuilder {
        let request = http.request(place.method.clone(), &place.url);
        if place.granted {
            return request.header(header::AUTHORIZATION, format!("Grant {}", self.grant));
        }
        request
    }
}

/// What of an address is told: what follows opens it.
fn shown(url: &str) -> &str {
    url.split('?').next().unwrap_or_default()
}
