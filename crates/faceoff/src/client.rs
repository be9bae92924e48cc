//! A client of the REST API. It reads the very types that the server writes.

mod archive;
mod bundle_file;
mod game;
mod http;
mod kept;
mod people;
mod proposals;
mod sse;
mod tournament;

use anyhow::{Context, bail};
use bundle_file::BundleFile;
use faceoff_http::{
    API_BASE,
    requests::{
        Cancellation, CloseSeason, Confirmation, Decision, ExtraTurn, MissedDay, NewStage, NewTeam,
        Reason, StageChange, StartDay, SubmissionChange,
    },
    views::{
        board::BoardView,
        capacity::CapacityView,
        comparison::ComparisonView,
        day::DayView,
        evaluation::EvaluationView,
        event::EventsView,
        me::MeView,
        runtimes::RuntimesView,
        season::SeasonView,
        stage::StageView,
        submission::SubmissionView,
        team::{TeamView, TeamWithToken},
    },
};
use faceoff_types::{EvaluationId, StageDay, StageId, SubmissionId, TeamId};
use futures::StreamExt;
use http::http;
use indicatif::ProgressBar;
use jiff::civil::Date;
use reqwest::{Method, RequestBuilder, Response, StatusCode, header};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
pub use sse::ServerEvent;
use std::{path::Path, time::Duration};
use tokio_util::io::ReaderStream;

/// Longest silence of the server.
const PATIENCE: Duration = Duration::from_secs(60);

/// A problem that the server reported (RFC 9457).
#[derive(Debug, Clone, thiserror::Error)]
#[error("the server refused ({status}, {title}): {detail}")]
pub struct ApiError {
    /// HTTP status.
    pub status: StatusCode,
    /// The kind of problem in words.
    pub title: String,
    /// What was expected, what came and what to do.
    pub detail: String,
}

/// A server, and who we are to it.
#[derive(Debug, Clone)]
pub struct Client {
    http: reqwest::Client,
    base: String,
    token: Option<String>,
}

impl Client {
    /// A client of `server` (e.g. `http://127.0.0.1:8080`), with a bearer token or without.
    ///
    /// # Errors
    /// If `server` is no `http://` address.
    pub fn new(server: &str, token: Option<&str>) -> anyhow::Result<Self> {
        let url = reqwest::Url::parse(server).with_context(|| {
            format!("{server:?} is no address; expected e.g. http://127.0.0.1:8080")
        })?;
        if url.scheme() != "http" {
            bail!(
                "{server}: this program speaks http only; for a server behind TLS, tunnel to it \
                 (e.g. ssh -L) or upload with another client, as docs/api.md shows"
            );
        }
        Ok(Self {
            http: http(PATIENCE)?,
            base: server.trim_end_matches('/').to_owned(),
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

    /// Does the server answer?
    ///
    /// # Errors
    /// If it does not, or not well.
    pub async fn health(&self) -> anyhow::Result<()> {
        self.send(self.request(Method::GET, "/health"))
            .await
            .map(drop)
    }

    /// The overall board.
    ///
    /// # Errors
    /// As [`ApiError`], or when the server cannot be reached; so for all calls below.
    pub async fn board(&self) -> anyhow::Result<BoardView> {
        self.get("/board").await
    }

    /// Two finished evaluations on the same episodes.
    pub async fn compare(
        &self,
        a: EvaluationId,
        b: EvaluationId,
    ) -> anyhow::Result<ComparisonView> {
        self.get(&format!("/evaluations/{a}/compare/{b}")).await
    }

    /// The season.
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
        self.get("/teams").await
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

    /// Team: uploads a bundle, an archive or a folder (packed on the way).
    pub async fn upload(&self, bundle: &Path) -> anyhow::Result<SubmissionView> {
        self.upload_with(bundle, &ProgressBar::hidden()).await
    }

    /// Team: uploads a bundle and shows how far it is.
    pub async fn upload_with(
        &self,
        bundle: &Path,
        progress: &ProgressBar,
    ) -> anyhow::Result<SubmissionView> {
        let path = bundle.to_owned();
        let bundle = tokio::task::spawn_blocking(move || BundleFile::open(&path))
            .await
            .context("packing the bundle")??;
        let bytes = bundle.bytes();
        let limit = self.me().await?.max_bundle_bytes;
        if bytes > limit {
            bail!(
                "the bundle has {bytes} bytes, the server takes at most {limit}; leave out what the \
                 agent does not need to run"
            );
        }
        progress.set_length(bytes);
        let file = tokio::fs::File::open(bundle.path())
            .await
            .with_context(|| format!("opening {}", bundle.path().display()))?;
        let counted = progress.clone();
        let stream = ReaderStream::with_capacity(file, 256 * 1024).inspect(move |chunk| {
            counted.inc(chunk.as_ref().map_or(0, |chunk| chunk.len() as u64));
        });
        let request = self
            .request(Method::POST, "/submissions")
            .query(&[("file_name", bundle.name())])
            .header(header::CONTENT_TYPE, "application/octet-stream")
            .header(header::CONTENT_LENGTH, bytes)
            .body(reqwest::Body::wrap_stream(stream));
        read(self.send(request).await?).await
    }

    /// Team or organiser: one submission.
    pub async fn submission(&self, id: SubmissionId) -> anyhow::Result<SubmissionView> {
        self.get(&format!("/submissions/{id}")).await
    }

    /// Team: chooses the submission that plays at the next cut.
    pub async fn activate(&self, id: SubmissionId) -> anyhow::Result<SubmissionView> {
        let request = self.request(Method::POST, &format!("/submissions/{id}/activate"));
        read(self.send(request).await?).await
    }

    /// Team: its submissions, newest first.
    pub async fn submissions(&self) -> anyhow::Result<Vec<SubmissionView>> {
        self.get("/submissions").await
    }

    /// Team: takes a submission back.
    pub async fn withdraw(&self, id: SubmissionId) -> anyhow::Result<SubmissionView> {
        let request = self.request(Method::POST, &format!("/submissions/{id}/withdraw"));
        read(self.send(request).await?).await
    }

    /// Team: changes what it says of a submission.
    pub async fn describe(
        &self,
        id: SubmissionId,
        change: &SubmissionChange,
    ) -> anyhow::Result<SubmissionView> {
        let request = self.request(Method::PATCH, &format!("/submissions/{id}"));
        read(self.send(request.json(change)).await?).await
    }

    /// Organiser: all evaluations of a day (today). Team: its own (all).
    pub async fn evaluations(&self, day: Option<Date>) -> anyhow::Result<Vec<EvaluationView>> {
        let request = self.request(Method::GET, "/evaluations");
        let request = match day {
            Some(day) => request.query(&[("day", day.to_string())]),
            None => request,
        };
        read(self.send(request).await?).await
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
            .request(method, format!("{}{API_BASE}{path}", self.base));
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
        let response = request
            .send()
            .await
            .map_err(reqwest::Error::without_url)
            .with_context(|| format!("talking to {}", self.base))?;
        let status = response.status();
        if status.is_success() {
            return Ok(response);
        }
        #[derive(Deserialize)]
        struct Problem {
            title: String,
            detail: String,
        }
        let text = response.text().await.unwrap_or_default();
        let Ok(Problem { title, detail }) = serde_json::from_str(&text) else {
            bail!(
                "{} answered {status}, and not as a Faceoff server would",
                self.base
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
    serde_json::from_slice(&bytes)
        .context("the server's answer is not understood; is it another version of Faceoff?")
}

#[cfg(test)]
mod tests;
