//! `faceoff submit`: uploads an agent and says whether it starts.

use super::team_server::TeamServer;
use crate::client::Client;
use anyhow::{Context, bail};
use clap::Args;
use faceoff_http::views::{
    me::MeView,
    submission::{SubmissionStatus, SubmissionView},
};
use faceoff_types::{SmokeTiming, SubmissionId};
use indicatif::{ProgressBar, ProgressStyle};
use std::{path::PathBuf, time::Duration};

/// How often the server is asked for news.
const POLL: Duration = Duration::from_millis(500);

/// Uploads a bundle and follows it until its verdict; exit status 0 only if it is valid.
#[derive(Debug, Args)]
pub struct SubmitCommand {
    /// The agent: a .tar.gz, .tar.zst or .zip, or a folder with agent.toml, which is packed
    bundle: PathBuf,
    #[command(flatten)]
    server: TeamServer,
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
        let client = self.server.client()?;
        let bar = ProgressBar::new(0).with_style(ProgressStyle::with_template(
            "uploading {bar:40} {bytes}/{total_bytes}",
        )?);
        let submission = client.upload_with(&self.bundle, &bar).await?;
        bar.finish_and_clear();
        println!(
            "uploaded {} as submission {}",
            submission.file_name, submission.id
        );
        if let Some(same) = submission.same_as {
            println!("it is the same archive as submission {same}");
        }

        let submission = verdict(&client, submission).await?;
        let agent = submission.agent_name.as_deref().unwrap_or("the agent");
        for timing in &submission.timing {
            print_timing(timing);
        }
        match submission.status {
            SubmissionStatus::Valid { log } => {
                print_log(log.as_deref());
                println!("valid: {agent} starts, answers and keeps time");
                println!("{}", next_cut(&client.me().await?, submission.id));
                Ok(())
            }
            SubmissionStatus::Invalid { reason, log } => {
                print_log(log.as_deref());
                bail!("invalid: {reason}")
            }
            SubmissionStatus::ValidationError { reason } => {
                bail!("the server failed to check the bundle ({reason}); submit it again")
            }
            SubmissionStatus::Validating => bail!("the server gave no verdict"),
        }
    }
}

/// When a submission of the team's plays.
pub(super) fn next_cut(me: &MeView, submission: SubmissionId) -> String {
    match (&me.next_cut, me.active_submission) {
        (None, _) => "no day comes any more: the season or its last stage is closed".to_owned(),
        (Some(cut), Some(active)) if active == submission => {
            let (here, elsewhere): (Vec<_>, Vec<_>) =
                me.not_taken.iter().partition(|one| one.stage == cut.stage);
            let mut told = match here.first() {
                Some(one) => format!(
                    "it is active and does not play at the next cut ({cut}): {}",
                    one.reason
                ),
                None => format!("it is active and plays at the next cut: {cut}"),
            };
            for one in elsewhere {
                told.push_str(&format!("\nit plays no day of one stage: {}", one.reason));
            }
            told
        }
        (Some(cut), _) => format!(
            "another submission is active and plays at the next cut ({cut}); to choose this one: faceoff \
             activate {submission}"
        ),
    }
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
