use crate::{
    budget::{EpisodeBudget, ResetBudget},
    bundle::Bundle,
    config::AgentEnvironment,
    fault::{PlatformFault, Trouble},
    host_watch::HostWatch,
    log::Log,
    session::Session,
    waited::Waited,
};
use faceoff_episode::{Arena, Course, Question, StepSink};
use faceoff_types::{AgentFaultKind, EpisodeOutcome, Phase, Task};
use std::time::Instant;

/// Plays episodes of one task with one agent, which is restarted after a fault. An episode that the
/// host ended is played again, by a new process, which knows nothing of the first try.
pub(crate) struct Player<'a> {
    bundle: &'a Bundle,
    env: &'a AgentEnvironment,
    task: Task,
    arena: Arena,
    /// None before the first episode and after a fault.
    session: Option<Session<'a>>,
    log: Log,
    resets: ResetBudget,
    watch: &'a dyn HostWatch,
    replays: Replays,
    /// The most that the host took of one answer, in seconds.
    longest_stall_s: f64,
    /// Of the last episode: whose time it was that ended it.
    waited: Option<Waited>,
    if_the_host_wins: IfTheHostWins,
}

/// What becomes of an episode that the host ends again and again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum IfTheHostWins {
    /// The last try counts (RULES).
    LastTryCounts,
    /// It is a fault of ours: all is to be begun anew, later.
    OurFault,
}

/// Tries that were dropped and played again because the host kept the agent from answering.
struct Replays {
    played: u32,
    /// At most so many.
    limit: u32,
    /// At most so many of one episode.
    per_episode: u32,
}

/// One try of an episode.
struct Try {
    outcome: EpisodeOutcome,
    blame: Blame,
}

/// Whose doing is the end of a try?
#[derive(Debug, Clone, Copy)]
enum Blame {
    /// The agent's: by its answers.
    Agent,
    /// The agent's: by one that did not come.
    AgentsDelay(Waited),
    /// The host kept the agent from answering.
    Host(Waited),
}

/// A fault, and the line that shows it.
struct Ended {
    fault: AgentFaultKind,
    line: Option<String>,
    blame: Blame,
}

impl Ended {
    /// What is not the platform's.
    fn by(trouble: Trouble) -> Result<Self, PlatformFault> {
        let (fault, line, blame) = match trouble {
            Trouble::Platform(fault) => return Err(fault),
            Trouble::Agent { fault, line } => (fault, line, Blame::Agent),
            Trouble::Late { fault, waited } => (fault, None, Blame::AgentsDelay(*waited)),
            Trouble::Host { fault, waited } => (fault, None, Blame::Host(*waited)),
        };
        Ok(Self { fault, line, blame })
    }
}

/// What ended a process at its start, and what it has left on standard error.
struct StartUpFault {
    ended: Ended,
    stderr: String,
}

/// An episode under way, wherever it is recorded.
type CourseTo<'a> = Course<&'a mut dyn StepSink>;

impl<'a> Player<'a> {
    /// The agent is started by the first episode. Of so many `episodes` a part may be played again for
    /// the host's sake, and they bound the time of all resets.
    pub fn new(
        bundle: &'a Bundle,
        env: &'a AgentEnvironment,
        task: Task,
        episodes: u32,
        arena: Arena,
        watch: &'a dyn HostWatch,
        if_the_host_wins: IfTheHostWins,
    ) -> Self {
        Self {
            bundle,
            env,
            task,
            arena,
            session: None,
            log: Log::new(env.limits.stderr_tail_bytes),
            resets: ResetBudget::new(&env.time, episodes),
            watch,
            replays: Replays {
                played: 0,
                limit: env.time.host_noise_reruns_of(episodes),
                per_episode: env.time.host_noise_reruns,
            },
            longest_stall_s: 0.0,
            waited: None,
            if_the_host_wins,
        }
    }

    /// Whose time it was that ended the last episode, if that ended by an answer that did not come.
    pub const fn waited(&self) -> Option<Waited> {
        self.waited
    }

    /// Tries that were dropped so far because the host kept the agent from answering.
    pub const fn host_noise_reruns(&self) -> u32 {
        self.replays.played
    }

    /// The most that the host took of one answer, in seconds.
    pub const fn longest_stall_s(&self) -> f64 {
        self.longest_stall_s
    }

    /// Plays one episode of at most `max_steps` control steps, again while the host ends it and the
    /// limits of re-runs allow; the last try counts.
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
            let Try { outcome, blame } = self.attempt(episode, max_steps, sink, cancelled)?;
            self.waited = match blame {
                Blame::Agent => None,
                Blame::AgentsDelay(waited) | Blame::Host(waited) => Some(waited),
            };
            if let Blame::Host(waited) = blame {
                let replays = &mut self.replays;
                if reruns < replays.per_episode && replays.played < replays.limit {
                    reruns += 1;
                    replays.played += 1;
                    tracing::warn!(task = %self.task, episode, reruns, %waited, "the host kept the agent from answering: the episode is played again");
                    self.log.add(
                        "",
                        Some("not counted: the host kept the agent from answering; the episode is played again, by a new process"),
                    );
                    continue;
                }
                if self.if_the_host_wins == IfTheHostWins::OurFault {
                    return Err(PlatformFault::HostBusy(waited));
                }
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
            Err(StartUpFault { ended, stderr }) => {
                return Ok(self.failed(course, Phase::StartUp, ended, &stderr));
            }
        };
        let (phase, trouble) = match self.converse(&mut session, episode, &mut course, cancelled) {
            Ok(outcome) => {
                self.session = Some(session);
                return Ok(Try {
                    outcome,
                    blame: Blame::Agent,
                });
            }
            Err(ended) => ended,
        };
        match Ended::by(trouble) {
            Ok(ended) => Ok(self.failed(course, phase, ended, &session.abort())),
            Err(fault) => {
                self.session = Some(session);
                Err(fault)
            }
        }
    }

    fn failed(&mut self, course: CourseTo<'_>, phase: Phase, ended: Ended, stderr: &str) -> Try {
        let Ended { fault, line, blame } = ended;
        let outcome = course.failed(phase, fault, line);
        self.note(stderr, &outcome, blame);
        Try { outcome, blame }
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

    fn start(&self) -> Result<Result<Session<'a>, StartUpFault>, PlatformFault> {
        let started = Session::start_watched(self.bundle, self.env, self.task.into(), self.watch);
        match started {
            Ok(session) => Ok(Ok(session)),
            Err((trouble, stderr)) => {
                let ended = Ended::by(trouble)?;
                Ok(Err(StartUpFault { ended, stderr }))
            }
        }
    }

    /// The conversation of one episode; trouble comes with what the agent was asked for.
    fn converse(
        &mut self,
        session: &mut Session<'_>,
        episode: u32,
        course: &mut CourseTo<'_>,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<EpisodeOutcome, (Phase, Trouble)> {
        self.reset(session, episode)
            .map_err(|trouble| (Phase::Reset, trouble))?;
        self.steps(session, course, cancelled)
            .and_then(|outcome| {
                session.end(episode, outcome.steps)?;
                Ok(outcome)
            })
            .map_err(|trouble| (Phase::Step, trouble))
    }

    /// Announces an episode; the wait for the answer, less what the host took, counts also if none came.
    fn reset(&mut self, session: &mut Session<'_>, episode: u32) -> Result<(), Trouble> {
        self.resets.check()?;
        let asked = Instant::now();
        let answered = session.reset(episode);
        self.resets.spend(match &answered {
            Ok(answered) => answered.computation_time_s,
            Err(Trouble::Late { waited, .. } | Trouble::Host { waited, .. }) => {
                waited.of_the_agent().as_secs_f64()
            }
            Err(Trouble::Agent { .. } | Trouble::Platform(_)) => asked.elapsed().as_secs_f64(),
        });
        answered?;
        Ok(self.resets.check()?)
    }

    fn steps(
        &mut self,
        session: &mut Session<'_>,
        course: &mut CourseTo<'_>,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<EpisodeOutcome, Trouble> {
        let mut budget = EpisodeBudget::new(&self.env.time);
        loop {
            if cancelled() {
                return Err(PlatformFault::Cancelled.into());
            }
            let Question { step, observation } = course.question()?;
            let answered = session.step(step, observation)?;
            self.longest_stall_s = self.longest_stall_s.max(answered.host_time_s);
            if let Some(outcome) = course.answer(session.action(), answered)? {
                return Ok(outcome);
            }
            budget.spend(answered.computation_time_s)?;
        }
    }

    /// Notes what an agent has left, and the fault that ended it.
    fn note(&mut self, stderr: &str, outcome: &EpisodeOutcome, blame: Blame) {
        let fault = outcome.fault.as_ref().map(|fault| match blame {
            Blame::Agent => fault.to_string(),
            Blame::AgentsDelay(waited) | Blame::Host(waited) => format!("{fault} ({waited})"),
        });
        self.log.add(stderr, fault.as_deref());
    }
}
