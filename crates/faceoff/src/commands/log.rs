//! `faceoff log`: prints the log and the faults of an agent.

use super::{game::own_side, output::print, server::ServerArgs};
use crate::client::{Client, is_refused_with};
use anyhow::{Context, bail};
use clap::Args;
use faceoff_api::views::{
    evaluation::{EvaluationStatus, FaultView},
    submission::SubmissionStatus,
};
use faceoff_types::{EvaluationId, GameId, Side, SubmissionId};
use reqwest::StatusCode;
use serde::Serialize;

/// Prints the log of an agent (its standard error) and its faults: of a submission's validation run, of an evaluation
/// that the agent failed, or of a game.
#[derive(Debug, Args)]
pub struct LogCommand {
    /// The id of a submission, an evaluation or a game; or `latest`, your team's newest submission or evaluation
    id: String,
    /// For organisers, with a game: the side, 1 (home) or 2 (away)
    #[arg(long, value_parser = super::game::parse_side)]
    side: Option<Side>,
    #[command(flatten)]
    server: ServerArgs,
}

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct Log {
    /// `submission`, `evaluation` or `game`.
    #[serde(rename = "of")]
    kind: &'static str,
    id: String,
    /// State of a submission or evaluation; absent for a game.
    #[serde(skip_serializing_if = "Option::is_none")]
    state: Option<String>,
    /// Reason of an end without a result.
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<String>,
    faults: Vec<FaultView>,
    /// `null`: the log is empty, or not shown (yet).
    log: Option<String>,
    /// What happens next; absent for a game.
    #[serde(skip_serializing_if = "Option::is_none")]
    next: Option<String>,
}

impl LogCommand {
    /// Finds the submission, evaluation or game with the id and prints its log.
    ///
    /// # Errors
    /// If the id is unknown, or the caller may not see it.
    pub fn run(mut self) -> anyhow::Result<()> {
        super::block_on(async {
            let client = self.server.client()?;
            if self.id == "latest" {
                self.id = latest(&client).await?;
            }
            let log = self.find(&client).await?;
            print(self.server.json, &log, |log| log.text())
        })
    }

    async fn find(&self, client: &Client) -> anyhow::Result<Log> {
        // Ids of submissions, evaluations and games have the same form.
        let submission: SubmissionId = self.id.parse().with_context(|| {
            format!(
                "{:?}: expected the id of a submission, an evaluation or a game",
                self.id
            )
        })?;
        if let Some(found) = none_if_missing(client.submission(submission).await)? {
            return submission_log(&self.id, &found.status, found.next.clone());
        }
        let evaluation: EvaluationId = self.id.parse()?;
        if let Some(found) = none_if_missing(client.evaluation(evaluation).await)? {
            return evaluation_log(&self.id, found.status, found.next);
        }
        let game: GameId = self.id.parse()?;
        let Some(found) = none_if_missing(client.game(game).await)? else {
            bail!(
                "you have no submission, evaluation or game with the id {}",
                self.id
            );
        };
        let side = own_side(client, &found, self.side).await?;
        Ok(Log {
            kind: "game",
            id: self.id.clone(),
            state: None,
            reason: None,
            faults: Vec::new(),
            log: Some(client.game_log(game, side).await?),
            next: None,
        })
    }
}

/// The id of the team's newest submission or evaluation, whichever was created later.
async fn latest(client: &Client) -> anyhow::Result<String> {
    let submissions = client.submissions().await?;
    let evaluations = client.newest_evaluations(1).await?;
    let submission = submissions.first().map(|found| found.id.to_string());
    let evaluation = evaluations.first().map(|found| found.id.to_string());
    // Ids begin with the time of their creation.
    submission
        .max(evaluation)
        .context("your team has no submission yet")
}

/// Turns the error of an unknown id into `None`.
fn none_if_missing<T>(found: anyhow::Result<T>) -> anyhow::Result<Option<T>> {
    match found {
        Ok(found) => Ok(Some(found)),
        Err(error) if is_refused_with(&error, StatusCode::NOT_FOUND) => Ok(None),
        Err(error) => Err(error),
    }
}

/// The API's name of a state.
fn state_name(status: &impl Serialize) -> anyhow::Result<Option<String>> {
    let value = serde_json::to_value(status).context("writing JSON")?;
    Ok(value["state"].as_str().map(str::to_owned))
}

fn submission_log(id: &str, status: &SubmissionStatus, next: String) -> anyhow::Result<Log> {
    let (reason, log) = match status {
        SubmissionStatus::Validating => (None, None),
        SubmissionStatus::Valid { log } => (None, log.clone()),
        SubmissionStatus::Invalid { reason, log } => (Some(reason.clone()), log.clone()),
        SubmissionStatus::PlatformFailed { reason } => (Some(reason.clone()), None),
    };
    Ok(Log {
        kind: "submission",
        id: id.to_owned(),
        state: state_name(status)?,
        reason,
        faults: Vec::new(),
        log,
        next: Some(next),
    })
}

fn evaluation_log(id: &str, status: EvaluationStatus, next: String) -> anyhow::Result<Log> {
    let state = state_name(&status)?;
    let (reason, faults, log) = match status {
        EvaluationStatus::AgentFailed { faults, log, .. } => {
            (None, faults.unwrap_or_default(), log)
        }
        EvaluationStatus::PlatformFailed { reason, .. }
        | EvaluationStatus::DeadlineMissed { reason, .. }
        | EvaluationStatus::Cancelled { reason, .. } => (Some(reason), Vec::new(), None),
        EvaluationStatus::Queued
        | EvaluationStatus::Running
        | EvaluationStatus::Scoring
        | EvaluationStatus::Finished { .. } => (None, Vec::new(), None),
    };
    Ok(Log {
        kind: "evaluation",
        id: id.to_owned(),
        state,
        reason,
        faults,
        log,
        next: Some(next),
    })
}

impl Log {
    fn text(&self) -> String {
        let mut lines = Vec::new();
        if let Some(state) = &self.state {
            lines.push(format!(
                "{} {}: {}",
                self.kind,
                self.id,
                state.replace('_', " ")
            ));
        }
        lines.extend(self.reason.clone());
        lines.extend(
            self.faults
                .iter()
                .map(|fault| format!("fault: {}", fault.message)),
        );
        match self
            .log
            .as_deref()
            .map(str::trim_end)
            .filter(|log| !log.is_empty())
        {
            Some(log) => lines.push(log.to_owned()),
            None => lines.push("there is no log, or it is not shown".to_owned()),
        }
        lines.extend(self.next.as_ref().map(|next| format!("next: {next}")));
        lines.join("\n")
    }
}
