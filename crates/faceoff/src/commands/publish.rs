//! `faceoff publish`: makes an evaluation of the team's public before its stage does.

use super::{output::print, server::ServerArgs};
use clap::Args;
use faceoff_api::views::evaluation::EvaluationStatus;
use faceoff_types::EvaluationId;

/// Makes a finished evaluation of the team's public, with its dataset: everybody sees it from then on, without a
/// token, and that stays so.
#[derive(Debug, Args)]
pub struct PublishCommand {
    /// The evaluation's id
    evaluation: EvaluationId,
    #[command(flatten)]
    server: ServerArgs,
}

impl PublishCommand {
    /// Publishes it.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(self.publish())
    }

    async fn publish(self) -> anyhow::Result<()> {
        let published = self.server.client()?.publish(self.evaluation).await?;
        print(self.server.json, &published, || {
            let mut told = format!(
                "public: the evaluation of {} ({})",
                published.day, published.id
            );
            if let EvaluationStatus::Finished {
                dataset: Some(path),
                ..
            } = &published.status
            {
                told.push_str(&format!("\ndataset {path}"));
            }
            told
        })
    }
}
