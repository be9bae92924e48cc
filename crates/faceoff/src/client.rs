//! A client of the REST API. It reads the very types that the server writes.

mod archive;
mod download;
mod game;
mod http;
mod kept;
mod links;
mod pages;
mod people;
mod proposals;
mod sessions;
mod sse;
mod tls;
mod tournament;
mod uploads;
mod webhooks;
mod workers;

use anyhow::{Context, anyhow, bail};
pub use download::Downloaded;
use faceoff_api::{
    API_BASE,
    requests::{
        BoardFormat, BoardQuery, Cancellation, CloseSeason, ComparisonQuery, Confirmation,
        Decision, ExtraTurn, MissedDay, NewStage, NewTeam, Reason, StageChange, StartDay,
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
pub use links::Linked;
use reqwest::{Method, RequestBuilder, Response, StatusCode, header};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
pub use sse::ServerEvent;
use std::{path::Path, time::Duration};
pub use tls::{none as no_tls, trusting as trusting_tls};

/// Longest silence of the server.
const PATIENCE: Duration = Duration::from_secs(60);

/// A problem that the server reported (RFC 9457).
#[derive(Debug, Clone, thiserror::Error)]
#[error("the server refused ({status}, {title}): {detail}")]
pub struct ApiError {
    pub status: StatusCode,
    /// The kind of problem in words.
    pub title: String,
    /// What was expected, what came and what to do.
    pub detail: String,
}

/// No answer, or none that a Faceoff server gives; the cause says more.
#[derive(Debug, Clone, thiserror::Error)]
#[error("{0}")]
pub struct Unreachable(pub String);

/// A server, and who we are to it.
#[derive(Debug, Clone)]
pub struct Client {
    http: reqwest::Client,
    address: Address,
    token: Option<String>,
}

impl Client {
    /// A client of `server` (e.g. `https://faceoff.example.org`), with a bearer token or without. Behind TLS the authorities
    /// of `ca_file` are believed, too.
    ///
    /// # Errors
    /// If `server` is no `http://` or `https://` address, or there is no authority to believe.
    pub fn new(server: &str, token: Option<&str>, ca_file: Option<&Path>) -> anyhow::Result<Self> {
        let address = Address::new(server, ca_file)?;
        Ok(Self {
            http: address.http(PATIENCE)?,
            address,
            token: token.map(str::to_owned),
        })
    }

    /// The same server, as somebody else.
    #[must_use]
    pub fn with_token(&self, token: &str) -> Self {
        Self {
            token: Some(token.to_owned()),
            ..self.clone()
        }
    }

    /// Is the server fit for work?
    ///
    /// # Errors
    /// If it does not answer, or is not: what is missing.
    pub async fn health(&self) -> anyhow::Result<HealthView> {
        self.get("/health").await
    }

    /// The board of a task, or the overall one.
    ///
    /// # Errors
    /// As [`ApiError`], or when the server cannot be reached; so for all calls below.
    pub async fn board(
        &self,
        task: Option<Task>,
        wanted: &BoardQuery,
    ) -> anyhow::Result<BoardView> {
        let request = self.request(Method::GET, &board_path(task)).query(wanted);
        read(self.send(request).await?).await
    }

    /// A board as a table for spreadsheets.
    pub async fn board_csv(
        &self,
        task: Option<Task>,
        wanted: &BoardQuery,
    ) -> anyhow::Result<String> {
        let wanted = BoardQuery {
            format: Some(BoardFormat::Csv),
            ..wanted.clone()
        };
        let request = self.request(Method::GET, &board_path(task)).query(&wanted);
        let text = self.send(request).await?.text().await;
        text.context("reading the server's answer")
    }

    /// Two finished evaluations on the same episodes.
    pub async fn compare(
        &self,
        a: EvaluationId,
        b: EvaluationId,
        wanted: ComparisonQuery,
    ) -> anyhow::Result<ComparisonView> {
        let path = format!("/evaluations/{a}/compare/{b}");
        let request = self.request(Method::GET, &path).query(&wanted);
        read(self.send(request).await?).await
    }

    pub async fn season(&self) -> anyhow::Result<SeasonView> {
        self.get("/season").await
    }

    /// Organiser: closes the season for good; `confirm` is its name.
    pub async fn close_season(&self, confirm: &str) -> anyhow::Result<SeasonView> {
        let request = self
            .request(Method::POST, "/season/close")
            .json(&CloseSeason {
                confirm: confirm.to_owned(),
            });
        read(self.send(request).await?).await
    }

    /// Organiser: creates a team; its token comes this once.
    pub async fn create_team(&self, name: &str) -> anyhow::Result<TeamWithToken> {
        let request = self.request(Method::POST, "/teams").json(&NewTeam {
            name: name.to_owned(),
        });
        read(self.send(request).await?).await
    }

    /// Organiser: all teams.
    pub async fn teams(&self) -> anyhow::Result<Vec<TeamView>> {
        self.list(self.request(Method::GET, "/teams")).await
    }

    /// Organiser: a new token for a team; the old one is worth nothing from then on.
    pub async fn replace_token(&self, team: TeamId) -> anyhow::Result<TeamWithToken> {
        let request = self.request(Method::POST, &format!("/teams/{team}/token"));
        read(self.send(request).await?).await
    }

    /// Organiser: starts the day of a stage, or of the one that is open.
    pub async fn start_day(&self, stage: Option<StageId>) -> anyhow::Result<DayView> {
        let request = self
            .request(Method::POST, "/days")
            .json(&StartDay { stage });
        read(self.send(request).await?).await
    }

    /// All stages, the first to open first.
    pub async fn stages(&self) -> anyhow::Result<Vec<StageView>> {
        self.get("/stages").await
    }

    /// What agents find on the server.
    ///
    /// # Errors
    /// If it does not answer, or not as one of this version would.
    pub async fn runtimes(&self) -> anyhow::Result<RuntimesView> {
        self.get("/runtimes").await.map_err(|error| {
            let unknown = error
                .downcast_ref::<ApiError>()
                .is_some_and(|error| error.status == StatusCode::NOT_FOUND);
            if unknown {
                error.context(
                    "it does not tell what agents find there; is it an older version of Faceoff?",
                )
            } else {
                error
            }
        })
    }

    /// Organiser: how the days of a stage fit into their time.
    pub async fn capacity(&self, id: StageId) -> anyhow::Result<CapacityView> {
        self.get(&format!("/stages/{id}/capacity")).await
    }

    /// Organiser: has the boards of a stage stand still.
    pub async fn freeze(&self, id: StageId, reason: &str) -> anyhow::Result<StageView> {
        let request = self.request(Method::POST, &format!("/stages/{id}/freeze"));
        let reason = reason.to_owned();
        read(self.send(request.json(&Reason { reason })).await?).await
    }

    /// Organiser: has the boards of a stage show everything again.
    pub async fn unfreeze(&self, id: StageId) -> anyhow::Result<StageView> {
        let request = self.request(Method::POST, &format!("/stages/{id}/unfreeze"));
        read(self.send(request).await?).await
    }

    /// Organiser: plays a day that was missed.
    pub async fn start_missed_day(
        &self,
        id: StageId,
        wanted: &MissedDay,
    ) -> anyhow::Result<DayView> {
        let request = self.request(Method::POST, &format!("/stages/{id}/days"));
        read(self.send(request.json(wanted)).await?).await
    }

    /// Organiser: gives a team one more evaluation of a day.
    pub async fn extra_turn(
        &self,
        of: StageDay,
        wanted: &ExtraTurn,
    ) -> anyhow::Result<EvaluationView> {
        let path = format!("/stages/{}/days/{}/extra-turn", of.stage, of.date);
        let request = self.request(Method::POST, &path);
        read(self.send(request.json(wanted)).await?).await
    }

    /// Organiser: makes a stage.
    pub async fn create_stage(&self, new: &NewStage) -> anyhow::Result<StageView> {
        let request = self.request(Method::POST, "/stages").json(new);
        read(self.send(request).await?).await
    }

    /// Organiser: changes a stage.
    pub async fn change_stage(
        &self,
        id: StageId,
        change: &StageChange,
    ) -> anyhow::Result<StageView> {
        let request = self.request(Method::PATCH, &format!("/stages/{id}"));
        read(self.send(request.json(change)).await?).await
    }

    /// Organiser: starts a stage's final day.
    pub async fn start_final_day(&self, id: StageId) -> anyhow::Result<DayView> {
        let request = self.request(Method::POST, &format!("/stages/{id}/final"));
        read(self.send(request).await?).await
    }

    /// Organiser: signs a stage's result off; `confirm` is its name.
    pub async fn finalise(
        &self,
        id: StageId,
        confirm: Option<String>,
    ) -> anyhow::Result<StageView> {
        let request = self.request(Method::POST, &format!("/stages/{id}/finalise"));
        read(self.send(request.json(&Confirmation { confirm })).await?).await
    }

    /// Team: makes an evaluation of its own public.
    pub async fn publish(&self, id: EvaluationId) -> anyhow::Result<EvaluationView> {
        let request = self.request(Method::POST, &format!("/evaluations/{id}/publish"));
        read(self.send(request).await?).await
    }

    /// Organiser: plays an evaluation again that was cancelled or failed by the server's fault.
    pub async fn rerun(&self, id: EvaluationId) -> anyhow::Result<EvaluationView> {
        let request = self.request(Method::POST, &format!("/evaluations/{id}/rerun"));
        read(self.send(request).await?).await
    }

    /// Organiser: stops an evaluation.
    pub async fn cancel(&self, id: EvaluationId, reason: &str) -> anyhow::Result<EvaluationView> {
        let request = self
            .request(Method::POST, &format!("/evaluations/{id}/cancel"))
            .json(&Cancellation {
                reason: reason.to_owned(),
            });
        read(self.send(request).await?).await
    }

    /// Organiser: takes a result off the boards.
    pub async fn void(
        &self,
        id: EvaluationId,
        decision: &Decision,
    ) -> anyhow::Result<EvaluationView> {
        let request = self.request(Method::POST, &format!("/evaluations/{id}/void"));
        read(self.send(request.json(decision)).await?).await
    }

    /// Organiser: takes a whole day off the boards.
    pub async fn void_day(&self, of: StageDay, decision: &Decision) -> anyhow::Result<DayView> {
        let path = format!("/stages/{}/days/{}/void", of.stage, of.date);
        let request = self.request(Method::POST, &path);
        read(self.send(request.json(decision)).await?).await
    }

    /// Organiser: holds the queue.
    pub async fn pause(&self, reason: &str) -> anyhow::Result<()> {
        let reason = reason.to_owned();
        let request = self.request(Method::POST, "/queue/pause");
        self.send(request.json(&Reason { reason })).await.map(drop)
    }

    /// Organiser: lets the queue go on.
    pub async fn resume(&self) -> anyhow::Result<()> {
        let request = self.request(Method::POST, "/queue/resume");
        self.send(request).await.map(drop)
    }

    /// Organiser: disqualifies a team.
    pub async fn disqualify(&self, id: TeamId, decision: &Decision) -> anyhow::Result<TeamView> {
        let request = self.request(Method::POST, &format!("/teams/{id}/disqualify"));
        read(self.send(request.json(decision)).await?).await
    }

    /// Organiser: lets a disqualified team play again.
    pub async fn reinstate(&self, id: TeamId, reason: &str) -> anyhow::Result<TeamView> {
        let request = self.request(Method::POST, &format!("/teams/{id}/reinstate"));
        let reason = reason.to_owned();
        read(self.send(request.json(&Reason { reason })).await?).await
    }

    /// Team: who we are, what plays for us today, and what we enter next.
    pub async fn me(&self) -> anyhow::Result<MeView> {
        self.get("/me").await
    }

    /// Organiser: all evaluations of a day (today). Team: its own (all).
    pub async fn evaluations(&self, day: Option<Date>) -> anyhow::Result<Vec<EvaluationView>> {
        let request = self.request(Method::GET, "/evaluations");
        let request = match day {
            Some(day) => request.query(&[("day", day.to_string())]),
            None => request,
        };
        self.list(request).await
    }

    /// Team: its newest evaluations, so many at most.
    pub async fn newest_evaluations(&self, limit: usize) -> anyhow::Result<Vec<EvaluationView>> {
        let request = self.request(Method::GET, "/evaluations");
        let request = request.query(&[("limit", limit.clamp(1, 200))]);
        let mut newest: Vec<EvaluationView> = read(self.send(request).await?).await?;
        newest.truncate(limit);
        Ok(newest)
    }

    /// Organiser: what was changed last, of what the parameters of `GET /events` let through.
    pub async fn events(&self, wanted: &[(&str, String)]) -> anyhow::Result<EventsView> {
        let request = self.request(Method::GET, "/events").query(wanted);
        read(self.send(request).await?).await
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
        read(self.send(self.request(Method::GET, path)).await?).await
    }

    async fn tell<T: DeserializeOwned>(
        &self,
        method: Method,
        path: &str,
        body: &impl Serialize,
    ) -> anyhow::Result<T> {
        let request = self.request(method, path).json(body);
        read(self.send(request).await?).await
    }

    async fn act<T: DeserializeOwned>(&self, method: Method, path: &str) -> anyhow::Result<T> {
        read(self.send(self.request(method, path)).await?).await
    }

    async fn send(&self, request: RequestBuilder) -> anyhow::Result<Response> {
        let base = &self.address.base;
        let sent = request.send().await.map_err(reqwest::Error::without_url);
        let response = sent.map_err(|error| {
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
        if let (true, Some(elsewhere)) = (
            status.is_redirection(),
            response.headers().get(header::LOCATION),
        ) {
            bail!(
                "{base} says that it is elsewhere now ({}); give that server's address",
                String::from_utf8_lossy(elsewhere.as_bytes())
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
                anyhow!("it answered {status}, and not as a Faceoff server would")
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

async fn read<T: DeserializeOwned>(response: Response) -> anyhow::Result<T> {
    let bytes = response
        .bytes()
        .await
        .context("reading the server's answer")?;
    serde_json::from_slice(&bytes).context(Unreachable(
        "the server's answer is not understood; is it another version of Faceoff?".to_owned(),
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
