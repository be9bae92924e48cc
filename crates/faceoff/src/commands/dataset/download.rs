//! `faceoff dataset download`: downloads the dataset of an evaluation, the record of its control steps.

use crate::{
    client::Client,
    commands::{
        block_on, output::print_download, resource_references::EvaluationArg, server::ServerArgs,
    },
};
use anyhow::bail;
use clap::Args;
use faceoff_api::views::evaluation::EvaluationStatus;
use faceoff_types::EvaluationId;
use std::path::{Path, PathBuf};

/// Downloads the dataset of an evaluation and compares it with its published hash. An interrupted download leaves
/// FILE.part; the same command resumes it, unless the dataset has changed.
#[derive(Debug, Args)]
pub(super) struct DownloadArgs {
    #[command(flatten)]
    evaluation: EvaluationArg,
    /// The file to write; an existing file is replaced [default: EVALUATION.zip in the working folder]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    server: ServerArgs,
}

impl DownloadArgs {
    pub(super) fn run(self) -> anyhow::Result<()> {
        block_on(self.download())
    }

    async fn download(self) -> anyhow::Result<()> {
        // Public datasets need no token.
        let client = self.server.client_with_optional_token()?;
        let id = self.evaluation.find(&client).await?;
        let file = self
            .out
            .unwrap_or_else(|| PathBuf::from(format!("{id}.zip")));
        download(&client, self.server.json, id, &file).await
    }
}

/// Downloads the dataset of an evaluation with the client's token.
pub(in crate::commands) async fn download(
    client: &Client,
    json: bool,
    id: EvaluationId,
    file: &Path,
) -> anyhow::Result<()> {
    let evaluation = client.evaluation(id).await?;
    let EvaluationStatus::Finished { dataset_blake3, .. } = evaluation.status else {
        bail!("the evaluation has no dataset: {}", evaluation.next);
    };
    print_download(json, async |bar| {
        let expected_blake3 = dataset_blake3.as_deref();
        client
            .download_dataset(id, file, expected_blake3, bar)
            .await
    })
    .await
}
