//! `faceoff submit`: uploads an agent and says whether it starts.

use crate::client::Client;
use anyhow::{Context, bail};
use clap::Args;
use faceoff_http::views::{
    evaluation::{EvaluationStatus, EvaluationView},
    submission::{SubmissionStatus, SubmissionView},
};
use indicatif::{ProgressBar, ProgressStyle};
use std::{path::PathBuf, time::Duration};

/// How often the server is asked for news.
const POLL: Duration = Duration::from_millis(500);

/// Uploads a bundle and follows it until its verdict; exit status 0 only if it is valid.
#[derive(Debug, Args)]
pub struct SubmitCommand {
    /// The agent: a .tar.gz, .tar.zst or .zip, or a folder with agent.toml, which is packed
    bundle: PathBuf,
    /// The server
    #[arg(
        long,
        value_name = "URL",
        env = "FACEOFF_SERVER",
        default_value = "http://127.0.0.1:8080"
    )]
    server: String,
    /// The team's token
    #[arg(long, env = "FACEOFF_TOKEN", hide_env_values = true)]
    token: String,
    /// Also use today's turn, and follow the evaluation until its result
    #[arg(long)]
    evaluate: bool,
}

impl SubmitCommand {
    /// Uploads and follows.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses, or the agent is not valid.
    pub fn run(self) -> anyhow::Result<()> {
        tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .context("starting the async runtime")?
            .block_on(self.submit())
    }

    async fn submit(self) -> anyhow::Result<()> {
        let client = Client::new(&self.server, Some(self.token.trim()))?;
        let bar = ProgressBar::new(0).with_style(ProgressStyle::with_template(
            "uploading {bar:40} {bytes}/{total_bytes}",
        )?);
        let submission = client.upload_with(&self.bundle, &bar).await?;
        bar.finish_and_clear();
        println!(
            "uploaded {} as submission {}",
            submission.file_name, submission.id
        );

        let submission = verdict(&client, submission).await?;
        let agent = submission.agent_name.as_deref().unwrap_or("the agent");
        match submission.status {
            SubmissionStatus::Valid { log } => {
                print_log(log.as_deref());
                println!("valid: {agent} starts, answers and keeps time");
            }
            SubmissionStatus::Invalid { reason, log } => {
                print_log(log.as_deref());
                bail!("invalid: {reason}");
            }
            SubmissionStatus::ValidationError { reason } => {
                bail!("the server failed to check the bundle ({reason}); submit it again")
            }
            SubmissionStatus::Validating => bail!("the server gave no verdict"),
        }
        if self.evaluate {
            let evaluation = client.evaluate(submission.id).await?;
            println!("evaluation {} is queued", evaluation.id);
            result(follow(&client, evaluation).await?)?;
        }
        Ok(())
    }
}

async fn verdict(
    client: &Client,
    mut submission: SubmissionView,
) -> anyhow::Result<SubmissionView> {
    let spinner = ProgressBar::new_spinner().with_message("smoke run: does it start and answer?");
    spinner.enable_steady_tick(Duration::from_millis(100));
    while submission.status == SubmissionStatus::Validating {
        tokio::time::sleep(POLL).await;
        submission = client.submission(submission.id).await?;
    }
    spinner.finish_and_clear();
    Ok(submission)
}

async fn follow(client: &Client, mut evaluation: EvaluationView) -> anyhow::Result<EvaluationView> {
    let bar = ProgressBar::new(evaluation.progress.episodes_total.into()).with_style(
        ProgressStyle::with_template("evaluating {bar:40} {pos}/{len} episodes {eta}")?,
    );
    while !evaluation.status.is_final() {
        tokio::time::sleep(POLL).await;
        evaluation = client.evaluation(evaluation.id).await?;
        bar.set_position(evaluation.progress.episodes_done.into());
    }
    bar.finish_and_clear();
    Ok(evaluation)
}

fn result(evaluation: EvaluationView) -> anyhow::Result<()> {
    match evaluation.status {
        EvaluationStatus::Finished {
            result, dataset, ..
        } => {
            for (task, result) in &result.tasks {
                let [low, high] = result.success_ci95.map(|bound| 100.0 * bound);
                println!(
                    "{task:<8} {:>5.1} % success ({low:.1} to {high:.1}), {:.1} penalty points",
                    100.0 * result.success_rate,
                    result.penalty_points
                );
            }
            println!(
                "score {:.1}, {:.1} penalty points: {}",
                result.score,
                result.penalty_points,
                result.tier.title().to_lowercase()
            );
            println!("dataset: GET {dataset} with your token");
            Ok(())
        }
        EvaluationStatus::AgentFailed { faults, log, .. } => {
            print_log(log.as_deref());
            for fault in faults.iter().flatten() {
                let place = match (fault.episode, fault.step) {
                    (Some(episode), Some(step)) => format!("episode {episode}, step {step}"),
                    (Some(episode), None) => format!("episode {episode}, reset"),
                    (None, _) => "start-up".to_owned(),
                };
                println!("{}, {place}: {}", fault.task, fault.message);
            }
            bail!("the agent failed too often; there is no score")
        }
        EvaluationStatus::PlatformFailed { reason, .. } => {
            bail!("the server failed ({reason}); today's turn was given back")
        }
        EvaluationStatus::Cancelled { reason, .. } => {
            bail!("the evaluation was cancelled: {reason}")
        }
        EvaluationStatus::Queued | EvaluationStatus::Running | EvaluationStatus::Finalising => {
            bail!("the evaluation is not over")
        }
    }
}

fn print_log(log: Option<&str>) {
    if let Some(log) = log.filter(|log| !log.trim().is_empty()) {
        println!(
            "--- the agent's log ---\n{}\n--- end of the log ---",
            log.trim_end()
        );
    }
}
