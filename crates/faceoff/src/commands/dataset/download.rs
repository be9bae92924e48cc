use crate::{
    client::Client,
    commands::{
        block_on,
        output::{download_bar, downloaded, print},
        server::ServerArgs,
    },
};
use anyhow::bail;
use clap::Args;
use faceoff_api::views::evaluation::EvaluationStatus;
use faceoff_types::EvaluationId;
use std::path::{Path, PathBuf};

/// Downloads the dataset of an evaluation and holds it against its published hash. What has come of a download that broke
/// off is in FILE.part, and the same command goes on from there, if it is the same dataset still.
#[derive(Debug, Args)]
pub(super) struct DownloadArgs {
    /// The evaluation's id
    evaluation: EvaluationId,
    /// Where to; a file that exists is replaced [default: EVALUATION.zip in the working folder]
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
        // What is public is everybody's.
        let client = self.server.anybody()?;
        let file = self
            .out
            .unwrap_or_else(|| PathBuf::from(format!("{}.zip", self.evaluation)));
        download(&client, self.server.json, self.evaluation, &file).await
    }
}

/// Downloads it, as whoever the client is.
pub(in crate::commands) async fn download(
    client: &Client,
    json: bool,
    id: EvaluationId,
    file: &Path,
) -> anyhow::Result<()> {
    let evaluation = client.evaluation(id).await?;
    let EvaluationStatus::Finished { dataset_blake3, .. } = evaluation.status else {
        bail!("it has no dataset: {}", evaluation.next);
    };
    let bar = download_bar()?;
    let done = client
        .download_dataset(id, file, dataset_blake3.as_deref(), &bar)
        .await?;
    bar.finish_and_clear();
    print(json, &done, || downloaded(&done))
}
