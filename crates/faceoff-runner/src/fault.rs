//! Failures of a session with an agent. An *agent fault* is a violation of the protocol or of a limit; a *platform fault* is any other
//! failure, for which the agent is not blamed.

use crate::wait_breakdown::WaitBreakdown;
use faceoff_dataset::RecordingError;
use faceoff_episode::{InvalidConditions, NonFiniteObservation, RecordError};
use faceoff_sandbox::SandboxError;
use faceoff_types::{AgentFaultKind, UnknownTask, is_full_disk};
use std::io;

/// Failure of a session with an agent.
#[derive(Debug)]
pub enum SessionError {
    /// The agent broke the protocol or a limit.
    Agent {
        fault: AgentFaultKind,
        /// The offending line, shortened, if there is one.
        line: Option<String>,
    },
    /// The agent did not answer within a hard limit (the time after which a missing answer is a fault), and host interference does not
    /// explain that.
    TimedOut {
        fault: AgentFaultKind,
        wait: Box<WaitBreakdown>,
    },
    /// No answer came within a hard limit that was extended by host interference, which explains the missing answer.
    HostInterference {
        /// The agent fault to report if the try is not repeated.
        fault: AgentFaultKind,
        wait: Box<WaitBreakdown>,
    },
    Platform(PlatformFault),
}

impl From<AgentFaultKind> for SessionError {
    fn from(fault: AgentFaultKind) -> Self {
        Self::Agent { fault, line: None }
    }
}

impl From<PlatformFault> for SessionError {
    fn from(fault: PlatformFault) -> Self {
        Self::Platform(fault)
    }
}

impl From<SandboxError> for SessionError {
    fn from(error: SandboxError) -> Self {
        Self::Platform(error.into())
    }
}

impl From<UnknownTask> for SessionError {
    fn from(error: UnknownTask) -> Self {
        Self::Platform(error.into())
    }
}

impl From<NonFiniteObservation> for SessionError {
    fn from(error: NonFiniteObservation) -> Self {
        Self::Platform(error.into())
    }
}

/// A platform fault. The job must be run again; the agent is never blamed for it.
#[derive(Debug, thiserror::Error)]
pub enum PlatformFault {
    /// The sandbox could not be set up or observed.
    #[error(transparent)]
    Sandbox(#[from] SandboxError),
    /// A file could not be read or written.
    #[error("{action}: {source}")]
    Io {
        /// The failed action.
        action: String,
        source: io::Error,
    },
    /// The disk has no space left for a recording; the text names the file.
    #[error("the disk is full: {0}")]
    FullDisk(String),
    /// A recording could not be written, or its content is wrong.
    #[error("recording: {0}")]
    Recording(String),
    /// The simulated state became infinite or NaN.
    #[error(transparent)]
    Simulation(#[from] NonFiniteObservation),
    /// The competition's simulator does not keep to its contract.
    #[error("simulator: {0}")]
    Simulator(String),
    /// The simulator has no such task.
    #[error(transparent)]
    UnknownTask(#[from] UnknownTask),
    /// The simulator has no such ruleset, profile or magnitudes.
    #[error(transparent)]
    InvalidConditions(#[from] InvalidConditions),
    /// Host interference repeatedly prevented an agent's answer, in a run that needs a verdict on the agent.
    #[error("host interference prevented the agent's answer ({0})")]
    HostBusy(WaitBreakdown),
    /// The observer of the run cancelled it.
    #[error("cancelled")]
    Cancelled,
}

impl From<RecordError> for PlatformFault {
    fn from(error: RecordError) -> Self {
        let recording = error.source.downcast_ref();
        if matches!(recording, Some(RecordingError::FullDisk(_))) || is_full_disk(&error) {
            Self::FullDisk(error.to_string())
        } else {
            Self::Recording(error.to_string())
        }
    }
}

impl From<RecordingError> for PlatformFault {
    fn from(error: RecordingError) -> Self {
        match error {
            RecordingError::Io(source) => Self::Io {
                action: "recording".to_owned(),
                source,
            },
            RecordingError::FullDisk(detail) => Self::FullDisk(detail),
            RecordingError::Unusable(detail) => Self::Recording(detail),
        }
    }
}

impl PlatformFault {
    /// Turns an I/O error into a fault that names the failed action.
    pub(crate) fn io(action: impl Into<String>) -> impl FnOnce(io::Error) -> Self {
        let action = action.into();
        move |source| Self::Io { action, source }
    }
}
