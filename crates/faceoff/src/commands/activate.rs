//! `faceoff activate`: chooses which submission plays next.

use super::{submit::next_cut, team_server::TeamServer};
use anyhow::Context;
use clap::Args;
use faceoff_types::SubmissionId;

/// Makes one of the team's valid submissions the active one: it plays at the next cut, and at those after
/// it, until a later upload turns valid.
#[derive(Debug, Args)]
pub struct ActivateCommand {
    /// The submission's id, as `faceoff submit` printed it
    submission: SubmissionId,
    #[command(flatten)]
    server: TeamServer,
}

impl ActivateCommand {
    /// Chooses it.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .context("starting the async runtime")?
            .block_on(self.activate())
    }

    async fn activate(self) -> anyhow::Result<()> {
        let client = self.server.client()?;
        let active = client.activate(self.submission).await?;
        println!("active: {} ({})", active.file_name, active.id);
        println!("{}", next_cut(&client.me().await?, active.id));
        Ok(())
    }
}
