//! `faceoff admin storage`, `download-submission` and `delete-submission`: the teams' files.

use crate::{
    client::Client,
    commands::{
        output::{print, print_list},
        storage::storage_line,
        submissions::download,
    },
};
use clap::Subcommand;
use faceoff_api::requests::DeleteSubmission;
use faceoff_types::SubmissionId;
use std::path::PathBuf;

#[derive(Debug, Subcommand)]
pub(super) enum StorageAction {
    /// Show the disk usage of each team
    Storage,
    /// Download the bundle of a submission
    DownloadSubmission {
        /// The submission's id
        submission: SubmissionId,
        /// The file to write; an existing file is replaced
        file: PathBuf,
    },
    /// Delete the bundle of a submission; without --confirm, only list the effects
    DeleteSubmission {
        /// The submission's id
        submission: SubmissionId,
        /// Shown to the team
        reason: String,
        /// The file name of the bundle, as confirmation
        #[arg(long, value_name = "FILE_NAME")]
        confirm: Option<String>,
    },
}

pub(super) async fn run_action(
    client: &Client,
    json: bool,
    action: StorageAction,
) -> anyhow::Result<()> {
    match action {
        StorageAction::Storage => {
            let teams = client.storage().await?;
            print_list(json, &teams, storage_line, "no teams yet")
        }
        StorageAction::DownloadSubmission { submission, file } => {
            download(client, json, submission, &file).await
        }
        StorageAction::DeleteSubmission {
            submission,
            reason,
            confirm,
        } => {
            let deletion = DeleteSubmission {
                confirm,
                reason: Some(reason),
            };
            let deleted = client.delete_submission(submission, &deletion).await?;
            print(json, &deleted, |deleted| {
                format!("the bundle of {} is deleted", deleted.id)
            })
        }
    }
}
