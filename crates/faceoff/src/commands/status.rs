//! `faceoff status`: how the team stands now.

use super::{evaluation_text::state, output::print, server::ServerArgs, submissions::status};
use crate::{
    client::{ApiError, Client},
    exit::Exit,
    terminal,
};
use anyhow::Context;
use clap::Args;
use faceoff_api::views::{evaluation::EvaluationView, me::MeView};
use serde::Serialize;
use std::time::Duration;

/// Tells what plays for the team, what waits and where in the queue, what plays at the next cut, and what came of the
/// last evaluations.
#[derive(Debug, Args)]
pub struct StatusCommand {
    /// Tell it again whenever it has changed, until this is interrupted; with --json one object in a line each time
    #[arg(long, short)]
    watch: bool,
    /// How many of the last evaluations to tell of
    #[arg(long, value_name = "N", default_value_t = 3)]
    results: usize,
    #[command(flatten)]
    server: ServerArgs,
}

/// How soon the server is asked again after a change; longer each time that nothing has changed.
const SOONEST: Duration = Duration::from_secs(2);
const LATEST: Duration = Duration::from_secs(60);

/// What is printed with `--json`.
#[derive(Debug, PartialEq, Serialize)]
struct Standing {
    me: MeView,
    /// The newest first.
    evaluations: Vec<EvaluationView>,
}

impl StatusCommand {
    /// Asks the server, once or again and again.
    ///
    /// # Errors
    /// If it cannot be reached or refuses; while watching only if it refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async {
            let client = self.server.client()?;
            if self.watch {
                return self.watch(&client).await;
            }
            let standing = self.standing(&client).await?;
            print(self.server.json, &standing, || standing.text())
        })
    }

    async fn standing(&self, client: &Client) -> anyhow::Result<Standing> {
        let me = client.me().await?;
        let evaluations = client.newest_evaluations(self.results).await?;
        Ok(Standing { me, evaluations })
    }

    async fn watch(&self, client: &Client) -> anyhow::Result<()> {
        let mut last: Option<Standing> = None;
        let mut pause = SOONEST;
        let mut is_silent = false;
        loop {
            match self.standing(client).await {
                Ok(standing) => {
                    is_silent = false;
                    if last.as_ref().map(Standing::settled) == Some(standing.settled()) {
                        pause = (pause * 2).min(LATEST);
                    } else {
                        pause = SOONEST;
                        self.tell(&standing, last.is_some())?;
                        if terminal::nobody_reads() {
                            return Ok(());
                        }
                        last = Some(standing);
                    }
                }
                // It may be starting anew, or too busy for questions.
                Err(error) if Exit::of(&error) == Exit::Unreachable || is_too_often(&error) => {
                    if !is_silent {
                        eprintln!("{error:#}; asking again");
                        is_silent = true;
                    }
                    pause = (pause * 2).min(LATEST);
                }
                Err(error) => return Err(error),
            }
            tokio::time::sleep(pause).await;
        }
    }

    fn tell(&self, standing: &Standing, again: bool) -> anyhow::Result<()> {
        if self.server.json {
            println!(
                "{}",
                serde_json::to_string(standing).context("writing JSON")?
            );
            return Ok(());
        }
        if again {
            let now = jiff::Timestamp::now().strftime("%Y-%m-%d %H:%M:%S UTC");
            println!("\n── {now}");
        }
        println!("{}", standing.text());
        Ok(())
    }
}

fn is_too_often(error: &anyhow::Error) -> bool {
    error
        .downcast_ref::<ApiError>()
        .is_some_and(|error| error.status == reqwest::StatusCode::TOO_MANY_REQUESTS)
}

impl Standing {
    /// Without what is estimated anew each time: it changes while nothing happens.
    fn settled(&self) -> Self {
        let Self { me, evaluations } = self;
        let mut settled = Self {
            me: me.clone(),
            evaluations: evaluations.clone(),
        };
        let of_me = settled.me.validating.iter_mut().map(|one| &mut one.queue);
        let of_evaluations = settled.evaluations.iter_mut().map(|one| &mut one.queue);
        let of_turn = std::iter::once(&mut settled.me.turn.queue);
        for queue in of_me.chain(of_evaluations).chain(of_turn).flatten() {
            queue.expected_at = None;
        }
        settled
    }

    fn text(&self) -> String {
        let mut lines = status(&self.me);
        if !self.evaluations.is_empty() {
            lines.push("last evaluations:".to_owned());
        }
        for evaluation in &self.evaluations {
            lines.push(format!(
                "  {}  {}  {}",
                evaluation.day,
                evaluation.id,
                state(evaluation)
            ));
        }
        lines.join("\n")
    }
}
