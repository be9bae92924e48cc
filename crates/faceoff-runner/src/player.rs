//! Runs the episodes of one task with one agent, and repeats an episode that *host interference* (other load on the
//! machine) ended.

use crate::{
    bundle::Bundle,
    config::AgentEnvironment,
    fault::{PlatformFault, SessionError},
    host_interference::InterferenceMonitor,
    log::Log,
    session::Session,
    time_budget::{EpisodeBudget, ResetBudget},
    wait_breakdown::WaitBreakdown,
};
use faceoff_episode::{ActionRequest, RunningEpisode, StepSink, WorldFactory};
use faceoff_types::{AgentFaultKind, EpisodeOutcome, Phase, Task};
use std::time::Instant;

/// Runs episodes of one task with one agent, which is restarted after a fault. An episode that host interference
/// ended is run again by a new process, which knows nothing of the first try.
pub(crate) struct Player<'a> {
    bundle: &'a Bundle,
    env: &'a AgentEnvironment,
    task: Task,
    world_factory: &'a dyn WorldFactory,
    /// `None` before the first episode and after a fault.
    session: Option<Session<'a>>,
    log: Log,
    reset_budget: ResetBudget,
    monitor: &'a dyn InterferenceMonitor,
    reruns: Reruns,
    /// Longest host interference in one answer, in seconds.
    max_host_interference_s: f64,
    /// The wait whose timeout ended the last episode.
    last_wait: Option<WaitBreakdown>,
    on_host_interference: OnHostInterference,
}

/// Handling of an episode that host interference ends in all allowed tries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum OnHostInterference {
    /// The last try counts, as the rules say.
    KeepLastTry,
    /// It is a platform fault, after which the whole run is repeated later.
    PlatformFault,
}

/// Counts *reruns*: tries that were dropped and repeated because of host interference.
struct Reruns {
    count: u32,
    /// Maximum in total.
    limit: u32,
    /// Maximum per episode.
    per_episode: u32,
}

/// One try of an episode.
struct Try {
    outcome: EpisodeOutcome,
    blame: Blame,
}

/// To whom the end of a try is attributed.
#[derive(Debug, Clone, Copy)]
enum Blame {
    /// The agent's answers: an ordinary end of the episode, or a fault other than a timeout.
    Agent,
    /// A timeout of the agent.
    AgentTimeout(WaitBreakdown),
    /// Host interference prevented the answer.
    Host(WaitBreakdown),
}

/// A fault that ended a try, with the offending line.
struct TryFault {
    fault: AgentFaultKind,
    line: Option<String>,
    blame: Blame,
}

impl TryFault {
    /// Separates agent faults from platform faults.
    fn new(error: SessionError) -> Result<Self, PlatformFault> {
        let (fault, line, blame) = match error {
            SessionError::Platform(fault) => return Err(fault),
            SessionError::Agent { fault, line } => (fault, line, Blame::Agent),
            SessionError::TimedOut { fault, wait } => (fault, None, Blame::AgentTimeout(*wait)),
            SessionError::HostInterference { fault, wait } => (fault, None, Blame::Host(*wait)),
        };
        Ok(Self { fault, line, blame })
    }
}

/// A fault at the start of a process, and its standard error.
struct StartUpFault {
    fault: TryFault,
    stderr: String,
}

/// A running episode with a sink of any type.
type DynEpisode<'a> = RunningEpisode<&'a mut dyn StepSink>;

impl<'a> Player<'a> {
    /// The first episode starts the agent. `episodes` determines how many tries may be repeated because of host
    /// interference, and the total time for resets.
    pub fn new(
        bundle: &'a Bundle,
        env: &'a AgentEnvironment,
        task: Task,
        episodes: u32,
        world_factory: &'a dyn WorldFactory,
        monitor: &'a dyn InterferenceMonitor,
        on_host_interference: OnHostInterference,
    ) -> Self {
        Self {
            bundle,
            env,
            task,
            world_factory,
            session: None,
            log: Log::new(env.limits.stderr_kept_bytes),
            reset_budget: ResetBudget::new(&env.time, episodes),
            monitor,
            reruns: Reruns {
                count: 0,
                limit: env.time.max_host_interference_reruns(episodes),
                per_episode: env.time.host_interference_reruns,
            },
            max_host_interference_s: 0.0,
            last_wait: None,
            on_host_interference,
        }
    }

    /// The wait for the missing answer, if a timeout ended the last episode.
    pub const fn last_wait(&self) -> Option<WaitBreakdown> {
        self.last_wait
    }

    /// Number of tries dropped so far because of host interference.
    pub const fn host_interference_reruns(&self) -> u32 {
        self.reruns.count
    }

    /// Longest host interference in one answer, in seconds.
    pub const fn max_host_interference_s(&self) -> f64 {
        self.max_host_interference_s
    }

    /// Runs one episode of at most `max_steps` control steps. Repeats it while host interference ends it and the limits
    /// of reruns allow it; the last try counts. `cancelled` is called before each reset and each step, when the agent has
    /// answered `hello`.
    ///
    /// # Errors
    /// Platform faults only; an agent fault is an outcome.
    pub fn play(
        &mut self,
        episode: u32,
        max_steps: u32,
        sink: &mut dyn StepSink,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<EpisodeOutcome, PlatformFault> {
        let mut episode_reruns = 0;
        loop {
            let Try { outcome, blame } = self.run_try(episode, max_steps, sink, cancelled)?;
            self.last_wait = match blame {
                Blame::Agent => None,
                Blame::AgentTimeout(wait) | Blame::Host(wait) => Some(wait),
            };
            if let Blame::Host(wait) = blame {
                let total = &mut self.reruns;
                if episode_reruns < total.per_episode && total.count < total.limit {
                    episode_reruns += 1;
                    total.count += 1;
                    tracing::warn!(
                        task = %self.task,
                        episode,
                        reruns = episode_reruns,
                        %wait,
                        "host interference prevented an answer: the episode is run again"
                    );
                    let note = "not counted: host interference prevented the answer; the episode is run again, by a \
                                new process";
                    self.log.add("", Some(note));
                    continue;
                }
                if self.on_host_interference == OnHostInterference::PlatformFault {
                    return Err(PlatformFault::HostBusy(wait));
                }
            }
            sink.end(&outcome, episode_reruns)?;
            return Ok(outcome);
        }
    }

    /// Runs one try of an episode, and starts the agent if it is not running.
    fn run_try(
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
        let layout = session.as_ref().ok().map(Session::layout);
        let mut running =
            RunningEpisode::begin(self.world_factory, self.task, episode, layout, sink)?
                .with_max_steps(max_steps);
        let mut session = match session {
            Ok(session) => session,
            Err(StartUpFault { fault, stderr }) => {
                return Ok(self.end_with_fault(running, Phase::StartUp, fault, &stderr));
            }
        };
        let (phase, error) = match self.run_episode(&mut session, episode, &mut running, cancelled)
        {
            Ok(outcome) => {
                self.session = Some(session);
                return Ok(Try {
                    outcome,
                    blame: Blame::Agent,
                });
            }
            Err(failure) => failure,
        };
        match TryFault::new(error) {
            Ok(fault) => Ok(self.end_with_fault(running, phase, fault, &session.abort())),
            Err(fault) => {
                self.session = Some(session);
                Err(fault)
            }
        }
    }

    /// Ends the episode with a fault, and logs it.
    fn end_with_fault(
        &mut self,
        running: DynEpisode<'_>,
        phase: Phase,
        fault: TryFault,
        stderr: &str,
    ) -> Try {
        let TryFault { fault, line, blame } = fault;
        let outcome = running.outcome_after_fault(phase, fault, line);
        self.log_fault(stderr, &outcome, blame);
        Try { outcome, blame }
    }

    /// Sends `bye` to the agent and returns the log of all its processes.
    pub fn finish(mut self) -> Result<String, PlatformFault> {
        if let Some(session) = self.session.take() {
            let stderr = session.finish()?;
            self.log.add(&stderr, None);
        }
        Ok(self.log.into_text())
    }

    /// Kills the agent and returns the log of all its processes.
    pub fn abort(mut self) -> String {
        if let Some(session) = self.session.take() {
            self.log.add(&session.abort(), None);
        }
        self.log.into_text()
    }

    /// Starts the agent; the inner error is an agent fault.
    fn start(&self) -> Result<Result<Session<'a>, StartUpFault>, PlatformFault> {
        let started =
            Session::start_monitored(self.bundle, self.env, self.task.into(), self.monitor);
        match started {
            Ok(session) => Ok(Ok(session)),
            Err((error, stderr)) => {
                let fault = TryFault::new(error)?;
                Ok(Err(StartUpFault { fault, stderr }))
            }
        }
    }

    /// Runs one episode's messages with the agent; an error comes with the phase in which it happened.
    fn run_episode(
        &mut self,
        session: &mut Session<'_>,
        episode: u32,
        running: &mut DynEpisode<'_>,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<EpisodeOutcome, (Phase, SessionError)> {
        if cancelled() {
            return Err((Phase::Reset, PlatformFault::Cancelled.into()));
        }
        self.reset(session, episode)
            .map_err(|error| (Phase::Reset, error))?;
        self.play_steps(session, running, cancelled)
            .and_then(|outcome| {
                session.end(episode, outcome.steps)?;
                Ok(outcome)
            })
            .map_err(|error| (Phase::Step, error))
    }

    /// Announces an episode. The time until the answer, without host interference, counts towards the budget, even if
    /// no answer comes.
    fn reset(&mut self, session: &mut Session<'_>, episode: u32) -> Result<(), SessionError> {
        self.reset_budget.check()?;
        let asked_at = Instant::now();
        let timing = session.reset(episode);
        self.reset_budget.spend(match &timing {
            Ok(timing) => timing.computation_time_s,
            Err(
                SessionError::TimedOut { wait, .. } | SessionError::HostInterference { wait, .. },
            ) => wait.agent_time().as_secs_f64(),
            Err(SessionError::Agent { .. } | SessionError::Platform(_)) => {
                asked_at.elapsed().as_secs_f64()
            }
        });
        timing?;
        Ok(self.reset_budget.check()?)
    }

    /// Plays the control steps of an episode until its end.
    fn play_steps(
        &mut self,
        session: &mut Session<'_>,
        running: &mut DynEpisode<'_>,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<EpisodeOutcome, SessionError> {
        let mut budget = EpisodeBudget::new(
            &self.env.time,
            self.env.simulator.competition().duration_s(self.task, 1),
        );
        loop {
            if cancelled() {
                return Err(PlatformFault::Cancelled.into());
            }
            let ActionRequest { step, observation } = running.action_request()?;
            let timing = session.step(step, observation)?;
            self.max_host_interference_s = self.max_host_interference_s.max(timing.host_time_s);
            if let Some(outcome) = running.answer(session.action(), timing)? {
                return Ok(outcome);
            }
            budget.spend(timing.computation_time_s)?;
        }
    }

    /// Logs an agent's standard error, and the fault that ended it.
    fn log_fault(&mut self, stderr: &str, outcome: &EpisodeOutcome, blame: Blame) {
        let fault = outcome.fault.as_ref().map(|fault| match blame {
            Blame::Agent => fault.to_string(),
            Blame::AgentTimeout(wait) | Blame::Host(wait) => format!("{fault} ({wait})"),
        });
        self.log.add(stderr, fault.as_deref());
    }
}
