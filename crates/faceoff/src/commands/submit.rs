//! `faceoff submit`: uploads a *bundle*, the files of an agent, and waits for its validation.

mod bundle_contents;

use super::{
    next_cutoff::next_cutoff_text,
    output::{print, print_json},
    server::ServerArgs,
};
use crate::{
    client::{Client, retry_temporary},
    competition::competition,
    packing::BundleFile,
};
use anyhow::{Context, bail};
use clap::Args;
use faceoff_api::views::submission::{SubmissionStatus, SubmissionView};
use faceoff_types::{ValidationTiming, ViolatedLimit};
use indicatif::{ProgressBar, ProgressStyle};
use std::{path::PathBuf, time::Duration};

/// Interval between requests for the result of the validation.
const POLL_INTERVAL: Duration = Duration::from_millis(500);
/// Time for which failing requests for the result are repeated.
const RETRY_TIMEOUT: Duration = Duration::from_mins(5);

/// Uploads a bundle and waits for its validation; the exit status is 0 only if it is valid. Of a folder, all files are
/// packed except those that no agent needs (version control, caches, environments, builds, editor files; see --dry-run)
/// and those that its file .faceoffignore names, in the syntax of .gitignore. A line `!NAME` there includes a file.
#[derive(Debug, Args)]
pub struct SubmitCommand {
    /// The agent: a .tar.gz, .tar.zst or .zip, a container image written by docker save, or a folder with agent.toml,
    /// which is packed
    bundle: PathBuf,
    /// List the files that would be packed and those that are left out, without uploading
    #[arg(long)]
    dry_run: bool,
    #[command(flatten)]
    server: ServerArgs,
}

impl SubmitCommand {
    /// Uploads the bundle and waits for its validation.
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
            let contents = bundle_contents::BundleContents::new(&bundle);
            return print(json, &contents, |contents| contents.text());
        }
        let client = self.server.client()?;
        if let Some(selection) = bundle.selection() {
            // On standard error, because standard output may be JSON.
            for line in bundle_contents::packing_summary(selection, bundle.bytes()) {
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
                println!("the bundle is identical to that of submission {same}");
            }
        }

        let submission = wait_for_validation(&client, submission).await?;
        if json {
            print_json(&submission)?;
        } else {
            print_validation(&client, &submission).await?;
        }
        match submission.status {
            SubmissionStatus::Valid { .. } => Ok(()),
            SubmissionStatus::Invalid { reason, .. } => bail!("invalid: {reason}"),
            SubmissionStatus::PlatformFailed { reason } => {
                bail!(
                    "the validation failed by a platform fault ({reason}); submit the bundle again"
                )
            }
            SubmissionStatus::Validating => bail!("the validation has no result"),
        }
    }
}

async fn print_validation(client: &Client, submission: &SubmissionView) -> anyhow::Result<()> {
    for timing in &submission.timing {
        print_timing(timing);
    }
    match &submission.status {
        SubmissionStatus::Valid { log } => {
            let agent = submission.agent_name.as_deref().unwrap_or("the agent");
            print_log(log.as_deref());
            println!("valid: {agent} starts, responds and meets the time limits");
            // If this request fails, the submission is still valid.
            match retry_temporary(RETRY_TIMEOUT, async || client.me().await).await {
                Ok(me) => println!("{}", next_cutoff_text(&me, submission.id)),
                Err(error) => eprintln!("the next cutoff is not known: {error:#}"),
            }
        }
        SubmissionStatus::Invalid { log, .. } => print_log(log.as_deref()),
        SubmissionStatus::PlatformFailed { .. } | SubmissionStatus::Validating => {}
    }
    Ok(())
}

async fn wait_for_validation(
    client: &Client,
    mut submission: SubmissionView,
) -> anyhow::Result<SubmissionView> {
    let spinner = ProgressBar::new_spinner()
        .with_message("validating: does the agent start, respond and meet the time limits?");
    spinner.enable_steady_tick(Duration::from_millis(100));
    while submission.status == SubmissionStatus::Validating {
        tokio::time::sleep(POLL_INTERVAL).await;
        let id = submission.id;
        // The upload is done: a restart of the server meanwhile changes nothing.
        submission = retry_temporary(RETRY_TIMEOUT, async || client.submission(id).await)
            .await
            .with_context(|| {
                format!(
                    "the bundle was uploaded; `faceoff log {id}` shows the result of its validation"
                )
            })?;
    }
    spinner.finish_and_clear();
    Ok(submission)
}

fn print_timing(timing: &ValidationTiming) {
    println!(
        "{:<8} {} answers: mean {:.1} ms, 99 % within {:.1} ms, longest {:.1} ms; {:.1} penalty points per episode for time",
        timing.task.as_str(),
        timing.steps,
        1e3 * timing.mean_s,
        1e3 * timing.p99_s,
        1e3 * timing.max_s,
        timing.points_per_episode
    );
    let limits: Vec<String> = timing.violations.iter().map(violation_text).collect();
    let episodes = match timing.episodes {
        // A validation run by an earlier version.
        0 => return,
        1 => "1 episode".to_owned(),
        count => format!("{count} episodes"),
    };
    if limits.is_empty() {
        println!("         no violated limits in {episodes}");
    } else {
        println!(
            "         violated limits in {episodes}: {}; they cost penalty points",
            limits.join(", ")
        );
    }
}

/// A violated limit, such as `joint position in 3`.
fn violation_text(violated: &ViolatedLimit) -> String {
    let info = competition().violation(violated.limit);
    let name = info.map_or(violated.limit.as_str(), |info| info.column_heading.as_str());
    format!("{name} in {}", violated.episodes)
}

fn print_log(log: Option<&str>) {
    if let Some(log) = log.filter(|log| !log.trim().is_empty()) {
        println!("--- agent log ---\n{}\n--- end of log ---", log.trim_end());
    }
}
