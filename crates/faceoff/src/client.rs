//! A client of the REST API with the request and response types of `faceoff-api`, which the server uses, too.
//!
//! The API's words: a *season* has *stages*, each with its own rules. At a *cutoff* of a stage an *evaluation day* starts:
//! the active *submission* of each team is run on all *tasks*, which is the team's *evaluation*. *Boards* rank the results.
//! A comment that begins with "Organiser:" or "Team:" names the caller whose token the server expects.

mod archive;
mod download;
mod download_links;
mod evaluations;
mod files;
mod game;
mod http;
mod pagination;
mod proposals;
mod sessions;
mod sse;
mod stages;
mod tls;
mod tournament;
mod uploads;
mod users;
mod webhooks;
mod workers;

use anyhow::{Context, bail};
pub use download::DownloadedFile;
pub use download_links::LinkTarget;
use faceoff_api::{
    API_BASE,
    requests::{BoardFormat, BoardQuery, CloseSeason, Confirmation, Reason},
    views::{
        board::BoardView, event::EventsView, health::HealthView, me::MeView,
        runtimes::RuntimesView, season::SeasonView,
    },
};
use faceoff_types::{Task, url_without_password};
use http::Address;
pub use http::{is_this_machine, server_address};
use reqwest::{Method, RequestBuilder, Response, StatusCode, header};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
pub use sse::ServerEvent;
use std::{
    path::{Path, PathBuf},
    time::Duration,
};
pub use tls::{plain_client_config, tls_client_config};
use tokio::time::Instant;

/// Longest silence of the server before a request fails.
const READ_TIMEOUT: Duration = Duration::from_secs(60);

/// A problem that the server reported (RFC 9457).
#[derive(Debug, Clone, thiserror::Error)]
#[error("the server refused ({status}, {title}): {detail}")]
pub struct ApiError {
    pub status: StatusCode,
    /// The kind of problem, as the page `/problems` names it.
    pub kind: String,
    /// The kind of problem in words.
    pub title: String,
    /// Expected and received value, and the remedy.
    pub detail: String,
}

/// Is the error a refusal by the server with this status?
pub fn is_refused_with(error: &anyhow::Error, status: StatusCode) -> bool {
    error
        .downcast_ref::<ApiError>()
        .is_some_and(|refused| refused.status == status)
}

/// The server did not answer, or answered as no Faceoff server does. The error's source has the cause.
#[derive(Debug, Clone, thiserror::Error)]
#[error("{0}")]
pub struct Unreachable(pub String);

/// An answer of a proxy or of another program.
#[derive(Debug, thiserror::Error)]
#[error("it answered {0}, but not as a Faceoff server does")]
struct ForeignAnswer(StatusCode);

/// Is this status of a server or proxy temporary, so that the same request may succeed later?
fn is_temporary_status(status: StatusCode) -> bool {
    status.is_server_error()
        || [StatusCode::TOO_MANY_REQUESTS, StatusCode::REQUEST_TIMEOUT].contains(&status)
}

/// Pause before a request is repeated.
const RETRY_PAUSE: Duration = Duration::from_secs(2);

/// Whether the same request may succeed later: the server, or a proxy before it, restarts or has too much to do.
fn is_temporary(error: &anyhow::Error) -> bool {
    if let Some(refused) = error.downcast_ref::<ApiError>() {
        return is_temporary_status(refused.status);
    }
    match error.downcast_ref::<ForeignAnswer>() {
        Some(ForeignAnswer(status)) => is_temporary_status(*status),
        None => error.is::<Unreachable>(),
    }
}

/// Repeats a request while its failures are temporary, for at most `retry_timeout`. Only for requests that change nothing on the server,
/// since a failed request may have been carried out.
///
/// # Errors
/// The last failure.
pub async fn retry_temporary<T>(
    retry_timeout: Duration,
    request: impl AsyncFn() -> anyhow::Result<T>,
) -> anyhow::Result<T> {
    retry_while(is_temporary, retry_timeout, request).await
}

/// Repeats a request while `is_retryable` is true for its failure, for at most `retry_timeout`.
async fn retry_while<T>(
    is_retryable: impl Fn(&anyhow::Error) -> bool,
    retry_timeout: Duration,
    request: impl AsyncFn() -> anyhow::Result<T>,
) -> anyhow::Result<T> {
    let give_up_at = Instant::now() + retry_timeout;
    loop {
        match request().await {
            Err(error) if is_retryable(&error) && Instant::now() < give_up_at => {
                tokio::time::sleep(RETRY_PAUSE).await;
            }
            result => return result,
        }
    }
}

/// A server and the token to call it with.
#[derive(Debug, Clone)]
pub struct Client {
    http: reqwest::Client,
    address: Address,
    token: Option<String>,
}

impl Client {
    /// A client of `server` (e.g. `https://faceoff.example.org`), with or without a bearer token. For TLS, the
    /// certificate authorities of `ca_file` are trusted in addition to the machine's.
    ///
    /// # Errors
    /// If `server` is no `http://` or `https://` address, or no certificate authority is available.
    pub fn new(server: &str, token: Option<&str>, ca_file: Option<&Path>) -> anyhow::Result<Self> {
        let address = Address::new(server, ca_file)?;
        Ok(Self {
            http: address.http(READ_TIMEOUT)?,
            address,
            token: token.map(str::to_owned),
        })
    }

    /// The same server with another token.
    #[must_use]
    pub fn with_token(&self, token: &str) -> Self {
        Self {
            token: Some(token.to_owned()),
            ..self.clone()
        }
    }

    /// The server's health.
    ///
    /// # Errors
    /// If the server does not answer or is unhealthy; the error names what is missing.
    pub async fn health(&self) -> anyhow::Result<HealthView> {
        self.get("/health").await
    }

    /// The board of a task, or the overall one.
    ///
    /// # Errors
    /// [`ApiError`] if the server refuses, [`Unreachable`] if it does not answer; the same holds for all calls below.
    pub async fn board(&self, task: Option<Task>, query: &BoardQuery) -> anyhow::Result<BoardView> {
        self.get_with_query(&board_path(task), query).await
    }

    /// A board as CSV.
    pub async fn board_csv(
        &self,
        task: Option<Task>,
        query: &BoardQuery,
    ) -> anyhow::Result<String> {
        let query = BoardQuery {
            format: Some(BoardFormat::Csv),
            ..query.clone()
        };
        let request = self.request(Method::GET, &board_path(task)).query(&query);
        read_text(self.send(request).await?).await
    }

    pub async fn season(&self) -> anyhow::Result<SeasonView> {
        self.get("/season").await
    }

    /// Organiser: closes the season permanently; `confirm` is its name.
    pub async fn close_season(&self, confirm: String) -> anyhow::Result<SeasonView> {
        self.post("/season/close", &CloseSeason { confirm }).await
    }

    /// The environment of agents on the server: runtimes, packages, limits.
    ///
    /// # Errors
    /// If the server does not answer, or is of another version.
    pub async fn runtimes(&self) -> anyhow::Result<RuntimesView> {
        self.get("/runtimes").await.map_err(|error| {
            if is_refused_with(&error, StatusCode::NOT_FOUND) {
                error.context(
                    "the server does not describe its runtimes; is it an older version of Faceoff?",
                )
            } else {
                error
            }
        })
    }

    /// Organiser: pauses the queue.
    pub async fn pause(&self, reason: String) -> anyhow::Result<()> {
        let request = self.request(Method::POST, "/queue/pause");
        self.send(request.json(&Reason { reason })).await.map(drop)
    }

    /// Organiser: resumes the queue.
    pub async fn resume(&self) -> anyhow::Result<()> {
        let request = self.request(Method::POST, "/queue/resume");
        self.send(request).await.map(drop)
    }

    /// Organiser: accepts the step of the server's system clock; `confirm` is its size.
    pub async fn accept_clock(&self, confirm: Option<String>) -> anyhow::Result<()> {
        let request = self.request(Method::POST, "/clock/accept");
        self.send(request.json(&Confirmation { confirm }))
            .await
            .map(drop)
    }

    /// Team: its name and limits, today's evaluations and its active submission.
    pub async fn me(&self) -> anyhow::Result<MeView> {
        self.get("/me").await
    }

    /// Organiser: the newest entries of the log that match the parameters of `GET /events`.
    pub async fn events(&self, parameters: &[(&str, String)]) -> anyhow::Result<EventsView> {
        self.get_with_query("/events", parameters).await
    }

    fn request(&self, method: Method, path: &str) -> RequestBuilder {
        self.request_by(&self.http, method, path)
    }

    /// A request through `http`, an HTTP client with other timeouts than this client's own.
    fn request_by(&self, http: &reqwest::Client, method: Method, path: &str) -> RequestBuilder {
        let request = http.request(method, format!("{}{API_BASE}{path}", self.address.base));
        match &self.token {
            Some(token) => request.bearer_auth(token),
            None => request,
        }
    }

    async fn get<T: DeserializeOwned>(&self, path: &str) -> anyhow::Result<T> {
        self.call(Method::GET, path).await
    }

    async fn get_with_query<T: DeserializeOwned>(
        &self,
        path: &str,
        query: &(impl Serialize + ?Sized),
    ) -> anyhow::Result<T> {
        let request = self.request(Method::GET, path).query(query);
        read_json(self.send(request).await?).await
    }

    async fn post<T: DeserializeOwned>(
        &self,
        path: &str,
        body: &impl Serialize,
    ) -> anyhow::Result<T> {
        self.call_with_body(Method::POST, path, body).await
    }

    async fn post_empty<T: DeserializeOwned>(&self, path: &str) -> anyhow::Result<T> {
        self.call(Method::POST, path).await
    }

    async fn call_with_body<T: DeserializeOwned>(
        &self,
        method: Method,
        path: &str,
        body: &impl Serialize,
    ) -> anyhow::Result<T> {
        let request = self.request(method, path).json(body);
        read_json(self.send(request).await?).await
    }

    async fn call<T: DeserializeOwned>(&self, method: Method, path: &str) -> anyhow::Result<T> {
        read_json(self.send(self.request(method, path)).await?).await
    }

    async fn send(&self, request: RequestBuilder) -> anyhow::Result<Response> {
        let base = url_without_password(&self.address.base);
        let result = request.send().await.map_err(reqwest::Error::without_url);
        let response = result.map_err(|error| {
            let error = anyhow::Error::from(error);
            let error = match tls::advice(&error) {
                Some(advice) => error.context(advice),
                None => error,
            };
            error.context(Unreachable(format!("talking to {base}")))
        })?;
        let status = response.status();
        if status.is_success() {
            return Ok(response);
        }
        if let (true, Some(location)) = (
            status.is_redirection(),
            response.headers().get(header::LOCATION),
        ) {
            bail!(
                "{base} redirects to another address ({}); use that server's address",
                String::from_utf8_lossy(location.as_bytes())
            );
        }
        #[derive(Deserialize)]
        struct Problem {
            r#type: String,
            title: String,
            detail: String,
        }
        let text = response.text().await.unwrap_or_default();
        let Ok(Problem {
            r#type,
            title,
            detail,
        }) = serde_json::from_str(&text)
        else {
            return Err(anyhow::Error::from(ForeignAnswer(status))
                .context(Unreachable(format!("talking to {base}"))));
        };
        let (_, kind) = r#type.rsplit_once('#').unwrap_or_default();
        Err(ApiError {
            status,
            kind: kind.to_owned(),
            title,
            detail,
        }
        .into())
    }
}

async fn read_text(response: Response) -> anyhow::Result<String> {
    response.text().await.context("reading the server's answer")
}

async fn read_json<T: DeserializeOwned>(response: Response) -> anyhow::Result<T> {
    let bytes = response
        .bytes()
        .await
        .context("reading the server's answer")?;
    serde_json::from_slice(&bytes).context(Unreachable(
        "the server's answer cannot be read; is it another version of Faceoff?".to_owned(),
    ))
}

/// The path of `file` with `suffix` appended to the file name.
#[must_use]
pub fn with_suffix(file: &Path, suffix: &str) -> PathBuf {
    let mut path = file.as_os_str().to_owned();
    path.push(suffix);
    PathBuf::from(path)
}

fn board_path(task: Option<Task>) -> String {
    match task {
        Some(task) => format!("/board/{task}"),
        None => "/board".to_owned(),
    }
}

#[cfg(test)]
mod tests;
