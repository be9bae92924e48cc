//! Advice about an attempt without a result. A *platform fault* is a failure of the evaluator or the host that is no fault of an
//! agent.

use super::attempt::AttemptError;
use faceoff_runner::PlatformFault;

/// Adds advice to a platform fault.
pub(super) fn with_advice(error: AttemptError) -> anyhow::Error {
    let AttemptError::Platform(fault) = error else {
        return error.into();
    };
    let host_busy = matches!(fault, PlatformFault::HostBusy(_));
    let error = anyhow::Error::new(fault);
    if host_busy {
        error.context(
            "the game failed by a platform fault, not by an agent: play it again when the machine is less busy",
        )
    } else {
        error.context("the game failed by a platform fault, not by an agent")
    }
}
