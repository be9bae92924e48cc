//! Why an agent's process tree ended: agent fault, platform fault, or killed by this process on purpose.

use crate::{Limits, cgroup::ExceededLimit};
use faceoff_types::AgentFaultKind;
use std::{os::unix::process::ExitStatusExt, process::ExitStatus};

/// How a process tree ended.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum ExitCause {
    /// It exited, was killed by a signal, or reached a limit.
    Agent(AgentFaultKind),
    /// The sandbox failed; the text says how.
    Platform(String),
    /// This process killed it on purpose.
    Killed,
}

/// The facts about an ended process tree.
#[derive(Debug)]
pub(crate) struct ExitReport<'a> {
    /// Exit status of bubblewrap, or of the agent without bubblewrap.
    pub status: ExitStatus,
    /// With bubblewrap: the agent's exit code; the inner `None` if the agent never ran.
    pub sandboxed_exit: Option<Option<i32>>,
    pub exceeded_limit: Option<ExceededLimit>,
    pub stderr: &'a str,
    pub limits: &'a Limits,
}

/// Beginning of bubblewrap's error message if the agent's program cannot be executed.
const EXEC_FAILED: &str = "bwrap: execvp ";

impl ExitReport<'_> {
    /// Classifies the end; whether the agent is at fault for its task is decided by the caller.
    pub(crate) fn cause(&self) -> ExitCause {
        match self.sandboxed_exit {
            Some(Some(code)) => self.classify_exit_code(code),
            Some(None) => self.classify_sandbox_failure(),
            None => match (self.status.code(), self.status.signal()) {
                (Some(code), _) => self.classify_exit_code(code),
                (None, Some(signal)) => self.classify_signal(signal),
                (None, None) => ExitCause::Platform(format!(
                    "the agent's process has an unknown exit status: {}",
                    self.status
                )),
            },
        }
    }

    /// bubblewrap ended without an exit code of the agent. As long as the agent does not run, only bubblewrap
    /// writes to standard error.
    fn classify_sandbox_failure(&self) -> ExitCause {
        if let Some(detail) = self
            .stderr
            .lines()
            .find_map(|line| line.strip_prefix(EXEC_FAILED))
        {
            return ExitCause::Agent(AgentFaultKind::CannotStart {
                detail: detail.to_owned(),
            });
        }
        // The OOM killer may choose bubblewrap's own process in the agent's cgroup.
        if let Some(ExceededLimit::Memory { peak_bytes }) = self.exceeded_limit {
            return self.memory_limit_exceeded(peak_bytes);
        }
        let message = self.stderr.trim();
        let message = if message.is_empty() {
            "it printed no message"
        } else {
            message
        };
        ExitCause::Platform(format!(
            "bubblewrap ended before the agent ({}): {message}",
            self.status
        ))
    }

    fn classify_exit_code(&self, code: i32) -> ExitCause {
        // bubblewrap, like a shell, reports a signal as 128 plus its number.
        if self.sandboxed_exit.is_some() && (129..=192).contains(&code) {
            return self.classify_signal(code - 128);
        }
        match &self.exceeded_limit {
            Some(ExceededLimit::Memory { peak_bytes }) if code != 0 => {
                self.memory_limit_exceeded(*peak_bytes)
            }
            Some(ExceededLimit::Pids { refused }) if code != 0 => {
                ExitCause::Agent(AgentFaultKind::LimitExceeded {
                    limit: "processes".into(),
                    allowed: self.limits.pids.to_string(),
                    used: format!("{} (and {refused} more refused)", self.limits.pids),
                })
            }
            _ => ExitCause::Agent(AgentFaultKind::Exited { code }),
        }
    }

    fn classify_signal(&self, signal: i32) -> ExitCause {
        match &self.exceeded_limit {
            Some(ExceededLimit::Memory { peak_bytes }) => self.memory_limit_exceeded(*peak_bytes),
            _ if signal == libc::SIGXFSZ => ExitCause::Agent(AgentFaultKind::LimitExceeded {
                limit: "file size".into(),
                allowed: format!("{} bytes", self.limits.file_size_bytes),
                used: "more".into(),
            }),
            _ => ExitCause::Agent(AgentFaultKind::Signalled { signal }),
        }
    }

    fn memory_limit_exceeded(&self, peak_bytes: Option<u64>) -> ExitCause {
        ExitCause::Agent(AgentFaultKind::LimitExceeded {
            limit: "memory".into(),
            allowed: format!("{} bytes", self.limits.memory_bytes),
            used: peak_bytes.map_or_else(|| "more".into(), |bytes| format!("{bytes} bytes")),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `status` is a raw wait status: the exit code times 256, or the number of the signal.
    fn cause(
        sandboxed_exit: Option<Option<i32>>,
        status: i32,
        exceeded_limit: Option<ExceededLimit>,
        stderr: &str,
    ) -> ExitCause {
        let limits = Limits::default();
        let status = ExitStatus::from_raw(status);
        ExitReport {
            status,
            sandboxed_exit,
            exceeded_limit,
            stderr,
            limits: &limits,
        }
        .cause()
    }

    #[test]
    fn failed_exec_is_agent_fault_and_failed_mount_is_not() {
        let agent = cause(
            Some(None),
            1 << 8,
            None,
            "bwrap: execvp ./x: No such file or directory\n",
        );
        assert_eq!(
            agent,
            ExitCause::Agent(AgentFaultKind::CannotStart {
                detail: "./x: No such file or directory".into()
            })
        );
        let platform = cause(
            Some(None),
            1 << 8,
            None,
            "bwrap: Can't mount proc on /newroot/proc: Operation not permitted\n",
        );
        assert!(
            matches!(platform, ExitCause::Platform(error) if error.contains("Can't mount proc"))
        );
    }

    #[test]
    fn sandbox_killed_from_outside_is_a_platform_fault() {
        assert!(matches!(
            cause(Some(None), 9, None, "Traceback …"),
            ExitCause::Platform(_)
        ));
    }

    #[test]
    fn printing_bubblewraps_message_does_not_change_the_cause() {
        let cause = cause(
            Some(Some(3)),
            3 << 8,
            None,
            "bwrap: execvp ./x: No such file or directory\n",
        );
        assert_eq!(cause, ExitCause::Agent(AgentFaultKind::Exited { code: 3 }));
    }

    #[test]
    fn memory_limit_is_reported_only_if_it_killed_the_agent() {
        let memory = || {
            Some(ExceededLimit::Memory {
                peak_bytes: Some(7),
            })
        };
        assert!(matches!(
            cause(Some(Some(137)), 137 << 8, memory(), ""),
            ExitCause::Agent(AgentFaultKind::LimitExceeded { limit, used, .. }) if limit == "memory" && used == "7 bytes"
        ));
        assert_eq!(
            cause(Some(Some(0)), 0, memory(), ""),
            ExitCause::Agent(AgentFaultKind::Exited { code: 0 })
        );
        assert_eq!(
            cause(Some(Some(137)), 137 << 8, None, ""),
            ExitCause::Agent(AgentFaultKind::Signalled {
                signal: libc::SIGKILL
            })
        );
    }
}
