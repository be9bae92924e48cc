use faceoff_runner::PlatformFault;

/// What to do about it.
pub(super) fn explained(fault: PlatformFault) -> anyhow::Error {
    let host_busy = matches!(fault, PlatformFault::HostBusy(_));
    let error = anyhow::Error::new(fault);
    if host_busy {
        error.context(
            "the game was broken, not by an agent: play it again when the machine is less busy",
        )
    } else {
        error.context("the game was broken, not by an agent")
    }
}
