//! `faceoff submissions`: a team's uploads, and what it does with them.

use super::{
    ablation_text::ablation,
    next_cut::next_cut,
    output::{download_bar, downloaded, or_none, print},
    queue::in_queue,
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
use std::path::PathBuf;

/// Lists the team's submissions, names them, takes one back, downloads or deletes one.
#[derive(Debug, Args)]
pub struct SubmissionsCommand {
    #[command(flatten)]
    server: ServerArgs,
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// List them, the newest first
    List,
    /// Tell what plays for the team today, what waits, where it stands in the queue, and what happens next
    Status,
    /// Give one a name that only the team and the organiser see
    Label {
        /// The submission's id
        submission: SubmissionId,
        /// 1 to 80 characters; left out, it has none
        label: Option<String>,
    },
    /// Write about one what only the team and the organiser read
    Note {
        /// The submission's id
        submission: SubmissionId,
        /// 1 to 2000 characters; left out, there is none
        note: Option<String>,
    },
    /// Download the archive of one, as it was uploaded
    Download {
        /// The submission's id
        submission: SubmissionId,
        /// Where to
        file: PathBuf,
    },
    /// Have the archive of one removed for good: nobody plays it again, its results stay; without --confirm, say what
    /// that would do
    Delete {
        /// The submission's id
        submission: SubmissionId,
        /// Why; 1 to 500 characters
        #[arg(long)]
        reason: Option<String>,
        /// The name of its archive
        #[arg(long, value_name = "FILE_NAME")]
        confirm: Option<String>,
    },
    /// Show what each perturbation costs one, if the organisers have had that played
    Ablation {
        /// The submission's id
        submission: SubmissionId,
    },
    /// Take one back: it plays no further day, unless `faceoff activate` chooses it again
    Withdraw {
        /// The submission's id
        submission: SubmissionId,
    },
}

impl SubmissionsCommand {
    /// Does what was asked.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(self.act())
    }

    async fn act(self) -> anyhow::Result<()> {
        let json = self.server.json;
        let client = self.server.client()?;
        match self.action {
            Action::List => {
                let submissions = client.submissions().await?;
                print(json, &submissions, || {
                    or_none(
                        submissions.iter().map(line).collect(),
                        "nothing was uploaded yet: faceoff submit BUNDLE",
                    )
                })
            }
            Action::Status => {
                let me = client.me().await?;
                print(json, &me, || status(&me).join("\n"))
            }
            Action::Label { submission, label } => {
                let change = SubmissionChange {
                    label: Some(label),
                    ..SubmissionChange::default()
                };
                let described = client.describe(submission, &change).await?;
                print(json, &described, || line(&described))
            }
            Action::Note { submission, note } => {
                let change = SubmissionChange {
                    note: Some(note),
                    ..SubmissionChange::default()
                };
                let described = client.describe(submission, &change).await?;
                print(json, &described, || line(&described))
            }
            Action::Download { submission, file } => {
                let bar = download_bar()?;
                let hash = client.submission(submission).await?.blake3;
                let done = client
                    .download_submission(submission, &file, &hash, &bar)
                    .await?;
                bar.finish_and_clear();
                print(json, &done, || downloaded(&done))
            }
            Action::Delete {
                submission,
                reason,
                confirm,
            } => {
                let wanted = DeleteSubmission { confirm, reason };
                let deleted = client.delete_submission(submission, &wanted).await?;
                print(json, &deleted, || line(&deleted))
            }
            Action::Ablation { submission } => {
                let newest = client.ablation(submission).await?;
                print(json, &newest, || ablation(&newest))
            }
            Action::Withdraw { submission } => withdraw(&client, json, submission).await,
        }
    }
}

/// Takes a submission back, and tells what plays in its place.
pub(super) async fn withdraw(
    client: &Client,
    json: bool,
    submission: SubmissionId,
) -> anyhow::Result<()> {
    let withdrawn = client.withdraw(submission).await?;
    let me = client.me().await?;
    print(json, &withdrawn, || {
        let next = match me.active_submission {
            Some(active) => next_cut(&me, active),
            None => "nothing of the team is active: upload another, or choose one with faceoff activate ID".to_owned(),
        };
        format!("{}\n{next}", line(&withdrawn))
    })
}

/// How the team stands today, line by line.
pub(super) fn status(me: &MeView) -> Vec<String> {
    let mut lines = Vec::new();
    match (&me.turn.evaluation, &me.turn.next) {
        (Some(evaluation), next) => {
            lines.push(format!("{}: evaluation {evaluation}", me.turn.day));
            lines.extend(
                me.turn
                    .queue
                    .as_ref()
                    .map(|queue| format!("  {}", in_queue(queue))),
            );
            lines.extend(next.as_ref().map(|next| format!("  next: {next}")));
        }
        (None, _) => lines.push(format!("{}: nothing plays for the team", me.turn.day)),
    }
    for waiting in &me.validating {
        lines.push(format!("submission {}: validating", waiting.submission));
        lines.extend(
            waiting
                .queue
                .as_ref()
                .map(|queue| format!("  {}", in_queue(queue))),
        );
        lines.push(format!("  next: {}", waiting.next));
    }
    match me.active_submission {
        Some(active) => lines.push(format!("submission {active}: {}", next_cut(me, active))),
        None => lines.push("nothing of the team is active: faceoff submit BUNDLE".to_owned()),
    }
    lines
}

pub(super) fn line(submission: &SubmissionView) -> String {
    let state = match &submission.status {
        SubmissionStatus::Validating => match &submission.queue {
            Some(queue) => format!("validating, {}", in_queue(queue)),
            None => "validating".to_owned(),
        },
        SubmissionStatus::Valid { .. } => "valid".to_owned(),
        SubmissionStatus::Invalid { reason, .. } => format!("invalid: {reason}"),
        SubmissionStatus::ValidationError { reason } => format!("not checked: {reason}"),
    };
    let mut line = format!(
        "{}  {}  {}  {state}",
        submission.id,
        submission.created_at.strftime("%Y-%m-%d %H:%M UTC"),
        submission.file_name
    );
    if submission.active {
        line.push_str(", active");
    }
    if submission.withdrawn_at.is_some() {
        line.push_str(", withdrawn");
    }
    match (&submission.deleted, &submission.archive_removed) {
        (Some(deleted), Some(removed)) => line.push_str(&format!(
            ", deleted on {} {}",
            deleted.at.strftime("%Y-%m-%d %H:%M UTC"),
            removed.reason
        )),
        (None, Some(removed)) if matches!(submission.status, SubmissionStatus::Valid { .. }) => {
            line.push_str(&format!(
                ", its archive removed on {} {}",
                removed.at.strftime("%Y-%m-%d %H:%M UTC"),
                removed.reason
            ));
        }
        _ => {}
    }
    if let Some(label) = &submission.label {
        line.push_str(&format!(" “{label}”"));
    }
    if let Some(same) = submission.same_as {
        line.push_str(&format!(", the same archive as {same}"));
    }
    for written in submission.note.iter().flat_map(|note| note.lines()) {
        line.push_str(&format!("\n    {written}"));
    }
    line
}
