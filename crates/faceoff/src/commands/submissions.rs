//! `faceoff submissions`: lists and manages a team's submissions.

use super::{
    ablation_text::ablation_text,
    next_cutoff::next_cutoff_text,
    output::{print, print_download, print_list, time_text},
    queue::queue_text,
    resource_references::SubmissionArg,
    server::ServerArgs,
};
use crate::client::Client;
use clap::{Args, Subcommand};
use faceoff_api::{
    requests::{DeleteSubmission, SubmissionChange},
    views::{
        me::MeView,
        submission::{SubmissionStatus, SubmissionView},
    },
};
use faceoff_types::SubmissionId;
use std::path::{Path, PathBuf};

/// Lists, labels, withdraws, downloads and deletes the team's submissions.
#[derive(Debug, Args)]
pub struct SubmissionsCommand {
    #[command(flatten)]
    server: ServerArgs,
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// List the submissions, the newest first
    List,
    /// Show today's evaluation, pending jobs with their positions in the queue, and what happens next
    Status,
    /// Set the label of a submission, visible to the team and organisers only
    Label {
        #[command(flatten)]
        submission: SubmissionArg,
        /// 1 to 80 characters; without it, the label is removed
        label: Option<String>,
    },
    /// Set the note of a submission, visible to the team and organisers only
    Note {
        #[command(flatten)]
        submission: SubmissionArg,
        /// 1 to 2000 characters; without it, the note is removed
        note: Option<String>,
    },
    /// Download the bundle of a submission as it was uploaded
    Download {
        #[command(flatten)]
        submission: SubmissionArg,
        /// The file to write; an existing file is replaced
        file: PathBuf,
    },
    /// Delete the bundle of a submission permanently; its results are kept; without --confirm, only list the
    /// effects
    Delete {
        #[command(flatten)]
        submission: SubmissionArg,
        /// Reason, 1 to 500 characters
        #[arg(long)]
        reason: Option<String>,
        /// The file name of the bundle, as confirmation
        #[arg(long, value_name = "FILE_NAME")]
        confirm: Option<String>,
    },
    /// Show the effect of each perturbation on a submission, if the organisers have requested an ablation
    Ablation {
        #[command(flatten)]
        submission: SubmissionArg,
    },
    /// Withdraw a submission: it is not evaluated any more, unless `faceoff activate` makes it active again
    Withdraw {
        #[command(flatten)]
        submission: SubmissionArg,
    },
}

impl SubmissionsCommand {
    /// Runs the chosen action.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(self.run_action())
    }

    async fn run_action(self) -> anyhow::Result<()> {
        let json = self.server.json;
        let client = self.server.client()?;
        match self.action {
            Action::List => {
                let submissions = client.submissions().await?;
                print_list(
                    json,
                    &submissions,
                    submission_line,
                    "no submissions yet; upload one with faceoff submit BUNDLE",
                )
            }
            Action::Status => {
                let me = client.me().await?;
                print(json, &me, |me| status_lines(me).join("\n"))
            }
            Action::Label { submission, label } => {
                let change = SubmissionChange {
                    label: Some(label),
                    ..SubmissionChange::default()
                };
                change_submission(&client, json, submission.find(&client).await?, &change).await
            }
            Action::Note { submission, note } => {
                let change = SubmissionChange {
                    note: Some(note),
                    ..SubmissionChange::default()
                };
                change_submission(&client, json, submission.find(&client).await?, &change).await
            }
            Action::Download { submission, file } => {
                let id = submission.find(&client).await?;
                download(&client, json, id, &file).await
            }
            Action::Delete {
                submission,
                reason,
                confirm,
            } => {
                let deletion = DeleteSubmission { confirm, reason };
                let deleted = client
                    .delete_submission(submission.find(&client).await?, &deletion)
                    .await?;
                print(json, &deleted, submission_line)
            }
            Action::Ablation { submission } => {
                let newest = client.ablation(submission.find(&client).await?).await?;
                print(json, &newest, ablation_text)
            }
            Action::Withdraw { submission } => {
                let id = submission.find(&client).await?;
                withdraw(&client, json, id).await
            }
        }
    }
}

async fn change_submission(
    client: &Client,
    json: bool,
    submission: SubmissionId,
    change: &SubmissionChange,
) -> anyhow::Result<()> {
    let changed = client.change_submission(submission, change).await?;
    print(json, &changed, submission_line)
}

/// Downloads the bundle of a submission with the client's token.
pub(super) async fn download(
    client: &Client,
    json: bool,
    submission: SubmissionId,
    file: &Path,
) -> anyhow::Result<()> {
    print_download(json, async |bar| {
        let hash = client.submission(submission).await?.blake3;
        let download = client.download_submission(submission, file, &hash, bar);
        download.await
    })
    .await
}

/// Withdraws a submission and prints which one will be evaluated instead.
pub(super) async fn withdraw(
    client: &Client,
    json: bool,
    submission: SubmissionId,
) -> anyhow::Result<()> {
    let withdrawn = client.withdraw(submission).await?;
    let me = client.me().await?;
    print(json, &withdrawn, |withdrawn| {
        let next = match me.active_submission {
            Some(active) => next_cutoff_text(&me, active),
            None => "the team has no active submission: upload another one, or activate one with faceoff activate ID".to_owned(),
        };
        format!("{}\n{next}", submission_line(withdrawn))
    })
}

/// The team's current state, line by line.
pub(super) fn status_lines(me: &MeView) -> Vec<String> {
    let mut lines = Vec::new();
    match (&me.today.evaluation, &me.today.next) {
        (Some(evaluation), next) => {
            lines.push(format!("{}: evaluation {evaluation}", me.today.day));
            lines.extend(
                me.today
                    .queue
                    .as_ref()
                    .map(|queue| format!("  {}", queue_text(queue))),
            );
            lines.extend(next.as_ref().map(|next| format!("  next: {next}")));
        }
        (None, _) => lines.push(format!("{}: no evaluation of the team", me.today.day)),
    }
    for pending in &me.validating {
        lines.push(format!("submission {}: validating", pending.submission));
        lines.extend(
            pending
                .queue
                .as_ref()
                .map(|queue| format!("  {}", queue_text(queue))),
        );
        lines.push(format!("  next: {}", pending.next));
    }
    match me.active_submission {
        Some(active) => lines.push(format!(
            "submission {active}: {}",
            next_cutoff_text(me, active)
        )),
        None => lines.push(
            "the team has no active submission; upload one with faceoff submit BUNDLE".to_owned(),
        ),
    }
    lines
}

/// A submission as one line, followed by its note.
pub(super) fn submission_line(submission: &SubmissionView) -> String {
    let state = match &submission.status {
        SubmissionStatus::Validating => match &submission.queue {
            Some(queue) => format!("validating, {}", queue_text(queue)),
            None => "validating".to_owned(),
        },
        SubmissionStatus::Valid { .. } => "valid".to_owned(),
        SubmissionStatus::Invalid { reason, .. } => format!("invalid: {reason}"),
        SubmissionStatus::PlatformFailed { reason } => {
            format!("validation failed by a platform fault: {reason}")
        }
    };
    let mut line = format!(
        "{}  {}  {}  {state}",
        submission.id,
        time_text(submission.created_at),
        submission.file_name
    );
    if submission.active {
        line.push_str(", active");
    }
    if submission.withdrawn_at.is_some() {
        line.push_str(", withdrawn");
    }
    match (&submission.deleted, &submission.bundle_removed) {
        (Some(deleted), Some(removed)) => line.push_str(&format!(
            ", deleted on {} {}",
            time_text(deleted.at),
            removed.reason
        )),
        (None, Some(removed)) if matches!(submission.status, SubmissionStatus::Valid { .. }) => {
            line.push_str(&format!(
                ", bundle removed on {} {}",
                time_text(removed.at),
                removed.reason
            ));
        }
        _ => {}
    }
    if let Some(label) = &submission.label {
        line.push_str(&format!(" “{label}”"));
    }
    if let Some(same) = submission.same_as {
        line.push_str(&format!(", same bundle as {same}"));
    }
    for text in submission.note.iter().flat_map(|note| note.lines()) {
        line.push_str(&format!("\n    {text}"));
    }
    line
}
