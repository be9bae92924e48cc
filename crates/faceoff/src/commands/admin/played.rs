//! `faceoff admin evaluation`, `submission`, `ablation`, `order-ablation` and `download-dataset`: what was played, of any team.

use crate::{
    client::Client,
    commands::{
        ablation_text::ablation,
        dataset::download::download,
        evaluation::{Which, show},
        output::print,
        submissions::line,
    },
};
use clap::Subcommand;
use faceoff_api::requests::OrderAblation;
use faceoff_types::{EvaluationId, SubmissionId};
use std::path::PathBuf;

#[derive(Debug, Subcommand)]
pub(super) enum PlayedAction {
    /// Show an evaluation: how far it is, or what came of it, by task
    Evaluation(Which),
    /// Show a submission with its verdict
    Submission {
        /// The submission's id
        submission: SubmissionId,
    },
    /// Show the newest ablation of a submission
    Ablation {
        /// The submission's id
        submission: SubmissionId,
    },
    /// Have a submission play each perturbation alone, when nothing that counts waits
    OrderAblation {
        /// The submission's id
        submission: SubmissionId,
        /// Episodes of each task in each profile [default: 100]
        #[arg(long, value_name = "N")]
        episodes: Option<u32>,
    },
    /// Download the dataset of an evaluation; one that broke off goes on where it was
    DownloadDataset {
        /// The evaluation's id
        evaluation: EvaluationId,
        /// Where to; a file that exists is replaced
        file: PathBuf,
    },
}

pub(super) async fn act(client: &Client, json: bool, action: PlayedAction) -> anyhow::Result<()> {
    match action {
        PlayedAction::Evaluation(which) => show(client, json, &which).await,
        PlayedAction::Submission { submission } => {
            let submission = client.submission(submission).await?;
            print(json, &submission, || line(&submission))
        }
        PlayedAction::Ablation { submission } => {
            let newest = client.ablation(submission).await?;
            print(json, &newest, || ablation(&newest))
        }
        PlayedAction::OrderAblation {
            submission,
            episodes,
        } => {
            let wanted = OrderAblation {
                episodes_per_task: episodes,
            };
            let ordered = client.order_ablation(submission, &wanted).await?;
            print(json, &ordered, || ablation(&ordered))
        }
        PlayedAction::DownloadDataset { evaluation, file } => {
            download(client, json, evaluation, &file).await
        }
    }
}
