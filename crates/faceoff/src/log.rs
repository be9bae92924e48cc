//! Level and format of the log.

use anyhow::Context;
use clap::ValueEnum;
use std::{
    env::{self, VarError},
    io::{self, IsTerminal as _},
};
use tracing_subscriber::{
    Layer, Registry,
    filter::{LevelFilter, Targets},
    layer::SubscriberExt,
    util::SubscriberInitExt,
};

/// Format of log lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum LogFormat {
    /// Readable text.
    Text,
    /// One JSON object per line.
    Json,
}

impl LogFormat {
    /// Starts the log on standard error, with the filter of `RUST_LOG` or the level `info`.
    ///
    /// # Errors
    /// If `RUST_LOG` is not a list of `LEVEL` and `TARGET=LEVEL`.
    pub fn start(self) -> anyhow::Result<()> {
        let filter = match env::var("RUST_LOG") {
            Ok(list) => parse_filter(&list)?,
            Err(VarError::NotPresent) => parse_filter("info")?,
            Err(error) => return Err(error).context("RUST_LOG"),
        };
        let lines = tracing_subscriber::fmt::layer()
            .with_writer(io::stderr)
            // Errors of the log itself would also be written to standard error, where a second failure is a
            // panic: a full disk under the log would stop the slots.
            .log_internal_errors(false)
            .with_ansi(io::stderr().is_terminal());
        let lines: Box<dyn Layer<Registry> + Send + Sync> = match self {
            Self::Text => lines.boxed(),
            Self::Json => lines.json().boxed(),
        };
        tracing_subscriber::registry()
            .with(lines.with_filter(filter))
            .try_init()
            .context("starting the log")
    }
}

/// The NATS client logs each failed attempt to connect. It is silenced by default, because server and worker log each
/// cause once.
const NATS_CLIENT: &str = "async_nats";

fn parse_filter(list: &str) -> anyhow::Result<Targets> {
    let filter: Targets = list
        .parse()
        .with_context(|| format!("RUST_LOG={list:?}: expected e.g. info,sqlx::query=debug"))?;
    let names_nats_client = filter
        .iter()
        .any(|(target, _)| target.starts_with(NATS_CLIENT));
    let is_verbose = filter
        .default_level()
        .is_some_and(|level| level > LevelFilter::INFO);
    Ok(if names_nats_client || is_verbose {
        filter
    } else {
        filter.with_target(NATS_CLIENT, LevelFilter::OFF)
    })
}

#[cfg(test)]
mod tests {
    use tracing_subscriber::filter::LevelFilter;

    #[test]
    fn target_can_have_its_own_level() {
        let filter = super::parse_filter("info,sqlx::query=debug").unwrap();
        let enabled = |target, level: LevelFilter| {
            filter.would_enable(target, &level.into_level().expect("a level"))
        };
        assert!(enabled("sqlx::query", LevelFilter::DEBUG));
        assert!(enabled("faceoff_worker::slot", LevelFilter::INFO));
        assert!(!enabled("faceoff_worker::slot", LevelFilter::DEBUG));
    }

    #[test]
    fn nats_client_is_silent_unless_requested() {
        for (list, expected) in [
            ("info", false),
            ("warn,sqlx=debug", false),
            ("info,async_nats=warn", true),
            ("info,async_nats::connector=warn", true),
            ("debug", true),
        ] {
            let filter = super::parse_filter(list).unwrap();
            let is_enabled = filter.would_enable("async_nats::connector", &tracing::Level::ERROR);
            assert_eq!(is_enabled, expected, "{list}");
            assert!(filter.would_enable("faceoff_worker::slot", &tracing::Level::WARN));
        }
    }

    #[test]
    fn invalid_filter_is_quoted_in_the_error() {
        let error = super::parse_filter("faceoff=loud").unwrap_err();
        assert!(format!("{error:#}").contains("faceoff=loud"), "{error:#}");
    }
}
