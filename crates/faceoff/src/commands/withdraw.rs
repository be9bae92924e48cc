//! `faceoff withdraw`: withdraws a submission.

use super::{server::ServerArgs, submissions::withdraw};
use clap::Args;
use faceoff_types::SubmissionId;

/// Withdraws a submission: it is not evaluated any more, unless `faceoff activate` makes it active again.
#[derive(Debug, Args)]
pub struct WithdrawCommand {
    /// The submission's id
    submission: SubmissionId,
    #[command(flatten)]
    server: ServerArgs,
}

impl WithdrawCommand {
    /// Withdraws the submission.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async {
            let client = self.server.client()?;
            withdraw(&client, self.server.json, self.submission).await
        })
    }
}
