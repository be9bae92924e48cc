//! `faceoff health`: checks whether a server is healthy.

use super::{
    output::{print, time_text},
    server::ServerArgs,
};
use crate::client::ApiError;
use anyhow::anyhow;
use clap::Args;
use faceoff_api::views::health::HealthView;
use reqwest::StatusCode;

/// Checks whether the server is healthy: its database is writable, its queue progresses, its disk has free space.
#[derive(Debug, Args)]
pub struct HealthCommand {
    #[command(flatten)]
    server: ServerArgs,
}

impl HealthCommand {
    /// Requests the server's health and prints it.
    ///
    /// # Errors
    /// If the server cannot be reached or is unhealthy; the error names the reason.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async {
            let health = self
                .server
                .client_with_optional_token()?
                .health()
                .await
                .map_err(as_unhealthy)?;
            print(self.server.json, &health, health_text)
        })
    }
}

/// Turns the answer of an unhealthy server into a failure, because the server was reached.
fn as_unhealthy(error: anyhow::Error) -> anyhow::Error {
    match error.downcast_ref::<ApiError>() {
        Some(problem) if problem.status == StatusCode::SERVICE_UNAVAILABLE => {
            anyhow!("the server is unhealthy: {}", problem.detail)
        }
        _ => error,
    }
}

fn health_text(health: &HealthView) -> String {
    let pause = health.paused.as_ref().map(|decision| {
        let since = time_text(decision.at);
        format!("\nthe queue is paused since {since}: {}", decision.reason)
    });
    format!(
        "{}, version {}; jobs: {} running, {} pending{}",
        health.status,
        health.version,
        health.running,
        health.waiting,
        pause.unwrap_or_default()
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exit::Exit;

    #[test]
    fn unhealthy_server_is_a_failure_but_not_unreachable() {
        let refused = |status| ApiError {
            status,
            kind: String::new(),
            title: "Not ready".into(),
            detail: "the database cannot be written".into(),
        };
        let unhealthy = as_unhealthy(refused(StatusCode::SERVICE_UNAVAILABLE).into());
        assert_eq!(Exit::of(&unhealthy), Exit::Failed);
        assert!(
            unhealthy
                .to_string()
                .ends_with("the database cannot be written")
        );
        // Other 5xx statuses count as no usable answer.
        let broken = as_unhealthy(refused(StatusCode::INTERNAL_SERVER_ERROR).into());
        assert_eq!(Exit::of(&broken), Exit::Unreachable);
    }
}
