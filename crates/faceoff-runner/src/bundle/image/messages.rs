//! Error messages about container images.

use crate::bundle::error::BundleError;
use faceoff_types::IMAGE_RUNTIME;

/// An error for an archive that looks like an image, but contains no image that can run.
pub(super) fn invalid(problem: impl std::fmt::Display) -> BundleError {
    BundleError::Invalid(format!("the container image {problem}"))
}

/// A hint about the Dockerfile, for users who write their first one.
pub(super) fn dockerfile_hint() -> String {
    format!(
        "an image contains the agent's folder as /agent, with its agent.toml (runtime = {IMAGE_RUNTIME:?}): put \
         `COPY . /agent` into the Dockerfile in that folder"
    )
}
