//! A plain HTTP server that stores each file in a folder, as Faceoff's server does.

use anyhow::{Context as _, ensure};
use axum::{
    Router,
    body::{Body, Bytes},
    extract::{Path, State},
    http::{StatusCode, header},
    response::{IntoResponse, Response},
    routing::get,
};
use futures::StreamExt as _;
use std::{net::SocketAddr, path::PathBuf, sync::Arc};
use tokio::{
    fs::File,
    io::{AsyncReadExt as _, AsyncWriteExt as _},
    net::TcpListener,
};

/// Files are read in chunks of this size.
const CHUNK_BYTES: usize = 64 << 10;

/// Serves a folder in the background. Returns the listening address.
pub(crate) async fn serve(folder: PathBuf) -> anyhow::Result<SocketAddr> {
    let listener = TcpListener::bind(("127.0.0.1", 0)).await?;
    let address = listener.local_addr()?;
    let router = Router::new()
        .route("/", get(|| async {}))
        .route("/{name}", get(read).put(store))
        .with_state(Arc::new(folder));
    tokio::spawn(async move { axum::serve(listener, router).await });
    Ok(address)
}

async fn store(
    State(folder): State<Arc<PathBuf>>,
    Path(name): Path<String>,
    body: Body,
) -> StatusCode {
    let stored = async {
        let mut file = File::create(folder.join(name)).await?;
        let mut chunks = body.into_data_stream();
        while let Some(chunk) = chunks.next().await {
            file.write_all(&chunk?).await?;
        }
        file.flush().await?;
        anyhow::Ok(())
    };
    match stored.await {
        Ok(()) => StatusCode::NO_CONTENT,
        Err(_) => StatusCode::INTERNAL_SERVER_ERROR,
    }
}

async fn read(State(folder): State<Arc<PathBuf>>, Path(name): Path<String>) -> Response {
    let opened = async {
        let file = File::open(folder.join(name)).await?;
        let bytes = file.metadata().await?.len();
        std::io::Result::Ok((file, bytes))
    };
    let Ok((file, bytes)) = opened.await else {
        return StatusCode::NOT_FOUND.into_response();
    };
    let chunks = futures::stream::try_unfold(file, |mut file| async {
        let mut chunk = vec![0; CHUNK_BYTES];
        let bytes = file.read(&mut chunk).await?;
        chunk.truncate(bytes);
        std::io::Result::Ok((bytes > 0).then(|| (Bytes::from(chunk), file)))
    });
    let length = [(header::CONTENT_LENGTH, bytes.to_string())];
    (length, Body::from_stream(chunks)).into_response()
}

/// A client that stores and reads files over one persistent connection.
pub(crate) struct FileClient {
    client: reqwest::Client,
    url: String,
}

impl FileClient {
    pub(crate) fn at(address: SocketAddr) -> anyhow::Result<Self> {
        // The client does not use TLS, so it does not load the system's certificate authorities.
        let no_tls = rustls::ClientConfig::builder()
            .with_root_certificates(rustls::RootCertStore::empty())
            .with_no_client_auth();
        let client = reqwest::Client::builder().tls_backend_preconfigured(no_tls);
        Ok(Self {
            client: client.build()?,
            url: format!("http://{address}"),
        })
    }

    /// One request without a file.
    pub(crate) async fn ping(&self) -> anyhow::Result<()> {
        self.client
            .get(&self.url)
            .send()
            .await?
            .error_for_status()?;
        Ok(())
    }

    pub(crate) async fn put(&self, name: &str, bytes: Bytes) -> anyhow::Result<()> {
        let request = self.client.put(format!("{}/{name}", self.url)).body(bytes);
        let response = request.send().await?;
        ensure!(response.status().is_success(), "PUT: {}", response.status());
        Ok(())
    }

    pub(crate) async fn get(&self, name: &str) -> anyhow::Result<Bytes> {
        let request = self.client.get(format!("{}/{name}", self.url)).send();
        let response = request.await?.error_for_status()?;
        response.bytes().await.context("GET")
    }
}
