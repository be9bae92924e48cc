use crate::{
    bundle::Bundle,
    config::AgentEnvironment,
    fault::{PlatformFault, Trouble},
    host_watch::HostWatch,
    log::Log,
    session::Session,
    waited::Waited,
};
use faceoff_episode::{Answered, Entry, Response, SideFault};
use faceoff_types::{AgentFault, Contest, Side, TimeLimits};
use std::time::{Duration, Instant};

/// One side of a game: its agent's process, which is started anew after a fault, and what is asked of it.
pub(super) struct SidePlayer<'a> {
    side: Side,
    bundle: &'a Bundle,
    env: &'a AgentEnvironment,
    /// With the time that a restart may take.
    restart_env: AgentEnvironment,
    watch: &'a dyn HostWatch,
    /// None before its first rally and after a fault.
    session: Option<Session<'a>>,
    was_started: bool,
    /// Its fault in this rally is in the log.
    is_noted: bool,
    asked: Instant,
    /// What came of the last question; `None` while its answer is due, or if there was none.
    came: Option<Result<Answered, Broken>>,
    /// Whose time it was that ended it last, if it ended by an answer that did not come.
    waited: Option<Waited>,
    log: Log,
    longest_stall_s: f64,
}

/// A side broke the protocol or a limit.
pub(super) struct Broken {
    fault: SideFault,
    /// For how long it was waited for.
    answered: Answered,
    waited: Option<Waited>,
}

/// What came of a start, if one was needed.
pub(super) enum Started {
    Ready { startup_s: Option<f64> },
    Failed { startup_s: f64, fault: SideFault },
}

impl Broken {
    /// What is not the platform's; an answer that the host kept from coming is: the game is played again.
    fn by(trouble: Trouble, asked: Instant) -> Result<Self, PlatformFault> {
        let broken = |kind, line, waited: Option<Waited>| Self {
            fault: SideFault { kind, line },
            answered: match &waited {
                Some(waited) => Answered {
                    computation_time_s: waited.of_the_agent().as_secs_f64(),
                    host_time_s: waited.host.as_secs_f64(),
                    cpu_time_s: waited.cpu_time_s,
                },
                None => Answered {
                    computation_time_s: asked.elapsed().as_secs_f64(),
                    host_time_s: 0.0,
                    cpu_time_s: None,
                },
            },
            waited,
        };
        match trouble {
            Trouble::Agent { fault, line } => Ok(broken(fault, line, None)),
            Trouble::Late { fault, waited } => Ok(broken(fault, None, Some(*waited))),
            Trouble::Host { waited, .. } => Err(PlatformFault::HostBusy(*waited)),
            Trouble::Platform(fault) => Err(fault),
        }
    }
}

impl<'a> SidePlayer<'a> {
    pub fn new(
        side: Side,
        bundle: &'a Bundle,
        env: &'a AgentEnvironment,
        restart_s: f64,
        watch: &'a dyn HostWatch,
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
            watch,
            session: None,
            was_started: false,
            is_noted: false,
            asked: Instant::now(),
            came: None,
            waited: None,
            log: Log::new(env.limits.stderr_tail_bytes),
            longest_stall_s: 0.0,
        }
    }

    /// Starts the agent, if it is not running.
    pub fn start(&mut self) -> Result<Started, PlatformFault> {
        self.is_noted = false;
        if self.session.is_some() {
            return Ok(Started::Ready { startup_s: None });
        }
        let env = if self.was_started {
            &self.restart_env
        } else {
            self.env
        };
        self.was_started = true;
        self.came = None;
        let begun = Instant::now();
        let contest = Contest::Game { side: self.side };
        match Session::start_watched(self.bundle, env, contest, self.watch) {
            Ok(session) => {
                let startup_s = Some(session.startup_s());
                self.session = Some(session);
                Ok(Started::Ready { startup_s })
            }
            Err((trouble, stderr)) => {
                let broken = Broken::by(trouble, begun)?;
                self.log.add(&stderr, None);
                self.waited = broken.waited;
                Ok(Started::Failed {
                    startup_s: broken.answered.computation_time_s,
                    fault: broken.fault,
                })
            }
        }
    }

    /// Asks something; what is known of it at once is kept.
    pub fn ask(
        &mut self,
        question: impl FnOnce(&mut Session<'_>) -> Result<(), Trouble>,
    ) -> Result<(), PlatformFault> {
        self.asked = Instant::now();
        self.came = None;
        let Some(session) = &mut self.session else {
            return Ok(());
        };
        if let Err(trouble) = question(session) {
            self.came = Some(Err(Broken::by(trouble, self.asked)?));
        }
        Ok(())
    }

    /// The conversation, while an answer is due.
    pub fn due(&self) -> Option<&Session<'a>> {
        self.session
            .as_ref()
            .filter(|session| self.came.is_none() && session.is_asked())
    }

    /// Looks for the answer that is due, at most until `until`.
    pub fn look(&mut self, until: Instant) -> Result<(), PlatformFault> {
        let Some(session) = &mut self.session else {
            return Ok(());
        };
        match session.poll(until) {
            Ok(None) => {}
            Ok(Some(answered)) => {
                self.longest_stall_s = self.longest_stall_s.max(answered.host_time_s);
                self.came = Some(Ok(answered));
            }
            Err(trouble) => self.came = Some(Err(Broken::by(trouble, self.asked)?)),
        }
        Ok(())
    }

    /// Stops the agent, if it runs and no answer of it is due, until it is asked again.
    pub fn freeze(&mut self) {
        if self.due().is_none()
            && let Some(session) = &mut self.session
        {
            session.freeze();
        }
    }

    /// Can the agent be stopped, if it runs?
    pub fn can_freeze(&self) -> bool {
        self.session.as_ref().is_none_or(Session::can_freeze)
    }

    /// Something of ours was seen to meanwhile.
    pub fn was_not_looked_at(&mut self, away: Duration) {
        if let Some(session) = &mut self.session {
            session.was_not_looked_at(away);
        }
    }

    /// What came of getting ready, of which the reset was the last question.
    pub fn entry(&mut self, started: Started) -> Entry {
        let startup_s = match started {
            Started::Ready { startup_s } => startup_s,
            Started::Failed { startup_s, fault } => {
                return Entry::FailedToStart { startup_s, fault };
            }
        };
        let interpolation = self
            .session
            .as_ref()
            .map(Session::interpolation)
            .expect("an agent that is ready runs");
        match self.came.take().expect("its reset was waited for") {
            Ok(answered) => Entry::Plays {
                startup_s,
                interpolation,
                reset_s: answered.computation_time_s,
            },
            Err(broken) => {
                self.waited = broken.waited;
                Entry::FailedToReset {
                    startup_s,
                    interpolation,
                    reset_s: broken.answered.computation_time_s,
                    fault: broken.fault,
                }
            }
        }
    }

    /// What came of a step.
    pub fn response(&self) -> Response<'_> {
        match (&self.came, &self.session) {
            (Some(Ok(answered)), Some(session)) => Response::Answer {
                action: session.action(),
                answered: *answered,
            },
            (Some(Err(broken)), _) => Response::Fault {
                fault: broken.fault.clone(),
                answered: broken.answered,
            },
            _ => Response::Held,
        }
    }

    /// Was its fault in this rally noted?
    pub const fn is_noted(&self) -> bool {
        self.is_noted
    }

    /// Ends the agent's process after a fault, and notes it.
    pub fn end_by(&mut self, fault: &AgentFault) {
        self.is_noted = true;
        if let Some(Err(broken)) = self.came.take() {
            self.waited = broken.waited;
        }
        let stderr = self.session.take().map(Session::abort);
        let told = match self.waited.take() {
            Some(waited) => format!("{fault} ({waited})"),
            None => fault.to_string(),
        };
        self.log.add(&stderr.unwrap_or_default(), Some(&told));
    }

    /// Tells that a rally is over.
    pub fn tell_end(&mut self, rally: u32, steps: u32) -> Result<(), PlatformFault> {
        match &mut self.session {
            Some(session) => session.end(rally, steps),
            None => Ok(()),
        }
    }

    pub fn finish(&mut self) -> Result<(), PlatformFault> {
        if let Some(session) = self.session.take() {
            let stderr = session.finish()?;
            self.log.add(&stderr, None);
        }
        Ok(())
    }

    /// Ends the agent, if it runs, and tells the log of all its processes and the most that the host took of
    /// one answer, in seconds.
    pub fn close(mut self) -> (String, f64) {
        if let Some(session) = self.session.take() {
            self.log.add(&session.abort(), None);
        }
        (self.log.into_text(), self.longest_stall_s)
    }
}
