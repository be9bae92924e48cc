//! `faceoff publish`: makes an evaluation of the team's public before its stage does.

use super::team_server::TeamServer;
use anyhow::Context;
use clap::Args;
use faceoff_http::views::evaluation::EvaluationStatus;
use faceoff_types::EvaluationId;

/// Makes a finished evaluation of the team's public, with its dataset: everybody sees it from then on, without a
/// token, and that stays so.
#[derive(Debug, Args)]
pub struct PublishCommand {
    /// The evaluation's id
    evaluation: EvaluationId,
    #[command(flatten)]
    server: TeamServer,
}

impl PublishCommand {
    /// Publishes it.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .context("starting the async runtime")?
            .block_on(self.publish())
    }

    async fn publish(self) -> anyhow::Result<()> {
        let published = self.server.client()?.publish(self.evaluation).await?;
        println!(
            "public: the evaluation of {} ({})",
            published.day, published.id
        );
        if let EvaluationStatus::Finished {
            dataset: Some(path),
            ..
        } = published.status
        {
            println!("dataset {path}");
        }
        Ok(())
    }
}
