use crate::bundle::error::BundleError;
use faceoff_types::IMAGE_RUNTIME;

/// What is said of an archive that is an image, as far as can be told, and holds none that can run.
pub(super) fn invalid(problem: impl std::fmt::Display) -> BundleError {
    BundleError::Invalid(format!("the container image {problem}"))
}

/// What must be in a Dockerfile, for those who write their first one.
pub(super) fn what_to_write() -> String {
    format!(
        "an image holds the agent's folder as /agent, with its agent.toml (runtime = {IMAGE_RUNTIME:?}): put \
         `COPY . /agent` into the Dockerfile that lies in that folder"
    )
}
