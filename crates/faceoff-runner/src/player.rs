use crate::{
    bundle::Bundle,
    config::AgentEnvironment,
    fault::{PlatformFault, Trouble},
    host_noise::{AnswerWait, host_cost_points},
    host_watch::HostWatch,
    log::Log,
    session::Session,
};
use faceoff_episode::{Arena, Course, Question, StepSink, TimeSum};
use faceoff_types::{AgentFaultKind, EpisodeOutcome, Phase, Task};

/// Plays episodes of one task with one agent, which is restarted after a fault. An episode that the
/// host's stalls cost the agent is played again.
pub(crate) struct Player<'a> {
    bundle: &'a Bundle,
    env: &'a AgentEnvironment,
    task: Task,
    arena: Arena,
    /// None before the first episode and after a fault.
    session: Option<Session>,
    log: Log,
    watch: &'a dyn HostWatch,
    host_noise_reruns: u32,
}

/// One try of an episode.
struct Try {
    outcome: EpisodeOutcome,
    /// Did the host's stalls cost the agent points, or the episode?
    spoilt_by_host: bool,
}

/// The agent's fault, the line that shows it, and what its process has left on standard error.
struct StartUpFault {
    kind: AgentFaultKind,
    line: Option<String>,
    stderr: String,
}

/// An episode under way, wherever it is recorded.
type CourseTo<'a> = Course<&'a mut dyn StepSink>;

impl<'a> Player<'a> {
    /// The agent is started by the first episode.
    pub fn new(
        bundle: &'a Bundle,
        env: &'a AgentEnvironment,
        task: Task,
        arena: Arena,
        watch: &'a dyn HostWatch,
    ) -> Self {
        Self {
            bundle,
            env,
            task,
            arena,
            session: None,
            log: Log::new(env.limits.stderr_tail_bytes),
            watch,
            host_noise_reruns: 0,
        }
    }

    /// Tries that were dropped so far because the host stalled.
    pub const fn host_noise_reruns(&self) -> u32 {
        self.host_noise_reruns
    }

    /// Plays one episode of at most `max_steps` control steps, again while the host spoils it and the
    /// limit of re-runs allows; the last try counts.
    ///
    /// # Errors
    /// The platform's alone; an agent's fault is an outcome. `cancelled` is asked before each step.
    pub fn play(
        &mut self,
        episode: u32,
        max_steps: u32,
        sink: &mut dyn StepSink,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<EpisodeOutcome, PlatformFault> {
        let mut reruns = 0;
        loop {
            let Try {
                outcome,
                spoilt_by_host,
            } = self.attempt(episode, max_steps, sink, cancelled)?;
            if spoilt_by_host && reruns < self.env.time.host_noise_reruns {
                reruns += 1;
                self.host_noise_reruns += 1;
                tracing::warn!(task = %self.task, episode, reruns, "the host stalled: the episode is played again");
                if outcome.fault.is_some() {
                    self.log.add(
                        "",
                        Some("not counted: the host stalled, and the episode is played again"),
                    );
                }
                continue;
            }
            sink.end(&outcome, reruns)?;
            return Ok(outcome);
        }
    }

    fn attempt(
        &mut self,
        episode: u32,
        max_steps: u32,
        sink: &mut dyn StepSink,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<Try, PlatformFault> {
        let session = match self.session.take() {
            Some(session) => Ok(session),
            None => self.start()?,
        };
        let interpolation = session.as_ref().ok().map(Session::interpolation);
        let mut course =
            Course::begin(&self.arena, self.task, episode, interpolation, sink).at_most(max_steps);
        let mut session = match session {
            Ok(session) => session,
            Err(StartUpFault { kind, line, stderr }) => {
                let outcome = course.failed(Phase::StartUp, kind, line);
                self.note(&stderr, &outcome);
                return Ok(Try {
                    outcome,
                    spoilt_by_host: false,
                });
            }
        };
        let mut without_noise = TimeSum::default();
        match self.converse(
            &mut session,
            episode,
            &mut course,
            &mut without_noise,
            cancelled,
        ) {
            Ok(outcome) => {
                self.session = Some(session);
                let (measured, without_noise) = (outcome.computation_time, without_noise.summary());
                Ok(Try {
                    outcome,
                    spoilt_by_host: host_cost_points(&measured, &without_noise),
                })
            }
            Err((_, Trouble::Platform(fault))) => {
                self.session = Some(session);
                Err(fault)
            }
            Err((phase, Trouble::Agent { fault, line })) => {
                let spoilt_by_host =
                    phase == Phase::Step && self.is_kept_from_answering(&session, &fault);
                let outcome = course.failed(phase, fault, line);
                self.note(&session.abort(), &outcome);
                Ok(Try {
                    outcome,
                    spoilt_by_host,
                })
            }
        }
    }

    /// Was it the host's stall that made a step's hard limit pass?
    fn is_kept_from_answering(&self, session: &Session, fault: &AgentFaultKind) -> bool {
        let (AgentFaultKind::TimedOut { limit_s, .. }, Some((asked, until))) =
            (fault, session.waited())
        else {
            return false;
        };
        let wait = AnswerWait {
            wall_s: (until - asked).as_secs_f64(),
            cpu_s: session.cpu_time_since_answer_s(),
            stalled_s: self.watch.stalled_s(asked, until),
        };
        wait.no_answer_is_noise(*limit_s)
    }

    /// Says goodbye to the agent and returns the log of all its processes.
    pub fn close(mut self) -> Result<String, PlatformFault> {
        if let Some(session) = self.session.take() {
            let stderr = session.finish()?;
            self.log.add(&stderr, None);
        }
        Ok(self.log.into_text())
    }

    /// Ends the agent at once and returns the log of all its processes.
    pub fn abort(mut self) -> String {
        if let Some(session) = self.session.take() {
            self.log.add(&session.abort(), None);
        }
        self.log.into_text()
    }

    fn start(&self) -> Result<Result<Session, StartUpFault>, PlatformFault> {
        match Session::start(self.bundle, self.env, self.task.into()) {
            Ok(session) => Ok(Ok(session)),
            Err((Trouble::Platform(fault), _)) => Err(fault),
            Err((Trouble::Agent { fault: kind, line }, stderr)) => {
                Ok(Err(StartUpFault { kind, line, stderr }))
            }
        }
    }

    /// The conversation of one episode; trouble comes with what the agent was asked for.
    fn converse(
        &self,
        session: &mut Session,
        episode: u32,
        course: &mut CourseTo<'_>,
        without_noise: &mut TimeSum,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<EpisodeOutcome, (Phase, Trouble)> {
        session
            .reset(episode)
            .map_err(|trouble| (Phase::Reset, trouble))?;
        self.steps(session, course, without_noise, cancelled)
            .and_then(|outcome| {
                session.end(episode, outcome.steps)?;
                Ok(outcome)
            })
            .map_err(|trouble| (Phase::Step, trouble))
    }

    fn steps(
        &self,
        session: &mut Session,
        course: &mut CourseTo<'_>,
        without_noise: &mut TimeSum,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<EpisodeOutcome, Trouble> {
        loop {
            if cancelled() {
                return Err(PlatformFault::Cancelled.into());
            }
            let Question { step, observation } = course.question()?;
            let answered = session.step(step, observation)?;
            let wall_s = answered.computation_time_s;
            without_noise.add(match session.waited() {
                Some((asked, until)) if AnswerWait::is_late(wall_s) => AnswerWait {
                    wall_s,
                    cpu_s: answered.cpu_time_s,
                    stalled_s: self.watch.stalled_s(asked, until),
                }
                .without_noise_s(),
                _ => wall_s,
            });
            if let Some(outcome) = course.answer(session.action(), answered)? {
                return Ok(outcome);
            }
        }
    }

    /// Notes what an agent has left, and the fault that ended it.
    fn note(&mut self, stderr: &str, outcome: &EpisodeOutcome) {
        let fault = outcome.fault.as_ref().map(ToString::to_string);
        self.log.add(stderr, fault.as_deref());
    }
}
