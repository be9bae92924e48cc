//! `faceoff withdraw`: takes a submission back.

use super::{server::ServerArgs, submissions::withdraw};
use clap::Args;
use faceoff_types::SubmissionId;

/// Takes a submission back: it plays no further day, unless `faceoff activate` chooses it again.
#[derive(Debug, Args)]
pub struct WithdrawCommand {
    /// The submission's id
    submission: SubmissionId,
    #[command(flatten)]
    server: ServerArgs,
}

impl WithdrawCommand {
    /// Takes it back.
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
