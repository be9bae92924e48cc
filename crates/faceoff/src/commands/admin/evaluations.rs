//! `faceoff admin rerun`, `cancel`, `void`, `void-day` and `evaluations`: decisions about evaluations, and their list.

use super::evaluation_lines::{evaluation_line, evaluation_lines};
use crate::{
    client::Client,
    commands::{
        output::{print, print_list},
        stage_lookup::find_stage,
    },
};
use clap::Subcommand;
use faceoff_api::{requests::Decision, views::evaluation::EvaluationStatus};
use faceoff_types::{EvaluationId, StageDay};
use jiff::civil::Date;

#[derive(Debug, Subcommand)]
pub(super) enum EvaluationAction {
    /// Repeat an evaluation that was cancelled, voided or failed by a platform fault: same agent, same episodes
    Rerun {
        /// The evaluation's id
        evaluation: EvaluationId,
    },
    /// Cancel an unfinished evaluation
    Cancel {
        /// The evaluation's id
        evaluation: EvaluationId,
        /// Shown to the team
        reason: String,
    },
    /// Void a finished evaluation, which leaves the boards; without --confirm, only list the effects
    Void {
        /// The evaluation's id
        evaluation: EvaluationId,
        /// Shown publicly
        reason: String,
        /// The team's name, as confirmation
        #[arg(long, value_name = "TEAM")]
        confirm: Option<String>,
    },
    /// Void an evaluation day and cancel its unfinished evaluations; without --confirm, only list the effects
    VoidDay {
        /// The date of the day
        day: Date,
        /// Shown publicly
        reason: String,
        /// The stage's name or id
        #[arg(long)]
        stage: String,
        /// The same date, as confirmation
        #[arg(long, value_name = "DATE")]
        confirm: Option<String>,
    },
}

pub(super) async fn run_action(
    client: &Client,
    json: bool,
    action: EvaluationAction,
) -> anyhow::Result<()> {
    let evaluation = match action {
        EvaluationAction::Rerun { evaluation } => client.rerun(evaluation).await?,
        EvaluationAction::Cancel { evaluation, reason } => {
            client.cancel(evaluation, reason).await?
        }
        EvaluationAction::Void {
            evaluation,
            reason,
            confirm,
        } => {
            let decision = Decision { reason, confirm };
            client.void(evaluation, &decision).await?
        }
        EvaluationAction::VoidDay {
            day,
            reason,
            stage,
            confirm,
        } => {
            let stage = find_stage(client, &stage).await?.id;
            let stage_day = StageDay { stage, date: day };
            let decision = Decision { reason, confirm };
            let voided = client.void_day(stage_day, &decision).await?;
            return print(json, &voided, |voided| evaluation_lines(voided).join("\n"));
        }
    };
    print(json, &evaluation, evaluation_line)
}

/// Prints the evaluations of a day, by default of today.
pub(super) async fn list(client: &Client, json: bool, day: Option<Date>) -> anyhow::Result<()> {
    let mut evaluations = client.evaluations(day).await?;
    for evaluation in &mut evaluations {
        // Lists leave out the faults.
        if let EvaluationStatus::AgentFailed { .. } = evaluation.status {
            *evaluation = client.evaluation(evaluation.id).await?;
        }
    }
    print_list(
        json,
        &evaluations,
        evaluation_line,
        "no evaluation on that day",
    )
}
