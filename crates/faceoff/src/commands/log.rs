//! `faceoff log`: what an agent wrote, and what it did wrong.

use super::{game::own_side, output::print, server::ServerArgs};
use crate::client::{ApiError, Client};
use anyhow::{Context, bail};
use clap::Args;
use faceoff_api::views::{
    evaluation::{EvaluationStatus, FaultView},
    submission::SubmissionStatus,
};
use faceoff_types::{EvaluationId, GameId, Side, SubmissionId};
use reqwest::StatusCode;
use serde::Serialize;

/// Prints what an agent wrote to its standard error, with its faults: in the smoke run of a submission, in an evaluation
/// that it failed, or in a game.
#[derive(Debug, Args)]
pub struct LogCommand {
    /// The id of a submission, an evaluation or a game
    id: String,
    /// Of a game, as an organiser: of which side, 1 (home) or 2 (away)
    #[arg(long, value_parser = super::game::side)]
    side: Option<Side>,
    #[command(flatten)]
    server: ServerArgs,
}

/// What is printed with `--json`.
#[derive(Debug, Serialize)]
struct Log {
    /// Of what: `submission`, `evaluation` or `game`.
    of: &'static str,
    id: String,
    /// Of submissions and evaluations, in a word.
    #[serde(skip_serializing_if = "Option::is_none")]
    state: Option<String>,
    /// Why there is nothing more.
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<String>,
    faults: Vec<FaultView>,
    /// `null`: it wrote nothing, or that is not shown (yet).
    log: Option<String>,
    /// What happens next; absent of games.
    #[serde(skip_serializing_if = "Option::is_none")]
    next: Option<String>,
}

impl LogCommand {
    /// Asks the server of what it is the id, and prints its log.
    ///
    /// # Errors
    /// If it is of nothing that the server shows to us.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async {
            let client = self.server.client()?;
            let log = self.find(&client).await?;
            print(self.server.json, &log, || log.text())
        })
    }

    async fn find(&self, client: &Client) -> anyhow::Result<Log> {
        // All of them are ids of the same kind.
        let submission: SubmissionId = self.id.parse().with_context(|| {
            format!(
                "{:?}: expected the id of a submission, an evaluation or a game",
                self.id
            )
        })?;
        if let Some(found) = there(client.submission(submission).await)? {
            return of_submission(&self.id, &found.status, found.next.clone());
        }
        let evaluation: EvaluationId = self.id.parse()?;
        if let Some(found) = there(client.evaluation(evaluation).await)? {
            return of_evaluation(&self.id, found.status, found.next);
        }
        let game: GameId = self.id.parse()?;
        let Some(found) = there(client.game(game).await)? else {
            bail!(
                "no submission, evaluation or game of yours has the id {}",
                self.id
            );
        };
        let side = own_side(client, &found, self.side).await?;
        Ok(Log {
            of: "game",
            id: self.id.clone(),
            state: None,
            reason: None,
            faults: Vec::new(),
            log: Some(client.game_log(game, side).await?),
            next: None,
        })
    }
}

/// What was found; nothing, if there is none of that id.
fn there<T>(found: anyhow::Result<T>) -> anyhow::Result<Option<T>> {
    match found {
        Ok(found) => Ok(Some(found)),
        Err(error) => match error.downcast_ref::<ApiError>() {
            Some(refused) if refused.status == StatusCode::NOT_FOUND => Ok(None),
            _ => Err(error),
        },
    }
}

/// The word by which the API knows a state.
fn word(status: &impl Serialize) -> anyhow::Result<Option<String>> {
    let value = serde_json::to_value(status).context("writing JSON")?;
    Ok(value["state"].as_str().map(str::to_owned))
}

fn of_submission(id: &str, status: &SubmissionStatus, next: String) -> anyhow::Result<Log> {
    let (reason, log) = match status {
        SubmissionStatus::Validating => (None, None),
        SubmissionStatus::Valid { log } => (None, log.clone()),
        SubmissionStatus::Invalid { reason, log } => (Some(reason.clone()), log.clone()),
        SubmissionStatus::ValidationError { reason } => (Some(reason.clone()), None),
    };
    Ok(Log {
        of: "submission",
        id: id.to_owned(),
        state: word(status)?,
        reason,
        faults: Vec::new(),
        log,
        next: Some(next),
    })
}

fn of_evaluation(id: &str, status: EvaluationStatus, next: String) -> anyhow::Result<Log> {
    let state = word(&status)?;
    let (reason, faults, log) = match status {
        EvaluationStatus::AgentFailed { faults, log, .. } => {
            (None, faults.unwrap_or_default(), log)
        }
        EvaluationStatus::PlatformFailed { reason, .. }
        | EvaluationStatus::NotPlayed { reason, .. }
        | EvaluationStatus::Cancelled { reason, .. } => (Some(reason), Vec::new(), None),
        EvaluationStatus::Queued
        | EvaluationStatus::Running
        | EvaluationStatus::Finalising
        | EvaluationStatus::Finished { .. } => (None, Vec::new(), None),
    };
    Ok(Log {
        of: "evaluation",
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
                self.of,
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
            None => lines.push("it has no log, or none that is shown".to_owned()),
        }
        lines.extend(self.next.as_ref().map(|next| format!("next: {next}")));
        lines.join("\n")
    }
}
