//! The server's log: what is written, and how.

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

/// How log lines look.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum LogFormat {
    /// For people.
    Text,
    /// One JSON object per line.
    Json,
}

impl LogFormat {
    /// From now on the log goes to standard error: what `RUST_LOG` asks for, or `info`.
    ///
    /// # Errors
    /// If `RUST_LOG` is no list of `LEVEL` and `TARGET=LEVEL`.
    pub fn start(self) -> anyhow::Result<()> {
        let wanted = match env::var("RUST_LOG") {
            Ok(wanted) => self::wanted(&wanted)?,
            Err(VarError::NotPresent) => Targets::new().with_default(LevelFilter::INFO),
            Err(error) => return Err(error).context("RUST_LOG"),
        };
        let lines = tracing_subscriber::fmt::layer()
            .with_writer(io::stderr)
            // A line that cannot be written would be told of on the same standard error, whose failure is a
            // panic: a full disk under the log would end the slots.
            .log_internal_errors(false)
            .with_ansi(io::stderr().is_terminal());
        let lines: Box<dyn Layer<Registry> + Send + Sync> = match self {
            Self::Text => lines.boxed(),
            Self::Json => lines.json().boxed(),
        };
        tracing_subscriber::registry()
            .with(lines.with_filter(wanted))
            .try_init()
            .context("starting the log")
    }
}

fn wanted(list: &str) -> anyhow::Result<Targets> {
    list.parse()
        .with_context(|| format!("RUST_LOG={list:?}: expected for example info,sqlx::query=debug"))
}

#[cfg(test)]
mod tests {
    use tracing_subscriber::filter::LevelFilter;

    #[test]
    fn parts_of_the_program_can_have_a_level_of_their_own() {
        let wanted = super::wanted("info,sqlx::query=debug").unwrap();
        let enabled = |target, level: LevelFilter| {
            wanted.would_enable(target, &level.into_level().expect("a level"))
        };
        assert!(enabled("sqlx::query", LevelFilter::DEBUG));
        assert!(enabled("faceoff_worker::slot", LevelFilter::INFO));
        assert!(!enabled("faceoff_worker::slot", LevelFilter::DEBUG));
    }

    #[test]
    fn a_list_that_is_none_is_named() {
        let error = super::wanted("faceoff=loud").unwrap_err();
        assert!(format!("{error:#}").contains("faceoff=loud"), "{error:#}");
    }
}
