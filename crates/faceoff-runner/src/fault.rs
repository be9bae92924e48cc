use crate::waited::Waited;
use faceoff_dataset::RecordingError;
use faceoff_episode::{NotFinite, RecordError};
use faceoff_sandbox::SandboxError;
use faceoff_types::{AgentFaultKind, tells_of_full_disk};
use std::io;

/// What ended a conversation.
#[derive(Debug)]
pub enum Trouble {
    /// The agent broke the protocol or a limit.
    Agent {
        fault: AgentFaultKind,
        /// The offending line, cut, where there was one.
        line: Option<String>,
    },
    /// No answer came within a hard limit, and the host does not explain that.
    Late {
        fault: AgentFaultKind,
        /// Whose time it was.
        waited: Box<Waited>,
    },
    /// No answer came within a hard limit that was extended by what the host took, and the host explains
    /// it.
    Host {
        /// What it is if the try is not played again.
        fault: AgentFaultKind,
        /// Whose time it was.
        waited: Box<Waited>,
    },
    Platform(PlatformFault),
}

impl From<AgentFaultKind> for Trouble {
    fn from(fault: AgentFaultKind) -> Self {
        Self::Agent { fault, line: None }
    }
}

impl From<PlatformFault> for Trouble {
    fn from(fault: PlatformFault) -> Self {
        Self::Platform(fault)
    }
}

impl From<SandboxError> for Trouble {
    fn from(error: SandboxError) -> Self {
        Self::Platform(error.into())
    }
}

impl From<NotFinite> for Trouble {
    fn from(error: NotFinite) -> Self {
        Self::Platform(error.into())
    }
}

/// What failed on our side. The shard is to be run again; the agent is never blamed for it.
#[derive(Debug, thiserror::Error)]
pub enum PlatformFault {
    /// The sandbox could not be set up or observed.
    #[error(transparent)]
    Sandbox(#[from] SandboxError),
    /// A file could not be read or written.
    #[error("{what}: {source}")]
    Io {
        what: String,
        source: io::Error,
    },
    /// There was no room for a recording; the text says for what.
    #[error("the disk is full: {0}")]
    FullDisk(String),
    /// A recording could not be made, or is not what was recorded.
    #[error("recording: {0}")]
    Recording(String),
    /// The simulator's world stopped being finite.
    #[error(transparent)]
    Simulation(#[from] NotFinite),
    /// The host kept an agent from answering, again and again, in a run that is for nothing but a verdict
    /// on the agent.
    #[error("the host kept the agent from answering ({0})")]
    HostBusy(Waited),
    /// The observer asked to stop.
    #[error("cancelled")]
    Cancelled,
}

impl From<RecordError> for PlatformFault {
    fn from(error: RecordError) -> Self {
        let recording = error.source.downcast_ref();
        if matches!(recording, Some(RecordingError::FullDisk(_))) || tells_of_full_disk(&error) {
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
                what: "recording".to_owned(),
                source,
            },
            RecordingError::FullDisk(what) => Self::FullDisk(what),
            RecordingError::Unusable(what) => Self::Recording(what),
        }
    }
}

impl PlatformFault {
    /// Turns an I/O error into a fault that says what was attempted.
    pub(crate) fn io(what: impl Into<String>) -> impl FnOnce(io::Error) -> Self {
        let what = what.into();
        move |source| Self::Io { what, source }
    }
}
