//! `faceoff admin evaluation`, `submission`, `ablation`, `order-ablation` and `download-dataset`: results of any team.
//! An *ablation* evaluates a submission without perturbations, with each one alone, and with all, to show what each one costs it.

use crate::{
    client::Client,
    commands::{
        ablation_text::ablation_text,
        dataset::download::download,
        evaluation::{EvaluationArgs, show},
        output::print,
        submissions::submission_line,
    },
};
use clap::Subcommand;
use faceoff_api::requests::NewAblation;
use faceoff_types::{EvaluationId, SubmissionId};
use std::path::PathBuf;

#[derive(Debug, Subcommand)]
pub(super) enum ResultAction {
    /// Show an evaluation: its progress, or its result by task
    Evaluation(EvaluationArgs),
    /// Show a submission and its validation result
    Submission {
        /// The submission's id
        submission: SubmissionId,
    },
    /// Show the newest ablation of a submission
    Ablation {
        /// The submission's id
        submission: SubmissionId,
    },
    /// Request an ablation: the submission is evaluated without perturbations, with each one alone, and with all, while no
    /// counting job is pending
    OrderAblation {
        /// The submission's id
        submission: SubmissionId,
        /// Episodes per task and profile [default: 100]
        #[arg(long, value_name = "N")]
        episodes: Option<u32>,
    },
    /// Download the dataset of an evaluation; an interrupted download is resumed
    DownloadDataset {
        /// The evaluation's id
        evaluation: EvaluationId,
        /// The file to write; an existing file is replaced
        file: PathBuf,
    },
}

pub(super) async fn run_action(
    client: &Client,
    json: bool,
    action: ResultAction,
) -> anyhow::Result<()> {
    match action {
        ResultAction::Evaluation(args) => show(client, json, &args).await,
        ResultAction::Submission { submission } => {
            let submission = client.submission(submission).await?;
            print(json, &submission, submission_line)
        }
        ResultAction::Ablation { submission } => {
            let newest = client.ablation(submission).await?;
            print(json, &newest, ablation_text)
        }
        ResultAction::OrderAblation {
            submission,
            episodes,
        } => {
            let request = NewAblation {
                episodes_per_task: episodes,
            };
            let requested = client.request_ablation(submission, &request).await?;
            print(json, &requested, ablation_text)
        }
        ResultAction::DownloadDataset { evaluation, file } => {
            download(client, json, evaluation, &file).await
        }
    }
}
