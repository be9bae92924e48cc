use crate::Layer;
use faceoff_types::AgentFaultKind;
use std::{fmt, io};

/// Our fault: the sandbox could not be set up or observed.
#[derive(Debug, thiserror::Error)]
pub enum SandboxError {
    /// A system call that should work did not.
    #[error("{what}: {source}")]
    Io {
        /// What was being done, lower-case, without the reason.
        what: String,
        source: io::Error,
    },
    /// The host lacks a layer that the organiser has not given up.
    #[error("this host cannot provide the layer {layer}: {why}")]
    Unavailable {
        /// The layer that is missing.
        layer: Layer,
        /// What is missing and, where known, what cures it.
        why: String,
    },
}

impl SandboxError {
    /// Wraps an I/O error with what was being done.
    pub(crate) fn io(what: impl Into<String>, source: impl Into<io::Error>) -> Self {
        Self::Io {
            what: what.into(),
            source: source.into(),
        }
    }

    /// A failure that no system call reports as such.
    pub(crate) fn other(what: impl Into<String>, why: impl Into<String>) -> Self {
        Self::Io {
            what: what.into(),
            source: io::Error::other(why.into()),
        }
    }
}

/// Says of an I/O error what was being done: lower-case, without the reason.
pub(crate) trait IoContext<T> {
    fn context(self, what: impl fmt::Display) -> Result<T, SandboxError>;
}

impl<T, E: Into<io::Error>> IoContext<T> for Result<T, E> {
    fn context(self, what: impl fmt::Display) -> Result<T, SandboxError> {
        self.map_err(|source| SandboxError::io(what.to_string(), source))
    }
}

/// Why no agent is running.
#[derive(Debug, thiserror::Error)]
pub enum SpawnError {
    /// The bundle's command cannot be started: the team's doing.
    #[error("{0}")]
    Agent(AgentFaultKind),
    /// The sandbox cannot be set up: ours.
    #[error(transparent)]
    Platform(#[from] SandboxError),
}

/// Why a line could not be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// Nobody reads the agent's standard input any more.
    #[error("the agent closed its standard input")]
    Closed,
    /// The pipe or the sandbox failed.
    #[error(transparent)]
    Platform(#[from] SandboxError),
}
