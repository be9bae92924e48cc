//! `faceoff activate`: makes a submission active.

use super::{
    next_cutoff::next_cutoff_text, output::print, resource_references::SubmissionArg,
    server::ServerArgs,
};
use clap::Args;

/// Makes one of the team's valid submissions active. It is evaluated at the next cutoff and at every later
/// one, until a newer upload becomes valid or another submission is activated.
#[derive(Debug, Args)]
pub struct ActivateCommand {
    #[command(flatten)]
    submission: SubmissionArg,
    #[command(flatten)]
    server: ServerArgs,
}

impl ActivateCommand {
    /// Activates the submission.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(self.activate())
    }

    async fn activate(self) -> anyhow::Result<()> {
        let client = self.server.client()?;
        let id = self.submission.find(&client).await?;
        let active = client.activate(id).await?;
        let me = client.me().await?;
        print(self.server.json, &active, |active| {
            format!(
                "active: {} ({})\n{}",
                active.file_name,
                active.id,
                next_cutoff_text(&me, active.id)
            )
        })
    }
}
