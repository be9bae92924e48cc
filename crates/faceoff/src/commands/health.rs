//! `faceoff health`: is a server fit for work?

use super::{output::print, server::ServerArgs};
use crate::client::ApiError;
use anyhow::anyhow;
use clap::Args;
use faceoff_api::views::health::HealthView;
use reqwest::StatusCode;

/// Says whether the server is fit for work: its database can be written, its queue moves, its disk has room.
#[derive(Debug, Args)]
pub struct HealthCommand {
    #[command(flatten)]
    server: ServerArgs,
}

impl HealthCommand {
    /// Asks the server.
    ///
    /// # Errors
    /// If it cannot be reached, or something is missing: what.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async {
            let health = self.server.anybody()?.health().await.map_err(missing)?;
            print(self.server.json, &health, || text(&health))
        })
    }
}

/// A server that says what it lacks was reached, and is not well.
fn missing(error: anyhow::Error) -> anyhow::Error {
    match error.downcast_ref::<ApiError>() {
        Some(told) if told.status == StatusCode::SERVICE_UNAVAILABLE => {
            anyhow!("the server is not fit for work: {}", told.detail)
        }
        _ => error,
    }
}

fn text(health: &HealthView) -> String {
    let held = health.paused.as_ref().map(|ruling| {
        let since = ruling.at.strftime("%Y-%m-%d %H:%M UTC");
        format!("\nthe queue is held since {since}: {}", ruling.reason)
    });
    format!(
        "{}, version {}; units of work: {} under way, {} waiting{}",
        health.status,
        health.version,
        health.running,
        health.waiting,
        held.unwrap_or_default()
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exit::Exit;

    #[test]
    fn what_a_server_lacks_is_no_failure_to_reach_it() {
        let refused = |status| ApiError {
            status,
            title: "Not ready".into(),
            detail: "the database cannot be written".into(),
        };
        let lacks = missing(refused(StatusCode::SERVICE_UNAVAILABLE).into());
        assert_eq!(Exit::of(&lacks), Exit::Failed);
        assert!(
            lacks
                .to_string()
                .ends_with("the database cannot be written")
        );
        let broken = missing(refused(StatusCode::INTERNAL_SERVER_ERROR).into());
        assert_eq!(Exit::of(&broken), Exit::Unreachable);
    }
}
