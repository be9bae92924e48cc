//! `faceoff submit`: uploads an agent and says whether it starts.

mod packed;

use super::{next_cut::next_cut, output::print, server::ServerArgs};
use crate::{client::Client, packing::BundleFile};
use anyhow::{Context, bail};
use clap::Args;
use faceoff_api::views::submission::{SubmissionStatus, SubmissionView};
use faceoff_types::SmokeTiming;
use indicatif::{ProgressBar, ProgressStyle};
use std::{path::PathBuf, time::Duration};

/// How often the server is asked for news.
const POLL: Duration = Duration::from_millis(500);

/// Uploads a bundle and follows it until its verdict; exit status 0 only if it is valid. Of a folder all goes in but what
/// no agent needs (histories, caches, environments, builds, editors' files: --dry-run tells) and what its file
/// .faceoffignore names, in the syntax of .gitignore; a line `!NAME` there has something go in all the same.
#[derive(Debug, Args)]
pub struct SubmitCommand {
    /// The agent: a .tar.gz, .tar.zst or .zip, a container image as docker save writes it, or a folder with agent.toml, which is packed
    bundle: PathBuf,
    /// List what of a folder would go in and what would not, and upload nothing
    #[arg(long)]
    dry_run: bool,
    #[command(flatten)]
    server: ServerArgs,
}

impl SubmitCommand {
    /// Uploads and follows.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses, or the agent is not valid.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(self.submit())
    }

    async fn submit(self) -> anyhow::Result<()> {
        let json = self.server.json;
        let bundle = self.bundle.clone();
        let bundle = tokio::task::spawn_blocking(move || BundleFile::open(&bundle));
        let bundle = bundle.await.context("packing the bundle")??;
        if self.dry_run {
            let contents = packed::Contents::of(&bundle);
            return print(json, &contents, || contents.listed());
        }
        let client = self.server.client()?;
        if let Some(selection) = bundle.selection() {
            // Beside the answer, which --json leaves alone on standard output.
            for line in packed::told(selection, bundle.bytes()) {
                eprintln!("{line}");
            }
        }
        let bar = ProgressBar::new(0).with_style(ProgressStyle::with_template(
            "uploading {bar:40} {bytes}/{total_bytes}, {bytes_per_sec}, {eta} left",
        )?);
        let submission = client.upload_with(&bundle, &bar).await?;
        bar.finish_and_clear();
        if !json {
            println!(
                "uploaded {} as submission {}",
                submission.file_name, submission.id
            );
            if let Some(same) = submission.same_as {
                println!("it is the same archive as submission {same}");
            }
        }

        let submission = verdict(&client, submission).await?;
        if json {
            print(json, &submission, String::new)?;
        } else {
            print_verdict(&client, &submission).await?;
        }
        match submission.status {
            SubmissionStatus::Valid { .. } => Ok(()),
            SubmissionStatus::Invalid { reason, .. } => bail!("invalid: {reason}"),
            SubmissionStatus::ValidationError { reason } => {
                bail!("the server failed to check the bundle ({reason}); submit it again")
            }
            SubmissionStatus::Validating => bail!("the server gave no verdict"),
        }
    }
}

async fn print_verdict(client: &Client, submission: &SubmissionView) -> anyhow::Result<()> {
    for timing in &submission.timing {
        print_timing(timing);
    }
    match &submission.status {
        SubmissionStatus::Valid { log } => {
            let agent = submission.agent_name.as_deref().unwrap_or("the agent");
            print_log(log.as_deref());
            println!("valid: {agent} starts, answers and keeps time");
            println!("{}", next_cut(&client.me().await?, submission.id));
        }
        SubmissionStatus::Invalid { log, .. } => print_log(log.as_deref()),
        SubmissionStatus::ValidationError { .. } | SubmissionStatus::Validating => {}
    }
    Ok(())
}
async fn verdict(
    client: &Client,
    mut submission: SubmissionView,
) -> anyhow::Result<SubmissionView> {
    let spinner =
        ProgressBar::new_spinner().with_message("smoke run: does it start, answer and keep time?");
    spinner.enable_steady_tick(Duration::from_millis(100));
    while submission.status == SubmissionStatus::Validating {
        tokio::time::sleep(POLL).await;
        submission = client.submission(submission.id).await?;
    }
    spinner.finish_and_clear();
    Ok(submission)
}

fn print_timing(timing: &SmokeTiming) {
    println!(
        "{:<8} {} answers: mean {:.1} ms, 99 % within {:.1} ms, longest {:.1} ms; {:.1} penalty points per episode",
        timing.task.as_str(),
        timing.steps,
        1e3 * timing.mean_s,
        1e3 * timing.p99_s,
        1e3 * timing.max_s,
        timing.points_per_episode
    );
}

fn print_log(log: Option<&str>) {
    if let Some(log) = log.filter(|log| !log.trim().is_empty()) {
        println!(
            "--- the agent's log ---\n{}\n--- end of the log ---",
            log.trim_end()
        );
    }
}
