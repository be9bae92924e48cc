//! Files by plain HTTP: each is a file of a folder, as the server's own are.

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

const PIECE_BYTES: usize = 64 << 10;

/// Serves `folder`, in the background; returns where it listens.
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
        let mut pieces = body.into_data_stream();
        while let Some(piece) = pieces.next().await {
            file.write_all(&piece?).await?;
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
    let pieces = futures::stream::try_unfold(file, |mut file| async {
        let mut piece = vec![0; PIECE_BYTES];
        let bytes = file.read(&mut piece).await?;
        piece.truncate(bytes);
        std::io::Result::Ok((bytes > 0).then(|| (Bytes::from(piece), file)))
    });
    let length = [(header::CONTENT_LENGTH, bytes.to_string())];
    (length, Body::from_stream(pieces)).into_response()
}

/// Whoever stores and reads them, over one connection that is kept.
pub(crate) struct Files {
    client: reqwest::Client,
    url: String,
}

impl Files {
    pub(crate) fn at(address: SocketAddr) -> anyhow::Result<Self> {
        // None speaks TLS, so none asks for the machine's certificate authorities.
        let nobody = rustls::ClientConfig::builder()
            .with_root_certificates(rustls::RootCertStore::empty())
            .with_no_client_auth();
        let client = reqwest::Client::builder().tls_backend_preconfigured(nobody);
        Ok(Self {
            client: client.build()?,
            url: format!("http://{address}"),
        })
    }

    /// One question and its answer, without a file.
    pub(crate) async fn ask(&self) -> anyhow::Result<()> {
        self.client
            .get(&self.url)
            .send()
            .await?
            .error_for_status()?;
        Ok(())
    }

    pub(crate) async fn put(&self, name: &str, bytes: Bytes) -> anyhow::Result<()> {
        let sent = self.client.put(format!("{}/{name}", self.url)).body(bytes);
        let answer = sent.send().await?;
        ensure!(answer.status().is_success(), "PUT: {}", answer.status());
        Ok(())
    }

    pub(crate) async fn get(&self, name: &str) -> anyhow::Result<Bytes> {
        let asked = self.client.get(format!("{}/{name}", self.url)).send();
        let answer = asked.await?.error_for_status()?;
        answer.bytes().await.context("GET")
    }
}
