//! The files of an order, as a worker has them: by the server's own HTTP with the order's grant, or by links to a bucket.

use anyhow::Context as _;
use faceoff_types::BundleRef;
use faceoff_wire::remote::Objects;
use futures::TryStreamExt as _;
use reqwest::{Client, Method, RequestBuilder, Response, StatusCode, header};
use std::{
    path::Path,
    time::{Duration, Instant},
};
use tokio::io::AsyncWriteExt as _;
use tokio_util::io::ReaderStream;

/// How long a file is asked for again and again: the server may be starting anew.
const WITHIN: Duration = Duration::from_secs(60);
/// From one try to the next.
const REST: Duration = Duration::from_secs(2);

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
        http: &Client,
        bundle: &BundleRef,
        archive: &Path,
        ended: impl Fn() -> bool,
    ) -> anyhow::Result<()> {
        let blake3 = &bundle.blake3;
        let links = self.objects.as_ref().map(|objects| &objects.bundles);
        let link = links.map(|links| links.get(blake3));
        let from = self.place(Method::GET, &format!("bundles/{blake3}"), link)?;
        let fetch = async |request: RequestBuilder| {
            let answer = good(request.send().await?).await?;
            let mut file = tokio::fs::File::create(archive).await?;
            let mut bytes = answer.bytes_stream();
            while let Some(piece) = bytes.try_next().await? {
                file.write_all(&piece).await?;
            }
            file.flush().await?;
            Ok(())
        };
        self.again(http, &from, fetch, ended)
            .await
            .with_context(|| format!("fetching the bundle {}", shown(&from.url)))
    }

    /// Stores a file under this name, likewise.
    pub(super) async fn store(
        &self,
        http: &Client,
        name: &str,
        file: &Path,
        ended: impl Fn() -> bool,
    ) -> anyhow::Result<()> {
        let links = self.objects.as_ref().map(|objects| &objects.files);
        let link = links.map(|links| links.get(name));
        let to = self.place(Method::PUT, &format!("files/{name}"), link)?;
        let send = async |request: RequestBuilder| {
            let body = tokio::fs::File::open(file).await?;
            let bytes = body.metadata().await?.len();
            let answer = request
                .header(header::CONTENT_LENGTH, bytes)
                .body(reqwest::Body::wrap_stream(ReaderStream::new(body)))
                .send()
                .await?;
            let _ = good(answer).await?;
            Ok(())
        };
        self.again(http, &to, send, ended)
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

    async fn again(
        &self,
        http: &Client,
        place: &Place,
        mut once: impl AsyncFnMut(RequestBuilder) -> anyhow::Result<()>,
        ended: impl Fn() -> bool,
    ) -> anyhow::Result<()> {
        let began = Instant::now();
        loop {
            let mut request = http.request(place.method.clone(), &place.url);
            if place.granted {
                request = request.header(header::AUTHORIZATION, format!("Grant {}", self.grant));
            }
            let Err(error) = once(request).await else {
                return Ok(());
            };
            if !is_away(&error) || began.elapsed() >= WITHIN || ended() {
                return Err(error);
            }
            tokio::time::sleep(REST).await;
        }
    }
}

/// What of an address is told: what follows opens it.
fn shown(url: &str) -> &str {
    url.split('?').next().unwrap_or_default()
}

/// The server, or the proxy before it, has no time now.
#[derive(Debug, thiserror::Error)]
#[error("the server answered {0}")]
struct Busy(StatusCode);

/// Is it worth asking again?
fn is_away(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        cause.is::<Busy>()
            || cause.downcast_ref::<reqwest::Error>().is_some_and(|error| {
                let before = error.is_connect() || error.is_timeout() || error.is_request();
                // In the middle of what it answers.
                before || error.is_body() || error.is_decode()
            })
    })
}

/// An answer that is no refusal.
async fn good(answer: Response) -> anyhow::Result<Response> {
    let status = answer.status();
    if status.is_success() {
        return Ok(answer);
    }
    let busy = [
        StatusCode::TOO_MANY_REQUESTS,
        StatusCode::BAD_GATEWAY,
        StatusCode::SERVICE_UNAVAILABLE,
        StatusCode::GATEWAY_TIMEOUT,
    ];
    if busy.contains(&status) {
        return Err(Busy(status).into());
    }
    let told = answer.text().await.unwrap_or_default();
    if status == StatusCode::INSUFFICIENT_STORAGE {
        return Err(std::io::Error::from(std::io::ErrorKind::StorageFull).into());
    }
    anyhow::bail!("the server answered {status}: {told}")
}
