//! Errors of the sandbox: platform faults, and failures to start an agent or to write to it.

use crate::Layer;
use faceoff_types::AgentFaultKind;
use std::{fmt, io};

/// A platform fault: the sandbox could not be set up or observed.
#[derive(Debug, thiserror::Error)]
pub enum SandboxError {
    /// A system call that should work did not.
    #[error("{action}: {cause}")]
    Io {
        /// The failed action, lower-case, without the reason.
        action: String,
        /// Part of the text, so not also a source: a chain of errors would print it twice.
        cause: io::Error,
    },
    /// The host lacks a layer that the organiser has not disabled.
    #[error("this host cannot provide the layer {layer}: {reason}")]
    Unavailable {
        layer: Layer,
        /// The missing feature and, if known, the fix.
        reason: String,
    },
}

impl SandboxError {
    /// Wraps an I/O error with the failed action.
    pub(crate) fn io(action: impl Into<String>, cause: impl Into<io::Error>) -> Self {
        Self::Io {
            action: action.into(),
            cause: cause.into(),
        }
    }

    /// A failure without an error of a system call.
    pub(crate) fn other(action: impl Into<String>, reason: impl Into<String>) -> Self {
        Self::Io {
            action: action.into(),
            cause: io::Error::other(reason.into()),
        }
    }
}

/// Adds the failed action to an I/O error: lower-case, without the reason.
pub(crate) trait IoContext<T> {
    fn context(self, action: impl fmt::Display) -> Result<T, SandboxError>;
}

impl<T, E: Into<io::Error>> IoContext<T> for Result<T, E> {
    fn context(self, action: impl fmt::Display) -> Result<T, SandboxError> {
        self.map_err(|cause| SandboxError::io(action.to_string(), cause))
    }
}

/// Failure to start an agent.
#[derive(Debug, thiserror::Error)]
pub enum SpawnError {
    /// Agent fault: the bundle's command cannot be started.
    #[error("{0}")]
    Agent(AgentFaultKind),
    /// Platform fault: the sandbox cannot be set up.
    #[error(transparent)]
    Platform(#[from] SandboxError),
}

/// Failure to write a line.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The agent's end of its standard input is closed.
    #[error("the agent closed its standard input")]
    Closed,
    /// The socket or the sandbox failed.
    #[error(transparent)]
    Platform(#[from] SandboxError),
}
