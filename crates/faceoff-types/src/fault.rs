use crate::Contest;
use serde::{Deserialize, Serialize};
use std::fmt;

/// What an agent did wrong (PROTOCOL, "Agent faults"). A fault of the platform is a different type,
/// in the crate where it arises, and never becomes one of these.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum AgentFaultKind {
    /// A line that is not a JSON object.
    NotJson {
        detail: String,
    },
    /// Another message than the one expected.
    WrongMessage {
        /// What the protocol asked for, e.g. `ready with episode 3`.
        expected: String,
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
    /// A finite number that no action needs.
    TooLarge {
        /// Where, e.g. `action[1][3]`.
        place: String,
        value: f64,
        /// The largest magnitude allowed.
        limit: f64,
    },
    /// The commands drove the simulated world beyond what can be simulated.
    Diverged {
        /// What left its bounds, and which.
        detail: String,
    },
    /// A line longer than the protocol allows.
    LineTooLong {
        /// The limit in bytes.
        limit_bytes: u64,
    },
    /// No answer in time.
    TimedOut {
        /// What was waited for.
        phase: Phase,
        /// The limit in seconds.
        limit_s: f64,
    },
    /// Answers that came, each in time, but took too long in all.
    TimeBudget {
        /// Which answers: of an episode's steps, or of a shard's resets.
        phase: Phase,
        /// What they add up to, in seconds.
        used_s: f64,
        /// What is allowed, in seconds.
        limit_s: f64,
    },
    /// Standard output was closed while an answer was due.
    ClosedOutput,
    /// The process ended while an answer was due.
    Exited {
        code: i32,
    },
    /// The process was ended by a signal that the evaluator did not send.
    Signalled {
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
                let all = match phase {
                    Phase::Step => "the answers of this episode",
                    Phase::Reset => "the resets of this shard",
                    Phase::StartUp => "the start-ups",
                };
                write!(
                    f,
                    "time budget: {all} took {used_s:.2} s in all, and {limit_s:.2} s are allowed"
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

/// What an agent is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// To start and to answer `hello`.
    StartUp,
    /// To get ready for an episode.
    Reset,
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

/// One fault of an agent: what, where, and the offending line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AgentFault {
    #[serde(flatten)]
    pub fault: AgentFaultKind,
    /// What it was playing.
    #[serde(flatten)]
    pub contest: Contest,
    /// The episode; `None` during start-up.
    pub episode: Option<u32>,
    /// The control step; `None` outside of an episode.
    pub step: Option<u32>,
    /// The offending line, cut to 400 characters, where there was one.
    pub line: Option<String>,
}

impl fmt::Display for AgentFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.contest)?;
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

    /// Databases and datasets hold these lines.
    #[test]
    fn stored_faults_stay_readable_and_a_games_fault_adds_its_side() {
        let fault = AgentFault {
            fault: AgentFaultKind::TimedOut {
                phase: Phase::StartUp,
                limit_s: 120.0,
            },
            contest: Task::Hit.into(),
            episode: None,
            step: None,
            line: None,
        };
        let mut in_a_game = fault.clone();
        in_a_game.contest = Contest::Game { side: Side::Second };
        for (fault, stored, shown) in [
            (
                fault,
                r#"{"kind":"timed_out","phase":"start-up","limit_s":120.0,"task":"hit","episode":null,"step":null,"line":null}"#,
                "hit, start-up: no answer within the start-up limit of 120 s",
            ),
            (
                in_a_game,
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
            assert!(serde_json::from_str::<Contest>(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_crash_in_the_sandbox_does_not_hide_that_it_may_have_been_an_abort() {
        let told = |signal| AgentFaultKind::Signalled { signal }.to_string();
        assert!(told(11).starts_with("the agent was ended by signal 11 (SIGSEGV"));
        assert!(told(11).contains("abort"));
        assert_eq!(told(12), "the agent was ended by signal 12");
    }
}
