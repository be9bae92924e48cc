//! `faceoff evaluation`: one evaluation, and where it broke constraints.

use super::{
    evaluation_text::{state, tasks},
    output::print,
    server::ServerArgs,
};
use crate::client::Client;
use clap::Args;
use faceoff_api::views::{
    evaluation::{EvaluationStatus, EvaluationView},
    violations::ViolationsView,
};
use faceoff_types::EvaluationId;

/// Shows an evaluation: how far it is, or what came of it, by task.
#[derive(Debug, Args)]
pub struct EvaluationCommand {
    #[command(flatten)]
    which: Which,
    #[command(flatten)]
    server: ServerArgs,
}

/// What of which.
#[derive(Debug, Args)]
pub(super) struct Which {
    /// The evaluation's id
    evaluation: EvaluationId,
    /// In place of that the episodes in which it broke a constraint or answered slowly
    #[arg(long)]
    violations: bool,
}

impl EvaluationCommand {
    /// Asks the server.
    ///
    /// # Errors
    /// If it cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        // What is public is everybody's.
        super::block_on(async {
            show(&self.server.anybody()?, self.server.json, &self.which).await
        })
    }
}

/// Shows it, to whoever the client is.
pub(super) async fn show(client: &Client, json: bool, which: &Which) -> anyhow::Result<()> {
    if which.violations {
        let violations = client.violations(which.evaluation).await?;
        return print(json, &violations, || broken(&violations));
    }
    let evaluation = client.evaluation(which.evaluation).await?;
    print(json, &evaluation, || whole(&evaluation))
}

fn whole(evaluation: &EvaluationView) -> String {
    let mut lines = vec![
        format!(
            "{}, {}: {}",
            evaluation.team_name,
            evaluation.day,
            state(evaluation)
        ),
        format!("submission {}", evaluation.submission),
    ];
    match &evaluation.status {
        EvaluationStatus::Finished {
            result,
            dataset_blake3,
            ..
        } => {
            lines.extend(result.as_ref().map(|result| tasks(&result.tasks)));
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

fn broken(violations: &ViolationsView) -> String {
    let mut lines = Vec::new();
    for (task, of) in &violations.tasks {
        for (name, list) in [
            ("ee", &of.ee),
            ("link", &of.link),
            ("joint_pos", &of.joint_pos),
            ("joint_vel", &of.joint_vel),
        ] {
            lines.extend(list.iter().map(|one| {
                format!(
                    "{task:<8} episode {:>5}  {name:<10} first at step {}, at {} steps, {:.4} beyond at most",
                    one.episode, one.first_step, one.steps, one.max
                )
            }));
        }
        lines.extend(
            of.computation_time
                .iter()
                .map(|slow| format!("{task:<8} episode {:>5}  slow answers", slow.episode)),
        );
    }
    super::output::or_none(lines, "no episode broke anything")
}
