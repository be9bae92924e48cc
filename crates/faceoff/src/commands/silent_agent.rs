//! An agent whose process runs and does not answer `hello`: the likely causes.

use faceoff_types::{AgentFault, AgentFaultKind, Phase};
use std::{
    fmt,
    sync::mpsc::{Receiver, RecvTimeoutError},
    time::Duration,
};

/// Time without any answer after which the likely causes are printed.
const EXPLANATION_DELAY: Duration = Duration::from_secs(5);

const LIKELY_CAUSES: &str = "\
Likely causes:
  its output stays in a buffer: flush after every line (Python: print(line, flush=True))
  it reads all of its input before it answers: read one line at a time
  it prints to standard error or to a file: answers go to standard output
  it is still loading: that may take as long as the start-up limit";

/// Whether the agent's process ran and did not answer `hello`.
pub(super) const fn is_silent_start(fault: &AgentFaultKind) -> bool {
    matches!(
        fault,
        AgentFaultKind::TimedOut {
            phase: Phase::StartUp,
            ..
        }
    )
}

/// Prints the likely causes if an agent has not answered after a while. The agents start one after the other; `ended_starts` has
/// a message when the start of each has ended, and is closed when the evaluation or game ends.
pub(super) fn explain(
    agents: &[&str],
    ended_starts: &Receiver<()>,
    print: impl Fn(fmt::Arguments<'_>),
) {
    for agent in agents {
        match ended_starts.recv_timeout(EXPLANATION_DELAY) {
            Ok(()) => continue,
            Err(RecvTimeoutError::Disconnected) => return,
            Err(RecvTimeoutError::Timeout) => print(format_args!(
                "note: {agent} has not answered `hello` for {} s. {LIKELY_CAUSES}",
                EXPLANATION_DELAY.as_secs()
            )),
        }
        if ended_starts.recv().is_err() {
            return;
        }
    }
}

/// Why an evaluation or game was stopped after the silent start of an agent. `stopped` names it: `evaluation` or `game`.
pub(super) fn stop_reason(agent: &str, stopped: &str, fault: &AgentFault) -> String {
    format!(
        "{agent} never answered, so the {stopped} was stopped after its first start: {fault}. {LIKELY_CAUSES}"
    )
}
