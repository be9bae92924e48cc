//! `faceoff evaluation`: prints an evaluation, the run of one submission on all tasks, or its violations of the robot's
//! constraints.

use super::{
    evaluation_text::{status_text, task_table},
    output::print,
    resource_references::EvaluationArg,
    server::ServerArgs,
};
use crate::client::Client;
use clap::Args;
use faceoff_api::views::{
    evaluation::{EvaluationStatus, EvaluationView},
    violations::ViolationsView,
};

/// Shows an evaluation: its progress, or its result by task.
#[derive(Debug, Args)]
pub struct EvaluationCommand {
    #[command(flatten)]
    args: EvaluationArgs,
    #[command(flatten)]
    server: ServerArgs,
}

#[derive(Debug, Args)]
pub(super) struct EvaluationArgs {
    #[command(flatten)]
    evaluation: EvaluationArg,
    /// Show the episodes with constraint violations or slow answers instead
    #[arg(long)]
    violations: bool,
}

impl EvaluationCommand {
    /// Requests the evaluation and prints it.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        // Public evaluations need no token.
        super::block_on(async {
            show(
                &self.server.client_with_optional_token()?,
                self.server.json,
                &self.args,
            )
            .await
        })
    }
}

/// Prints an evaluation, requested with the client's token.
pub(super) async fn show(client: &Client, json: bool, args: &EvaluationArgs) -> anyhow::Result<()> {
    let id = args.evaluation.find(client).await?;
    if args.violations {
        let violations = client.violations(id).await?;
        return print(json, &violations, violations_text);
    }
    let evaluation = client.evaluation(id).await?;
    print(json, &evaluation, evaluation_text)
}

fn evaluation_text(evaluation: &EvaluationView) -> String {
    let mut lines = vec![
        format!(
            "{}, {}: {}",
            evaluation.team_name,
            evaluation.day,
            status_text(evaluation)
        ),
        format!("submission {}", evaluation.submission),
    ];
    match &evaluation.status {
        EvaluationStatus::Finished {
            result,
            dataset_blake3,
            ..
        } => {
            lines.extend(result.as_ref().map(|result| task_table(&result.tasks)));
            lines.extend(
                dataset_blake3
                    .as_ref()
                    .map(|hash| format!("dataset BLAKE3 {hash}")),
            );
        }
        EvaluationStatus::AgentFailed { faults, .. } => lines.extend(
            faults
                .iter()
                .flatten()
                .map(|fault| format!("fault: {}", fault.message)),
        ),
        _ => {}
    }
    lines.push(format!("next: {}", evaluation.next));
    lines.join("\n")
}

fn violations_text(violations: &ViolationsView) -> String {
    let mut lines = Vec::new();
    for (task, by_constraint) in &violations.tasks {
        for (name, list) in &by_constraint.constraints {
            lines.extend(list.iter().map(|violation| {
                format!(
                    "{task:<8} episode {:>5}  {name:<10} first at step {}, in {} steps, by at most {:.4}",
                    violation.episode, violation.first_step, violation.steps, violation.max
                )
            }));
        }
        lines.extend(
            by_constraint
                .computation_time
                .iter()
                .map(|slow| format!("{task:<8} episode {:>5}  slow answers", slow.episode)),
        );
    }
    super::output::lines_or(lines, "no violations")
}
