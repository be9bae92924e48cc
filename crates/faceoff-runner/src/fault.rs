use faceoff_sandbox::SandboxError;
use std::io;

/// What failed on our side. The shard is to be run again; the agent is never blamed for it.
#[derive(Debug, thiserror::Error)]
pub enum PlatformFault {
    /// The sandbox could not be set up or observed.
    #[error(transparent)]
    Sandbox(#[from] SandboxError),
    /// A file could not be read or written.
    #[error("{what}: {source}")]
    Io {
        /// What was attempted.
        what: String,
        /// Why it failed.
        source: io::Error,
    },
    /// A recording could not be made, or is not what was recorded.
    #[error("recording: {0}")]
    Recording(String),
    /// The observer asked to stop.
    #[error("cancelled")]
    Cancelled,
}

impl From<faceoff_episode::RecordError> for PlatformFault {
    fn from(error: faceoff_episode::RecordError) -> Self {
        Self::Recording(error.to_string())
    }
}

impl PlatformFault {
    /// Turns an I/O error into a fault that says what was attempted.
    pub(crate) fn io(what: impl Into<String>) -> impl FnOnce(io::Error) -> Self {
        let what = what.into();
        move |source| Self::Io { what, source }
    }

    /// A fault of a recording, with what was attempted.
    pub(crate) fn recording<E: std::fmt::Display>(
        what: impl Into<String>,
    ) -> impl FnOnce(E) -> Self {
        let what = what.into();
        move |error| Self::Recording(format!("{what}: {error}"))
    }
}
