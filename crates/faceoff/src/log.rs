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
            Err(VarError::NotPresent) => self::wanted("info")?,
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

/// The client of NATS tells of each try to connect, and why it fails; server and worker say so once for each reason.
const TALKATIVE: &str = "async_nats";

fn wanted(list: &str) -> anyhow::Result<Targets> {
    let wanted: Targets = list.parse().with_context(|| {
        format!("RUST_LOG={list:?}: expected for example info,sqlx::query=debug")
    })?;
    let is_named = wanted
        .iter()
        .any(|(target, _)| target.starts_with(TALKATIVE));
    let asks_for_all = wanted
        .default_level()
        .is_some_and(|level| level > LevelFilter::INFO);
    Ok(if is_named || asks_for_all {
        wanted
    } else {
        wanted.with_target(TALKATIVE, LevelFilter::OFF)
    })
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
    fn the_client_of_nats_is_heard_when_it_is_asked_for() {
        for (list, heard) in [
            ("info", false),
            ("warn,sqlx=debug", false),
            ("info,async_nats=warn", true),
            ("info,async_nats::connector=warn", true),
            ("debug", true),
        ] {
            let wanted = super::wanted(list).unwrap();
            let is_heard = wanted.would_enable("async_nats::connector", &tracing::Level::ERROR);
            assert_eq!(is_heard, heard, "{list}");
            assert!(wanted.would_enable("faceoff_worker::slot", &tracing::Level::WARN));
        }
    }

    #[test]
    fn a_list_that_is_none_is_named() {
        let error = super::wanted("faceoff=loud").unwrap_err();
        assert!(format!("{error:#}").contains("faceoff=loud"), "{error:#}");
    }
}
