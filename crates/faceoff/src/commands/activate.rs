//! `faceoff activate`: chooses which submission plays next.

use super::{next_cut::next_cut, output::print, server::ServerArgs};
use clap::Args;
use faceoff_types::SubmissionId;

/// Makes one of the team's valid submissions the active one: it plays at the next cut, and at those after
/// it, until a later upload turns valid.
#[derive(Debug, Args)]
pub struct ActivateCommand {
    /// The submission's id, as `faceoff submit` printed it
    submission: SubmissionId,
    #[command(flatten)]
    server: ServerArgs,
}

impl ActivateCommand {
    /// Chooses it.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(self.activate())
    }

    async fn activate(self) -> anyhow::Result<()> {
        let client = self.server.client()?;
        let active = client.activate(self.submission).await?;
        let me = client.me().await?;
        print(self.server.json, &active, || {
            format!(
                "active: {} ({})\n{}",
                active.file_name,
                active.id,
                next_cut(&me, active.id)
            )
        })
    }
}
