//! Agent faults: what an agent did against the protocol, or which limit it exceeded.

use crate::AgentTask;
use serde::{Deserialize, Serialize};
use std::fmt;

/// What an agent did wrong (docs/protocol.md, "Faults"). A platform fault has a different type, in the crate
/// where it arises, and is never converted into one of these.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum AgentFaultKind {
    /// A line that is not a JSON object.
    NotJson { detail: String },
    /// Another message than the one expected.
    WrongMessage {
        /// What the protocol asked for, e.g. `ready with episode 3`.
        expected: String,
        got: String,
    },
    /// An action whose shape is not the one of the agreed interpolation.
    WrongShape {
        /// The agreed shape, e.g. `[2][7]`.
        expected: String,
        /// The shape that was sent.
        got: String,
    },
    /// NaN or an infinity, or a number beyond what `f64` holds.
    NonFinite,
    /// A finite number beyond the largest magnitude allowed.
    TooLarge {
        /// Position in the answer, e.g. `action[1][3]`.
        place: String,
        value: f64,
        /// The largest magnitude allowed.
        limit: f64,
    },
    /// The commands drove the simulated world beyond what can be simulated.
    Diverged {
        /// The quantity that left its bounds, and its bounds.
        detail: String,
    },
    /// A line longer than the protocol allows.
    LineTooLong { limit_bytes: u64 },
    /// No answer within the time limit.
    TimedOut {
        /// Which answer was due.
        phase: Phase,
        limit_s: f64,
    },
    /// Each answer came in time, but all together took longer than their budget.
    TimeBudget {
        /// What the budget is for: the steps of an episode, or the resets of a shard.
        phase: Phase,
        used_s: f64,
        limit_s: f64,
    },
    /// Standard output was closed while an answer was due.
    ClosedOutput,
    /// The process ended while an answer was due.
    Exited { code: i32 },
    /// The process was ended by a signal that the evaluator (the program that plays the episodes) did not send.
    Signalled { signal: i32 },
    /// The process was ended because it exceeded a resource limit.
    LimitExceeded {
        /// Name of the limit, e.g. `memory`.
        limit: String,
        /// The limit, with its unit.
        allowed: String,
        /// The amount used, with its unit.
        used: String,
    },
    /// The program could not be started: the command is missing or not executable.
    CannotStart { detail: String },
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
            Self::TooLarge {
                place,
                value,
                limit,
            } => write!(
                f,
                "{place} is {value:?}: expected numbers between -{limit} and {limit} (rad, rad/s, rad/s²)"
            ),
            Self::Diverged { detail } => write!(
                f,
                "the commands made the simulated world diverge: {detail}; command positions, \
                 velocities and accelerations that the robot can follow"
            ),
            Self::LineTooLong { limit_bytes } => {
                write!(
                    f,
                    "the answer is longer than {limit_bytes} bytes without a newline"
                )
            }
            Self::TimedOut { phase, limit_s } => {
                write!(f, "no answer within the {phase} limit of {limit_s} s")
            }
            Self::TimeBudget {
                phase,
                used_s,
                limit_s,
            } => {
                let answers = match phase {
                    Phase::Step => "the answers of this episode",
                    Phase::Reset => "the resets of this shard",
                    Phase::StartUp => "the start-ups",
                };
                write!(
                    f,
                    "time budget: {answers} took {used_s:.2} s in all, and {limit_s:.2} s are allowed"
                )
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

/// The usual cause of the signals that end agents. An agent is process 1 of its sandbox, where the kernel
/// ignores the signal of `abort`; the C library then ends it with an invalid access instead.
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

/// The answer that the evaluator waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// Starting, up to the answer to `hello`.
    StartUp,
    /// Getting ready for an episode: the answer to `reset`.
    Reset,
    /// The answer to `step`.
    Step,
}

impl fmt::Display for Phase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::StartUp => "start-up",
            Self::Reset => "reset",
            Self::Step => "step",
        })
    }
}

/// A fault of an agent, with the place and the offending line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AgentFault {
    #[serde(flatten)]
    pub fault: AgentFaultKind,
    /// The task that the agent was given.
    #[serde(flatten)]
    pub agent_task: AgentTask,
    /// The episode; `None` during start-up.
    pub episode: Option<u32>,
    /// The control step; `None` outside of an episode.
    pub step: Option<u32>,
    /// The offending line, if there was one, cut to 400 characters.
    pub line: Option<String>,
}

impl fmt::Display for AgentFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.agent_task)?;
        match (self.episode, self.step) {
            (Some(episode), Some(step)) => write!(f, ", episode {episode}, step {step}")?,
            (Some(episode), None) => write!(f, ", episode {episode}, {}", Phase::Reset)?,
            (None, _) => write!(f, ", {}", Phase::StartUp)?,
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
    use crate::{Side, Task};

    /// These lines are stored in databases and datasets.
    #[test]
    fn stored_faults_stay_readable_and_name_the_side() {
        let fault = AgentFault {
            fault: AgentFaultKind::TimedOut {
                phase: Phase::StartUp,
                limit_s: 120.0,
            },
            agent_task: Task::new("hit").into(),
            episode: None,
            step: None,
            line: None,
        };
        let mut game_fault = fault.clone();
        game_fault.agent_task = AgentTask::Game { side: Side::Second };
        for (fault, stored, shown) in [
            (
                fault,
                r#"{"kind":"timed_out","phase":"start-up","limit_s":120.0,"task":"hit","episode":null,"step":null,"line":null}"#,
                "hit, start-up: no answer within the start-up limit of 120 s",
            ),
            (
                game_fault,
                r#"{"kind":"timed_out","phase":"start-up","limit_s":120.0,"task":"tournament","side":2,"episode":null,"step":null,"line":null}"#,
                "tournament, side 2, start-up: no answer within the start-up limit of 120 s",
            ),
        ] {
            assert_eq!(serde_json::to_string(&fault).unwrap(), stored);
            assert_eq!(serde_json::from_str::<AgentFault>(stored).unwrap(), fault);
            assert_eq!(fault.to_string(), shown);
        }
        for (kind, stored) in [
            (
                AgentFaultKind::TooLarge {
                    place: "action[3]".into(),
                    value: -1.7e308,
                    limit: 1e4,
                },
                r#"{"kind":"too_large","place":"action[3]","value":-1.7e+308,"limit":10000.0}"#,
            ),
            (
                AgentFaultKind::Diverged { detail: "x".into() },
                r#"{"kind":"diverged","detail":"x"}"#,
            ),
        ] {
            assert_eq!(serde_json::to_string(&kind).unwrap(), stored);
            let read: AgentFaultKind = serde_json::from_str(stored).unwrap();
            assert_eq!(read, kind);
        }
        for wrong in [
            r#"{"task":"tournament"}"#,
            r#"{"task":"hit","side":1}"#,
            r#"{"task":"tournament","side":3}"#,
        ] {
            assert!(serde_json::from_str::<AgentTask>(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn sigsegv_message_mentions_abort() {
        let message = |signal| AgentFaultKind::Signalled { signal }.to_string();
        assert!(message(11).starts_with("the agent was ended by signal 11 (SIGSEGV"));
        assert!(message(11).contains("abort"));
        assert_eq!(message(12), "the agent was ended by signal 12");
    }
}
