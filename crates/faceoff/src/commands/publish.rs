//! `faceoff publish`: publishes an evaluation of the team before its stage does.

use super::{output::print, resource_references::EvaluationArg, server::ServerArgs};
use clap::Args;
use faceoff_api::views::evaluation::EvaluationStatus;

/// Publishes a finished evaluation of the team with its dataset: everyone can see it without a token. This
/// cannot be undone.
#[derive(Debug, Args)]
pub struct PublishCommand {
    #[command(flatten)]
    evaluation: EvaluationArg,
    #[command(flatten)]
    server: ServerArgs,
}

impl PublishCommand {
    /// Publishes the evaluation.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(self.publish())
    }

    async fn publish(self) -> anyhow::Result<()> {
        let client = self.server.client()?;
        let id = self.evaluation.find(&client).await?;
        let published = client.publish(id).await?;
        print(self.server.json, &published, |published| {
            let mut text = format!(
                "published: the evaluation of {} ({})",
                published.day, published.id
            );
            if let EvaluationStatus::Finished {
                dataset: Some(path),
                ..
            } = &published.status
            {
                text.push_str(&format!("\ndataset {path}"));
            }
            text
        })
    }
}
