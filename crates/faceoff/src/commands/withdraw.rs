//! `faceoff withdraw`: withdraws a submission.

use super::{resource_references::SubmissionArg, server::ServerArgs, submissions::withdraw};
use clap::Args;

/// Withdraws a submission: it is not evaluated any more, unless `faceoff activate` makes it active again.
#[derive(Debug, Args)]
pub struct WithdrawCommand {
    #[command(flatten)]
    submission: SubmissionArg,
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
            let id = self.submission.find(&client).await?;
            withdraw(&client, self.server.json, id).await
        })
    }
}
