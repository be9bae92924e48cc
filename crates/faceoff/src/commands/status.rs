//! `faceoff status`: prints the team's current state.

use super::{
    evaluation_text::status_text,
    output::{exact_time_text, print},
    server::ServerArgs,
    submissions::status_lines,
};
use crate::{
    client::{Client, is_refused_with},
    exit::Exit,
    terminal,
};
use anyhow::Context;
use clap::Args;
use faceoff_api::views::{evaluation::EvaluationView, me::MeView};
use reqwest::StatusCode;
use serde::Serialize;
use std::time::Duration;

/// Shows the team's running evaluation, pending jobs with their positions in the queue, the submission for the next
/// cutoff, and the last results.
#[derive(Debug, Args)]
pub struct StatusCommand {
    /// Print the status again whenever it changes, until interrupted; with --json, one object per line
    #[arg(long, short)]
    watch: bool,
    /// Number of last evaluations to show
    #[arg(long, value_name = "N", default_value_t = 3)]
    results: usize,
    #[command(flatten)]
    server: ServerArgs,
}

/// Polling interval after a change. It doubles with each request without a change, up to [`MAX_INTERVAL`].
const MIN_INTERVAL: Duration = Duration::from_secs(2);
const MAX_INTERVAL: Duration = Duration::from_secs(60);

/// Output of `--json`.
#[derive(Debug, PartialEq, Serialize)]
struct TeamStatus {
    /// The team's state from the route `/me`.
    me: MeView,
    /// The newest first.
    evaluations: Vec<EvaluationView>,
}

impl StatusCommand {
    /// Prints the status, once or after each change.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses; with `--watch`, only if it refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async {
            let client = self.server.client()?;
            if self.watch {
                return self.watch(&client).await;
            }
            let status = self.request_status(&client).await?;
            print(self.server.json, &status, |status| status.text())
        })
    }

    async fn request_status(&self, client: &Client) -> anyhow::Result<TeamStatus> {
        let me = client.me().await?;
        let evaluations = client.newest_evaluations(self.results).await?;
        Ok(TeamStatus { me, evaluations })
    }

    async fn watch(&self, client: &Client) -> anyhow::Result<()> {
        let mut last: Option<TeamStatus> = None;
        let mut interval = MIN_INTERVAL;
        let mut is_disconnected = false;
        loop {
            match self.request_status(client).await {
                Ok(status) => {
                    is_disconnected = false;
                    if last.as_ref().map(TeamStatus::without_estimates)
                        == Some(status.without_estimates())
                    {
                        interval = (interval * 2).min(MAX_INTERVAL);
                    } else {
                        interval = MIN_INTERVAL;
                        self.print_status(&status, last.is_some())?;
                        if terminal::stdout_is_closed() {
                            return Ok(());
                        }
                        last = Some(status);
                    }
                }
                // The server may be restarting, or limiting requests.
                Err(error)
                    if Exit::of(&error) == Exit::Unreachable
                        || is_refused_with(&error, StatusCode::TOO_MANY_REQUESTS) =>
                {
                    if !is_disconnected {
                        eprintln!("{error:#}; retrying");
                        is_disconnected = true;
                    }
                    interval = (interval * 2).min(MAX_INTERVAL);
                }
                Err(error) => return Err(error),
            }
            tokio::time::sleep(interval).await;
        }
    }

    fn print_status(&self, status: &TeamStatus, is_repeated: bool) -> anyhow::Result<()> {
        if self.server.json {
            println!("{}", serde_json::to_string(status).context("writing JSON")?);
            return Ok(());
        }
        if is_repeated {
            let now = exact_time_text(jiff::Timestamp::now());
            println!("\n── {now}");
        }
        println!("{}", status.text());
        Ok(())
    }
}

impl TeamStatus {
    /// The status without estimated times, which change constantly.
    fn without_estimates(&self) -> Self {
        let Self { me, evaluations } = self;
        let mut status = Self {
            me: me.clone(),
            evaluations: evaluations.clone(),
        };
        let submissions = status
            .me
            .validating
            .iter_mut()
            .map(|submission| &mut submission.queue);
        let evaluations = status
            .evaluations
            .iter_mut()
            .map(|evaluation| &mut evaluation.queue);
        let today = std::iter::once(&mut status.me.today.queue);
        for queue in submissions.chain(evaluations).chain(today).flatten() {
            queue.expected_at = None;
        }
        status
    }

    fn text(&self) -> String {
        let mut lines = status_lines(&self.me);
        if !self.evaluations.is_empty() {
            lines.push("last evaluations:".to_owned());
        }
        for evaluation in &self.evaluations {
            lines.push(format!(
                "  {}  {}  {}",
                evaluation.day,
                evaluation.id,
                status_text(evaluation)
            ));
        }
        lines.join("\n")
    }
}
