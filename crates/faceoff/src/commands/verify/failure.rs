//! The failures of `faceoff verify`, and their exit statuses.

use crate::exit::Exit;
use anyhow::anyhow;
use faceoff_dataset::{
    DatasetError,
    verify::{SeasonMismatch, VerifyError},
};

/// Reason why a recording is not verified.
#[derive(Debug, thiserror::Error)]
pub(super) enum Failure {
    #[error(transparent)]
    Verify(#[from] VerifyError),
    /// The seeds are not derived from the season's secret, or the secret does not match its commitment.
    #[error("{error}{hint}")]
    Season {
        #[source]
        error: SeasonMismatch,
        hint: &'static str,
    },
    /// This machine or the command line, not the recording, is the cause.
    #[error("{0:#}")]
    Local(anyhow::Error),
}

impl From<SeasonMismatch> for Failure {
    fn from(error: SeasonMismatch) -> Self {
        Self::Season { error, hint: "" }
    }
}

impl From<DatasetError> for Failure {
    fn from(error: DatasetError) -> Self {
        Self::Verify(error.into())
    }
}

impl Failure {
    pub(super) fn exit(&self) -> Exit {
        match self {
            Self::Season { .. }
            | Self::Verify(
                VerifyError::Differs(_) | VerifyError::Dataset(DatasetError::Altered(_)),
            ) => Exit::Failed,
            Self::Verify(_) | Self::Local(_) => Exit::Misused,
        }
    }
}

/// Checks that the archive has the published hash.
pub(super) fn check_hash(
    expected: Option<&blake3::Hash>,
    found: Option<&str>,
) -> Result<(), Failure> {
    match (expected, found) {
        (Some(_), None) => Err(Failure::Local(anyhow!(
            "--blake3 is the hash of an archive, but this is an unpacked folder; name dataset.zip or game.zip itself"
        ))),
        (Some(expected), Some(found)) if expected.to_hex().as_str() != found => {
            Err(Failure::from(DatasetError::Altered(format!(
                "the archive's BLAKE3 is {found}, expected {expected}"
            ))))
        }
        _ => Ok(()),
    }
}
