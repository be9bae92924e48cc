//! `faceoff submissions`: a team's uploads, and what it does with them.

use super::{
    submit::next_cut,
    team_server::{TeamServer, in_queue},
};
use clap::{Args, Subcommand};
use faceoff_http::{
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
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// List them, the newest first
    List {
        #[command(flatten)]
        server: TeamServer,
    },
    /// Tell what plays for the team today, what waits, where it stands in the queue, and what happens next
    Status {
        #[command(flatten)]
        server: TeamServer,
    },
    /// Give one a name that only the team and the organiser see
    Label {
        /// The submission's id
        submission: SubmissionId,
        /// 1 to 80 characters; left out, it has none
        label: Option<String>,
        #[command(flatten)]
        server: TeamServer,
    },
    /// Write about one what only the team and the organiser read
    Note {
        /// The submission's id
        submission: SubmissionId,
        /// 1 to 2000 characters; left out, there is none
        note: Option<String>,
        #[command(flatten)]
        server: TeamServer,
    },
    /// Download the archive of one, as it was uploaded
    Download {
        /// The submission's id
        submission: SubmissionId,
        /// Where to
        file: PathBuf,
        #[command(flatten)]
        server: TeamServer,
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
        #[command(flatten)]
        server: TeamServer,
    },
    /// Take one back: it plays no further day, unless `faceoff activate` chooses it again
    Withdraw {
        /// The submission's id
        submission: SubmissionId,
        #[command(flatten)]
        server: TeamServer,
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
        match self.action {
            Action::List { server } => {
                let submissions = server.client()?.submissions().await?;
                if submissions.is_empty() {
                    println!("nothing was uploaded yet: faceoff submit BUNDLE");
                }
                for submission in &submissions {
                    println!("{}", line(submission));
                }
            }
            Action::Status { server } => {
                let client = server.client()?;
                let me = client.me().await?;
                for line in status(&me) {
                    println!("{line}");
                }
            }
            Action::Label {
                submission,
                label,
                server,
            } => {
                let change = SubmissionChange {
                    label: Some(label),
                    ..SubmissionChange::default()
                };
                let described = server.client()?.describe(submission, &change).await?;
                println!("{}", line(&described));
            }
            Action::Note {
                submission,
                note,
                server,
            } => {
                let change = SubmissionChange {
                    note: Some(note),
                    ..SubmissionChange::default()
                };
                let described = server.client()?.describe(submission, &change).await?;
                println!("{}", line(&described));
            }
            Action::Download {
                submission,
                file,
                server,
            } => {
                let client = server.client()?;
                let bytes = client.download_submission(submission, &file).await?;
                println!("{}: {bytes} bytes", file.display());
            }
            Action::Delete {
                submission,
                reason,
                confirm,
                server,
            } => {
                let wanted = DeleteSubmission { confirm, reason };
                let client = server.client()?;
                let deleted = client.delete_submission(submission, &wanted).await?;
                println!("{}", line(&deleted));
            }
            Action::Withdraw { submission, server } => {
                let client = server.client()?;
                let withdrawn = client.withdraw(submission).await?;
                println!("{}", line(&withdrawn));
                let me = client.me().await?;
                match me.active_submission {
                    Some(active) => println!("{}", next_cut(&me, active)),
                    None => println!(
                        "nothing of the team is active: upload another, or choose one with faceoff activate ID"
                    ),
                }
            }
        }
        Ok(())
    }
}

/// How the team stands today, line by line.
fn status(me: &MeView) -> Vec<String> {
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

fn line(submission: &SubmissionView) -> String {
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
