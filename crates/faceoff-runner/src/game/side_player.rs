//! One *side* of a game, as the evaluator drives it: an agent's process, its questions and its faults.

use crate::{
    bundle::Bundle,
    config::AgentEnvironment,
    fault::{PlatformFault, SessionError},
    host_interference::InterferenceMonitor,
    log::Log,
    session::Session,
    wait_breakdown::WaitBreakdown,
};
use faceoff_airhockey::{RallyReadiness, Response, SideFault};
use faceoff_episode::AnswerTiming;
use faceoff_sim::Interpolation;
use faceoff_types::{AgentFault, AgentTask, Side, TimeLimits};
use std::time::{Duration, Instant};

/// One side of a game: its agent's process, which is restarted after a fault, and its current question.
pub(super) struct SidePlayer<'a> {
    side: Side,
    bundle: &'a Bundle,
    env: &'a AgentEnvironment,
    /// Environment with the start-up limit of a restart.
    restart_env: AgentEnvironment,
    monitor: &'a dyn InterferenceMonitor,
    /// `None` before its first rally and after a fault.
    session: Option<Session<'a>>,
    was_started: bool,
    /// Is its fault in this rally in the log?
    is_fault_logged: bool,
    /// Time of the last question.
    asked_at: Instant,
    /// Result of the last question; `None` while its answer is pending, or if there is no question.
    result: Option<Result<AnswerTiming, SideFailure>>,
    /// The wait for the missing answer, if a timeout ended the agent.
    wait: Option<WaitBreakdown>,
    log: Log,
    max_host_interference_s: f64,
}

/// A violation of the protocol or of a limit by one side.
pub(super) struct SideFailure {
    fault: SideFault,
    /// Time until the violation.
    timing: AnswerTiming,
    wait: Option<WaitBreakdown>,
}

/// Result of a start; `startup_s` is `None` if the agent was running already.
pub(super) enum StartResult {
    Ready { startup_s: Option<f64> },
    Failed { startup_s: f64, fault: SideFault },
}

impl SideFailure {
    /// Separates agent faults from platform faults. A missing answer due to host interference is a platform fault: the
    /// game is run again.
    fn new(error: SessionError, asked_at: Instant) -> Result<Self, PlatformFault> {
        let failure = |kind, line, wait: Option<WaitBreakdown>| Self {
            fault: SideFault { kind, line },
            timing: match &wait {
                Some(wait) => AnswerTiming {
                    computation_time_s: wait.agent_time().as_secs_f64(),
                    host_time_s: wait.host_interference.as_secs_f64(),
                    cpu_time_s: wait.cpu_time_s,
                },
                None => AnswerTiming {
                    computation_time_s: asked_at.elapsed().as_secs_f64(),
                    host_time_s: 0.0,
                    cpu_time_s: None,
                },
            },
            wait,
        };
        match error {
            SessionError::Agent { fault, line } => Ok(failure(fault, line, None)),
            SessionError::TimedOut { fault, wait } => Ok(failure(fault, None, Some(*wait))),
            SessionError::HostInterference { wait, .. } => Err(PlatformFault::HostBusy(*wait)),
            SessionError::Platform(fault) => Err(fault),
        }
    }
}

impl<'a> SidePlayer<'a> {
    pub fn new(
        side: Side,
        bundle: &'a Bundle,
        env: &'a AgentEnvironment,
        restart_s: f64,
        monitor: &'a dyn InterferenceMonitor,
    ) -> Self {
        let time = TimeLimits {
            startup_s: env.time.startup_s.min(restart_s),
            ..env.time.clone()
        };
        Self {
            side,
            bundle,
            env,
            restart_env: AgentEnvironment {
                time,
                ..env.clone()
            },
            monitor,
            session: None,
            was_started: false,
            is_fault_logged: false,
            asked_at: Instant::now(),
            result: None,
            wait: None,
            log: Log::new(env.limits.stderr_kept_bytes),
            max_host_interference_s: 0.0,
        }
    }

    /// Starts the agent, if it is not running.
    pub fn start(&mut self) -> Result<StartResult, PlatformFault> {
        self.is_fault_logged = false;
        if self.session.is_some() {
            return Ok(StartResult::Ready { startup_s: None });
        }
        let env = if self.was_started {
            &self.restart_env
        } else {
            self.env
        };
        self.was_started = true;
        self.result = None;
        let started_at = Instant::now();
        let agent_task = AgentTask::Game { side: self.side };
        match Session::start_monitored(self.bundle, env, agent_task, self.monitor) {
            Ok(session) => {
                let startup_s = Some(session.startup_s());
                self.session = Some(session);
                Ok(StartResult::Ready { startup_s })
            }
            Err((error, stderr)) => {
                let failure = SideFailure::new(error, started_at)?;
                self.log.add(&stderr, None);
                self.wait = failure.wait;
                Ok(StartResult::Failed {
                    startup_s: failure.timing.computation_time_s,
                    fault: failure.fault,
                })
            }
        }
    }

    /// Sends a question; an immediate failure becomes the result.
    pub fn ask(
        &mut self,
        question: impl FnOnce(&mut Session<'_>) -> Result<(), SessionError>,
    ) -> Result<(), PlatformFault> {
        self.asked_at = Instant::now();
        self.result = None;
        let Some(session) = &mut self.session else {
            return Ok(());
        };
        if let Err(error) = question(session) {
            self.result = Some(Err(SideFailure::new(error, self.asked_at)?));
        }
        Ok(())
    }

    /// The session, while an answer is pending.
    pub fn pending_session(&self) -> Option<&Session<'a>> {
        self.session
            .as_ref()
            .filter(|session| self.result.is_none() && session.is_pending())
    }

    /// Waits for the pending answer until `deadline`.
    pub fn poll(&mut self, deadline: Instant) -> Result<(), PlatformFault> {
        let Some(session) = &mut self.session else {
            return Ok(());
        };
        match session.poll(deadline) {
            Ok(None) => {}
            Ok(Some(timing)) => {
                self.max_host_interference_s = self.max_host_interference_s.max(timing.host_time_s);
                self.result = Some(Ok(timing));
            }
            Err(error) => self.result = Some(Err(SideFailure::new(error, self.asked_at)?)),
        }
        Ok(())
    }

    /// Freezes the agent until its next question, if it runs and no answer is pending.
    pub fn freeze(&mut self) {
        if self.pending_session().is_none()
            && let Some(session) = &mut self.session
        {
            session.freeze();
        }
    }

    /// Can the host freeze the agent, if it runs?
    pub fn can_freeze(&self) -> bool {
        self.session.as_ref().is_none_or(Session::can_freeze)
    }

    /// Adds time in which the evaluator was busy with the other side.
    pub fn add_absence(&mut self, absence: Duration) {
        if let Some(session) = &mut self.session {
            session.add_absence(absence);
        }
    }

    /// How this side got ready for the rally; called after the answer to its reset.
    pub fn rally_readiness(&mut self, start: StartResult) -> RallyReadiness {
        let startup_s = match start {
            StartResult::Ready { startup_s } => startup_s,
            StartResult::Failed { startup_s, fault } => {
                return RallyReadiness::StartFailed { startup_s, fault };
            }
        };
        let interpolation = self
            .session
            .as_ref()
            .and_then(|session| Interpolation::from_code(session.layout().code()).ok())
            .expect("an agent that is ready runs, with a layout of the competition");
        match self.result.take().expect("the reset has a result") {
            Ok(timing) => RallyReadiness::Ready {
                startup_s,
                interpolation,
                reset_s: timing.computation_time_s,
            },
            Err(failure) => {
                self.wait = failure.wait;
                RallyReadiness::ResetFailed {
                    startup_s,
                    interpolation,
                    reset_s: failure.timing.computation_time_s,
                    fault: failure.fault,
                }
            }
        }
    }

    /// Response of this side to a step.
    pub fn response(&self) -> Response<'_> {
        match (&self.result, &self.session) {
            (Some(Ok(timing)), Some(session)) => Response::Answer {
                action: session.action(),
                timing: *timing,
            },
            (Some(Err(failure)), _) => Response::Fault {
                fault: failure.fault.clone(),
                timing: failure.timing,
            },
            _ => Response::Held,
        }
    }

    /// Is its fault in this rally logged?
    pub const fn is_fault_logged(&self) -> bool {
        self.is_fault_logged
    }

    /// Kills the agent's process after a fault, and logs the fault.
    pub fn end_with_fault(&mut self, fault: &AgentFault) {
        self.is_fault_logged = true;
        if let Some(Err(failure)) = self.result.take() {
            self.wait = failure.wait;
        }
        let stderr = self.session.take().map(Session::abort);
        let message = match self.wait.take() {
            Some(wait) => format!("{fault} ({wait})"),
            None => fault.to_string(),
        };
        self.log.add(&stderr.unwrap_or_default(), Some(&message));
    }

    /// Sends the end of a rally.
    pub fn send_end(&mut self, rally: u32, steps: u32) -> Result<(), PlatformFault> {
        match &mut self.session {
            Some(session) => session.end(rally, steps),
            None => Ok(()),
        }
    }

    /// Sends `bye` to the agent, if it runs, and logs its standard error.
    pub fn finish(&mut self) -> Result<(), PlatformFault> {
        if let Some(session) = self.session.take() {
            let stderr = session.finish()?;
            self.log.add(&stderr, None);
        }
        Ok(())
    }

    /// Kills the agent if it runs. Returns the log of all its processes, and the longest host interference in one
    /// answer in seconds.
    pub fn abort(mut self) -> (String, f64) {
        if let Some(session) = self.session.take() {
            self.log.add(&session.abort(), None);
        }
        (self.log.into_text(), self.max_host_interference_s)
    }
}
