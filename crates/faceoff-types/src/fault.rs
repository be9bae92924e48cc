use crate::Task;
use serde::{Deserialize, Serialize};
use std::fmt;

/// What an agent did wrong (PROTOCOL, "Agent faults"). A fault of the platform is a different type,
/// in the crate where it arises, and never becomes one of these.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum AgentFaultKind {
    /// A line that is not a JSON object.
    NotJson {
        /// The parser's words.
        detail: String,
    },
    /// Another message than the one expected.
    WrongMessage {
        /// What the protocol asked for, e.g. `ready with episode 3`.
        expected: String,
        /// What came.
        got: String,
    },
    /// An action of another shape than the agreed interpolation needs.
    WrongShape {
        /// The agreed shape, e.g. `[2][7]`.
        expected: String,
        /// The shape that came.
        got: String,
    },
    /// NaN or an infinity, or a number beyond what `f64` holds.
    NonFinite,
    /// A line longer than the protocol allows.
    LineTooLong {
        /// The limit in bytes.
        limit_bytes: u64,
    },
    /// No answer in time.
    TimedOut {
        /// `start-up`, `reset` or `step`.
        phase: String,
        /// The limit in seconds.
        limit_s: f64,
    },
    /// Standard output was closed while an answer was due.
    ClosedOutput,
    /// The process ended while an answer was due.
    Exited {
        /// Its exit code.
        code: i32,
    },
    /// The process was ended by a signal that the evaluator did not send.
    Signalled {
        /// The signal's number.
        signal: i32,
    },
    /// The process was ended because it used more than it may.
    LimitExceeded {
        /// The limit's name, e.g. `memory`.
        limit: String,
        /// What is allowed, with its unit.
        allowed: String,
        /// What was used, with its unit.
        used: String,
    },
    /// The program could not be started: the command is missing or not executable.
    CannotStart {
        /// Why.
        detail: String,
    },
}

impl fmt::Display for AgentFaultKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotJson { detail } => write!(f, "the answer is not a JSON object: {detail}"),
            Self::WrongMessage { expected, got } => write!(f, "expected {expected}, got {got}"),
            Self::WrongShape { expected, got } => {
                write!(f, "expected an action of shape {expected}, got {got}")
            }
            Self::NonFinite => f.write_str("the action holds a number that is not finite"),
            Self::LineTooLong { limit_bytes } => {
                write!(
                    f,
                    "the answer is longer than {limit_bytes} bytes without a newline"
                )
            }
            Self::TimedOut { phase, limit_s } => {
                write!(f, "no answer within the {phase} limit of {limit_s} s")
            }
            Self::ClosedOutput => f.write_str("the agent closed its standard output"),
            Self::Exited { code } => write!(f, "the agent exited with status {code}"),
            Self::Signalled { signal } => {
                write!(f, "the agent was ended by signal {signal}")?;
                f.write_str(signal_note(*signal))
            }
            Self::LimitExceeded {
                limit,
                allowed,
                used,
            } => {
                write!(
                    f,
                    "the agent exceeded its {limit} limit: {used} used, {allowed} allowed"
                )
            }
            Self::CannotStart { detail } => write!(f, "the agent cannot be started: {detail}"),
        }
    }
}

/// What a signal usually means, for those that an agent meets. An agent is the first process of its
/// sandbox, which the kernel spares the signal of `abort`; the C library then ends it by an invalid
/// access instead.
const fn signal_note(signal: i32) -> &'static str {
    match signal {
        4 => " (SIGILL: an instruction that this CPU does not know, or a trap of the runtime)",
        6 => " (SIGABRT: it called abort)",
        7 => " (SIGBUS: an access beyond a mapped file)",
        8 => " (SIGFPE: a division by zero)",
        9 => " (SIGKILL)",
        11 => " (SIGSEGV: an invalid access, or a call of abort, which ends so in the sandbox)",
        _ => "",
    }
}

/// One fault of an agent: what, where, and the offending line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AgentFault {
    /// What it did.
    #[serde(flatten)]
    pub fault: AgentFaultKind,
    /// The task it was playing.
    pub task: Task,
    /// The episode; `None` during start-up.
    pub episode: Option<u32>,
    /// The control step; `None` outside of an episode.
    pub step: Option<u32>,
    /// The offending line, cut to 400 characters, where there was one.
    pub line: Option<String>,
}

impl fmt::Display for AgentFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.task)?;
        match (self.episode, self.step) {
            (Some(episode), Some(step)) => write!(f, ", episode {episode}, step {step}")?,
            (Some(episode), None) => write!(f, ", episode {episode}, reset")?,
            (None, _) => write!(f, ", start-up")?,
        }
        write!(f, ": {}", self.fault)?;
        if let Some(line) = &self.line {
            write!(f, " (line: {line})")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crash_in_the_sandbox_does_not_hide_that_it_may_have_been_an_abort() {
        let told = |signal| AgentFaultKind::Signalled { signal }.to_string();
        assert!(told(11).starts_with("the agent was ended by signal 11 (SIGSEGV"));
        assert!(told(11).contains("abort"));
        assert_eq!(told(12), "the agent was ended by signal 12");
    }
}
