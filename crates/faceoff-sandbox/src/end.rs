//! Why an agent ended, and whose doing it was.

use crate::{Limits, cgroup::LimitHit};
use faceoff_types::AgentFaultKind;
use std::{os::unix::process::ExitStatusExt, process::ExitStatus};

/// How a process tree ended.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum End {
    /// By itself or by a limit.
    Agent(AgentFaultKind),
    /// Something of ours failed under it.
    Platform(String),
    Killed,
}

/// What is known after the end.
#[derive(Debug)]
pub(crate) struct Evidence<'a> {
    /// bubblewrap's status, or the agent's own without bubblewrap.
    pub status: ExitStatus,
    /// With bubblewrap: what it told about the agent, `None` if the agent never ran.
    pub sandboxed: Option<Option<i32>>,
    pub limit_hit: Option<LimitHit>,
    pub stderr: &'a str,
    pub limits: &'a Limits,
}

/// How bubblewrap begins the line that says the agent's program cannot be executed.
const EXEC_FAILED: &str = "bwrap: execvp ";

impl Evidence<'_> {
    /// The verdict on the end, not on the agent.
    pub(crate) fn end(&self) -> End {
        match self.sandboxed {
            Some(Some(code)) => self.of_exit(code),
            Some(None) => self.of_sandbox_without_agent(),
            None => match (self.status.code(), self.status.signal()) {
                (Some(code), _) => self.of_exit(code),
                (None, Some(signal)) => self.of_signal(signal),
                (None, None) => End::Platform(format!(
                    "the agent's process ended strangely: {}",
                    self.status
                )),
            },
        }
    }

    /// bubblewrap ended without having seen the agent end. So long as the agent does not run, nobody
    /// but bubblewrap writes to standard error.
    fn of_sandbox_without_agent(&self) -> End {
        if let Some(detail) = self
            .stderr
            .lines()
            .find_map(|line| line.strip_prefix(EXEC_FAILED))
        {
            return End::Agent(AgentFaultKind::CannotStart {
                detail: detail.to_owned(),
            });
        }
        // Out of memory the kernel may choose bubblewrap's own process in the agent's cgroup.
        if let Some(LimitHit::Memory { peak_bytes }) = self.limit_hit {
            return self.of_memory(peak_bytes);
        }
        let said = self.stderr.trim();
        let said = if said.is_empty() {
            "it said nothing"
        } else {
            said
        };
        End::Platform(format!(
            "bubblewrap ended before the agent did ({}): {said}",
            self.status
        ))
    }

    fn of_exit(&self, code: i32) -> End {
        // bubblewrap, like a shell, tells a signal as 128 and its number.
        if self.sandboxed.is_some() && (129..=192).contains(&code) {
            return self.of_signal(code - 128);
        }
        match &self.limit_hit {
            Some(LimitHit::Memory { peak_bytes }) if code != 0 => self.of_memory(*peak_bytes),
            Some(LimitHit::Pids { refused }) if code != 0 => {
                End::Agent(AgentFaultKind::LimitExceeded {
                    limit: "processes".into(),
                    allowed: self.limits.pids.to_string(),
                    used: format!("{} (and {refused} more refused)", self.limits.pids),
                })
            }
            _ => End::Agent(AgentFaultKind::Exited { code }),
        }
    }

    fn of_signal(&self, signal: i32) -> End {
        match &self.limit_hit {
            Some(LimitHit::Memory { peak_bytes }) => self.of_memory(*peak_bytes),
            _ if signal == libc::SIGXFSZ => End::Agent(AgentFaultKind::LimitExceeded {
                limit: "file size".into(),
                allowed: format!("{} bytes", self.limits.file_size_bytes),
                used: "more".into(),
            }),
            _ => End::Agent(AgentFaultKind::Signalled { signal }),
        }
    }

    fn of_memory(&self, peak_bytes: Option<u64>) -> End {
        End::Agent(AgentFaultKind::LimitExceeded {
            limit: "memory".into(),
            allowed: format!("{} bytes", self.limits.memory_bytes),
            used: peak_bytes.map_or_else(|| "more".into(), |bytes| format!("{bytes} bytes")),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn end(
        sandboxed: Option<Option<i32>>,
        status: i32,
        limit_hit: Option<LimitHit>,
        stderr: &str,
    ) -> End {
        let limits = Limits::default();
        let status = ExitStatus::from_raw(status);
        Evidence {
            status,
            sandboxed,
            limit_hit,
            stderr,
            limits: &limits,
        }
        .end()
    }

    #[test]
    fn a_program_that_cannot_be_executed_is_the_teams_doing_and_a_mount_that_fails_is_ours() {
        let agent = end(
            Some(None),
            256,
            None,
            "bwrap: execvp ./x: No such file or directory\n",
        );
        assert_eq!(
            agent,
            End::Agent(AgentFaultKind::CannotStart {
                detail: "./x: No such file or directory".into()
            })
        );
        let ours = end(
            Some(None),
            256,
            None,
            "bwrap: Can't mount proc on /newroot/proc: Operation not permitted\n",
        );
        assert!(matches!(ours, End::Platform(why) if why.contains("Can't mount proc")));
    }

    #[test]
    fn a_sandbox_killed_from_outside_is_ours() {
        assert!(matches!(
            end(Some(None), 9, None, "Traceback …"),
            End::Platform(_)
        ));
    }

    #[test]
    fn an_agent_that_prints_bubblewraps_words_and_exits_is_judged_by_its_exit() {
        let end = end(
            Some(Some(3)),
            3 << 8,
            None,
            "bwrap: execvp ./x: No such file or directory\n",
        );
        assert_eq!(end, End::Agent(AgentFaultKind::Exited { code: 3 }));
    }

    #[test]
    fn memory_is_named_only_when_the_agent_died_of_it() {
        let memory = || {
            Some(LimitHit::Memory {
                peak_bytes: Some(7),
            })
        };
        assert!(matches!(
            end(Some(Some(137)), 137 << 8, memory(), ""),
            End::Agent(AgentFaultKind::LimitExceeded { limit, used, .. }) if limit == "memory" && used == "7 bytes"
        ));
        assert_eq!(
            end(Some(Some(0)), 0, memory(), ""),
            End::Agent(AgentFaultKind::Exited { code: 0 })
        );
        assert_eq!(
            end(Some(Some(137)), 137 << 8, None, ""),
            End::Agent(AgentFaultKind::Signalled {
                signal: libc::SIGKILL
            })
        );
    }
}
