//! `faceoff admin storage`, `download-submission` and `delete-submission`: the teams' files.

use crate::{
    client::Client,
    commands::{
        output::{download_bar, downloaded, or_none, print},
        storage::storage_line,
    },
};
use clap::Subcommand;
use faceoff_api::requests::DeleteSubmission;
use faceoff_types::SubmissionId;
use std::path::PathBuf;

#[derive(Debug, Subcommand)]
pub(super) enum StorageAction {
    /// Show how much room the files of each team take
    Storage,
    /// Download the archive of a submission
    DownloadSubmission {
        /// The submission's id
        submission: SubmissionId,
        /// Where to
        file: PathBuf,
    },
    /// Have the archive of a submission removed; without --confirm, say what that would do
    DeleteSubmission {
        /// The submission's id
        submission: SubmissionId,
        /// Its team reads it
        reason: String,
        /// The name of its archive
        #[arg(long, value_name = "FILE_NAME")]
        confirm: Option<String>,
    },
}

pub(super) async fn act(client: &Client, json: bool, action: StorageAction) -> anyhow::Result<()> {
    match action {
        StorageAction::Storage => {
            let teams = client.storage().await?;
            print(json, &teams, || {
                or_none(teams.iter().map(storage_line).collect(), "no team yet")
            })
        }
        StorageAction::DownloadSubmission { submission, file } => {
            let bar = download_bar()?;
            let hash = client.submission(submission).await?.blake3;
            let done = client
                .download_submission(submission, &file, &hash, &bar)
                .await?;
            bar.finish_and_clear();
            print(json, &done, || downloaded(&done))
        }
        StorageAction::DeleteSubmission {
            submission,
            reason,
            confirm,
        } => {
            let wanted = DeleteSubmission {
                confirm,
                reason: Some(reason),
            };
            let deleted = client.delete_submission(submission, &wanted).await?;
            print(json, &deleted, || format!("{} is deleted", deleted.id))
        }
    }
}
