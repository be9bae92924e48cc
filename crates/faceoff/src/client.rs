//! A client of the REST API with the request and response types of `faceoff-api`, which the server uses, too.
//!
//! The API's words: a *season* has *stages*, each with its own rules. At a *cutoff* of a stage an *evaluation day* starts:
//! the active *submission* of each team is run on all *tasks*, which is the team's *evaluation*. *Boards* rank the results.
//! A comment that begins with "Organiser:" or "Team:" names the caller whose token the server expects.

mod archive;
mod download;
mod files;
mod game;
mod http;
mod links;
mod pages;
mod proposals;
mod sessions;
mod sse;
mod tls;
mod tournament;
mod uploads;
mod users;
mod webhooks;
mod workers;

use anyhow::{Context, anyhow, bail};
pub use download::DownloadedFile;
use faceoff_api::{
    API_BASE,
    requests::{
        BoardFormat, BoardQuery, Cancellation, CloseSeason, ComparisonQuery, Confirmation,
        Decision, MissedDay, NewExtraEvaluation, NewStage, NewTeam, Reason, StageChange, StartDay,
    },
    views::{
        board::BoardView,
        capacity::CapacityView,
        comparison::ComparisonView,
        day::DayView,
        evaluation::EvaluationView,
        event::EventsView,
        health::HealthView,
        me::MeView,
        runtimes::RuntimesView,
        season::SeasonView,
        stage::StageView,
        team::{TeamView, TeamWithToken},
    },
};
use faceoff_types::{EvaluationId, StageDay, StageId, Task, TeamId};
use http::Address;
use jiff::civil::Date;
pub use links::LinkTarget;
use reqwest::{Method, RequestBuilder, Response, StatusCode, header};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
pub use sse::ServerEvent;
use std::{path::Path, time::Duration};
pub use tls::{plain_client_config, tls_client_config};

/// Longest silence of the server before a request fails.
const READ_TIMEOUT: Duration = Duration::from_secs(60);

/// A problem that the server reported (RFC 9457).
#[derive(Debug, Clone, thiserror::Error)]
#[error("the server refused ({status}, {title}): {detail}")]
pub struct ApiError {
    pub status: StatusCode,
    /// The kind of problem in words.
    pub title: String,
    /// Expected and received value, and the remedy.
    pub detail: String,
}

/// The server did not answer, or answered as no Faceoff server does. The error's source has the cause.
#[derive(Debug, Clone, thiserror::Error)]
#[error("{0}")]
pub struct Unreachable(pub String);

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
        let request = self.request(Method::GET, &board_path(task)).query(query);
        read_json(self.send(request).await?).await
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

    /// Compares two finished evaluations on the same episodes.
    pub async fn compare(
        &self,
        a: EvaluationId,
        b: EvaluationId,
        query: ComparisonQuery,
    ) -> anyhow::Result<ComparisonView> {
        let path = format!("/evaluations/{a}/compare/{b}");
        let request = self.request(Method::GET, &path).query(&query);
        read_json(self.send(request).await?).await
    }

    pub async fn season(&self) -> anyhow::Result<SeasonView> {
        self.get("/season").await
    }

    /// Organiser: closes the season permanently; `confirm` is its name.
    pub async fn close_season(&self, confirm: String) -> anyhow::Result<SeasonView> {
        self.post("/season/close", &CloseSeason { confirm }).await
    }

    /// Organiser: creates a team. Only this response has its token.
    pub async fn create_team(&self, name: &str) -> anyhow::Result<TeamWithToken> {
        self.post(
            "/teams",
            &NewTeam {
                name: name.to_owned(),
            },
        )
        .await
    }

    /// Organiser: all teams.
    pub async fn teams(&self) -> anyhow::Result<Vec<TeamView>> {
        self.list(self.request(Method::GET, "/teams")).await
    }

    /// Organiser: issues a new token for a team and revokes the old one.
    pub async fn replace_token(&self, team: TeamId) -> anyhow::Result<TeamWithToken> {
        self.post_empty(&format!("/teams/{team}/token")).await
    }

    /// Organiser: starts the evaluation day of a stage, by default of the open one.
    pub async fn start_day(&self, stage: Option<StageId>) -> anyhow::Result<DayView> {
        self.post("/days", &StartDay { stage }).await
    }

    /// All stages, by opening time.
    pub async fn stages(&self) -> anyhow::Result<Vec<StageView>> {
        self.get("/stages").await
    }

    /// The environment of agents on the server: runtimes, packages, limits.
    ///
    /// # Errors
    /// If the server does not answer, or is of another version.
    pub async fn runtimes(&self) -> anyhow::Result<RuntimesView> {
        self.get("/runtimes").await.map_err(|error| {
            let is_unknown_route = error
                .downcast_ref::<ApiError>()
                .is_some_and(|error| error.status == StatusCode::NOT_FOUND);
            if is_unknown_route {
                error.context(
                    "the server does not describe its runtimes; is it an older version of Faceoff?",
                )
            } else {
                error
            }
        })
    }

    /// Organiser: whether the evaluation days of a stage fit into their time.
    pub async fn capacity(&self, id: StageId) -> anyhow::Result<CapacityView> {
        self.get(&format!("/stages/{id}/capacity")).await
    }

    /// Organiser: freezes the boards of a stage.
    pub async fn freeze(&self, id: StageId, reason: String) -> anyhow::Result<StageView> {
        self.post(&format!("/stages/{id}/freeze"), &Reason { reason })
            .await
    }

    /// Organiser: unfreezes the boards of a stage.
    pub async fn unfreeze(&self, id: StageId) -> anyhow::Result<StageView> {
        self.post_empty(&format!("/stages/{id}/unfreeze")).await
    }

    /// Organiser: starts an evaluation day for a past date that had no cutoff.
    pub async fn start_missed_day(
        &self,
        id: StageId,
        missed: &MissedDay,
    ) -> anyhow::Result<DayView> {
        self.post(&format!("/stages/{id}/days"), missed).await
    }

    /// Organiser: adds one evaluation of a team to an evaluation day.
    pub async fn add_evaluation(
        &self,
        day: StageDay,
        extra: &NewExtraEvaluation,
    ) -> anyhow::Result<EvaluationView> {
        let path = format!("/stages/{}/days/{}/extra-evaluation", day.stage, day.date);
        self.post(&path, extra).await
    }

    /// Organiser: creates a stage.
    pub async fn create_stage(&self, new: &NewStage) -> anyhow::Result<StageView> {
        self.post("/stages", new).await
    }

    /// Organiser: changes a stage.
    pub async fn change_stage(
        &self,
        id: StageId,
        change: &StageChange,
    ) -> anyhow::Result<StageView> {
        self.call_with_body(Method::PATCH, &format!("/stages/{id}"), change)
            .await
    }

    /// Organiser: starts a stage's final day, the evaluation day after its close whose results decide it.
    pub async fn start_final_day(&self, id: StageId) -> anyhow::Result<DayView> {
        self.post_empty(&format!("/stages/{id}/final")).await
    }

    /// Organiser: signs off a stage's result; `confirm` is the stage's name.
    pub async fn finalise(
        &self,
        id: StageId,
        confirm: Option<String>,
    ) -> anyhow::Result<StageView> {
        self.post(&format!("/stages/{id}/finalise"), &Confirmation { confirm })
            .await
    }

    /// Team: publishes one of its own evaluations.
    pub async fn publish(&self, id: EvaluationId) -> anyhow::Result<EvaluationView> {
        self.post_empty(&format!("/evaluations/{id}/publish")).await
    }

    /// Organiser: repeats an evaluation that was cancelled or failed by a platform fault.
    pub async fn rerun(&self, id: EvaluationId) -> anyhow::Result<EvaluationView> {
        self.post_empty(&format!("/evaluations/{id}/rerun")).await
    }

    /// Organiser: stops an evaluation.
    pub async fn cancel(&self, id: EvaluationId, reason: String) -> anyhow::Result<EvaluationView> {
        self.post(
            &format!("/evaluations/{id}/cancel"),
            &Cancellation { reason },
        )
        .await
    }

    /// Organiser: voids a result, which leaves the boards.
    pub async fn void(
        &self,
        id: EvaluationId,
        decision: &Decision,
    ) -> anyhow::Result<EvaluationView> {
        self.post(&format!("/evaluations/{id}/void"), decision)
            .await
    }

    /// Organiser: voids a whole evaluation day.
    pub async fn void_day(&self, day: StageDay, decision: &Decision) -> anyhow::Result<DayView> {
        let path = format!("/stages/{}/days/{}/void", day.stage, day.date);
        self.post(&path, decision).await
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

    /// Organiser: disqualifies a team.
    pub async fn disqualify(&self, id: TeamId, decision: &Decision) -> anyhow::Result<TeamView> {
        self.post(&format!("/teams/{id}/disqualify"), decision)
            .await
    }

    /// Organiser: reinstates a disqualified team.
    pub async fn reinstate(&self, id: TeamId, reason: String) -> anyhow::Result<TeamView> {
        self.post(&format!("/teams/{id}/reinstate"), &Reason { reason })
            .await
    }

    /// Team: its name and limits, today's evaluations and its active submission.
    pub async fn me(&self) -> anyhow::Result<MeView> {
        self.get("/me").await
    }

    /// Organiser: all evaluations of a day (default: today). Team: its own (default: of all days).
    pub async fn evaluations(&self, day: Option<Date>) -> anyhow::Result<Vec<EvaluationView>> {
        let request = self.request(Method::GET, "/evaluations");
        let request = match day {
            Some(day) => request.query(&[("day", day.to_string())]),
            None => request,
        };
        self.list(request).await
    }

    /// Team: its newest evaluations, at most `limit` (up to 200).
    pub async fn newest_evaluations(&self, limit: usize) -> anyhow::Result<Vec<EvaluationView>> {
        let request = self.request(Method::GET, "/evaluations");
        let request = request.query(&[("limit", limit.clamp(1, 200))]);
        let mut newest: Vec<EvaluationView> = read_json(self.send(request).await?).await?;
        newest.truncate(limit);
        Ok(newest)
    }

    /// Organiser: the newest entries of the log that match the parameters of `GET /events`.
    pub async fn events(&self, parameters: &[(&str, String)]) -> anyhow::Result<EventsView> {
        let request = self.request(Method::GET, "/events").query(parameters);
        read_json(self.send(request).await?).await
    }

    /// Team or organiser: one evaluation.
    pub async fn evaluation(&self, id: EvaluationId) -> anyhow::Result<EvaluationView> {
        self.get(&format!("/evaluations/{id}")).await
    }

    fn request(&self, method: Method, path: &str) -> RequestBuilder {
        let request = self
            .http
            .request(method, format!("{}{API_BASE}{path}", self.address.base));
        match &self.token {
            Some(token) => request.bearer_auth(token),
            None => request,
        }
    }

    async fn get<T: DeserializeOwned>(&self, path: &str) -> anyhow::Result<T> {
        self.call(Method::GET, path).await
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
        let base = &self.address.base;
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
            title: String,
            detail: String,
        }
        let text = response.text().await.unwrap_or_default();
        let Ok(Problem { title, detail }) = serde_json::from_str(&text) else {
            return Err(
                anyhow!("it answered {status}, but not as a Faceoff server does")
                    .context(Unreachable(format!("talking to {base}"))),
            );
        };
        Err(ApiError {
            status,
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

fn board_path(task: Option<Task>) -> String {
    match task {
        Some(task) => format!("/board/{task}"),
        None => "/board".to_owned(),
    }
}

#[cfg(test)]
mod tests;
