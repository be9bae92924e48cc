//! An *episode*: one attempt of an agent at a task, control step by control step.

use crate::{
    record::{AnswerTiming, EpisodeStart, StepRow, StepSink},
    time_sum::TimeSum,
    world::{World, WorldFactory},
};
use faceoff_types::{
    ActionLayout, AgentFault, AgentFaultKind, AgentTask, EpisodeEnd, EpisodeOutcome, Phase, Task,
    UnknownTask,
};
use std::fmt;

/// A running episode. It provides the observations for the agent, takes its answers and computes their effects. The caller
/// provides the answers, from a process, a recording or a function:
///
/// ```
/// # use faceoff_airhockey::{SimulationSetup};
/// # use faceoff_episode::{AnswerTiming, RunningEpisode, NullSink};
/// # use faceoff_sim::AirHockeyProfile;
/// # use faceoff_airhockey::Interpolation;
/// # use faceoff_types::{Phase, Seed, Task};
/// # let hit = Task::new("hit");
/// # let seed = Seed::from_number(1);
/// let setup = SimulationSetup::new(AirHockeyProfile::Ideal, seed, seed.model_mismatch());
/// let mut running = RunningEpisode::begin(&setup, hit, 0, Some(Interpolation::Linear.into()), NullSink)?;
/// let outcome = loop {
///     let joint_positions = running.action_request()?.observation[6..13].to_vec();
///     let timing = AnswerTiming {
///         computation_time_s: 0.001,
///         host_time_s: 0.0,
///         cpu_time_s: None,
///     };
///     match running.answer(&joint_positions, timing) {
///         Ok(None) => {}
///         Ok(Some(outcome)) => break outcome,
///         Err(fault) => break running.outcome_after_fault(Phase::Step, fault, None),
///     }
/// };
/// assert!(outcome.steps <= 500);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// The sink receives the start of the episode and each step. The caller reports the end to the sink, unless the try does not count
/// and is repeated.
pub struct RunningEpisode<S> {
    task: Task,
    episode: u32,
    max_steps: u32,
    world: Box<dyn World>,
    times: TimeSum,
    end: Option<EpisodeEnd>,
    /// The fault, if the last answer made the world diverge.
    diverged: Option<AgentFaultKind>,
    sink: S,
}

impl<S: fmt::Debug> fmt::Debug for RunningEpisode<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RunningEpisode")
            .field("task", &self.task)
            .field("episode", &self.episode)
            .field("steps", &self.world.steps())
            .field("end", &self.end)
            .field("sink", &self.sink)
            .finish_non_exhaustive()
    }
}

/// The next observation, which the agent has to answer with an action.
#[derive(Debug, Clone, Copy)]
pub struct ActionRequest<'a> {
    /// The control step, from 0.
    pub step: u32,
    /// Finite numbers; in air hockey 23 with an opponent on the table, 20 without.
    pub observation: &'a [f64],
}

/// The initial observation is not finite. It is not sent to an agent: JSON would have null, and the agent's reaction would
/// count as its fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the simulator's first observation of {agent_task}, episode {episode} is not finite")]
pub struct NonFiniteObservation {
    /// The task of the agent.
    pub agent_task: AgentTask,
    /// Index within the evaluation; in a game, number of the rally.
    pub episode: u32,
}

impl<S: StepSink> RunningEpisode<S> {
    /// Starts an episode. `layout` is that of the agent's actions, `None` if the agent failed before it stated one; then only its fault can follow. The
    /// initial state, which is the same for all agents, is recorded nevertheless.
    ///
    /// # Errors
    /// If the factory has no such task.
    pub fn begin(
        world_factory: &dyn WorldFactory,
        task: Task,
        episode: u32,
        layout: Option<ActionLayout>,
        mut sink: S,
    ) -> Result<Self, UnknownTask> {
        let world = world_factory.reset(task, episode, layout)?;
        sink.begin(EpisodeStart {
            episode,
            seed: world_factory.seed(task, episode),
            layout,
            world: world.as_ref(),
        });
        Ok(Self {
            task,
            episode,
            max_steps: world_factory.max_steps(task),
            world,
            times: TimeSum::default(),
            end: None,
            diverged: None,
            sink,
        })
    }

    /// Ends the episode after `max_steps` control steps, if that is before the task's horizon.
    #[must_use]
    pub fn with_max_steps(self, max_steps: u32) -> Self {
        Self { max_steps, ..self }
    }

    /// The next observation for the agent.
    ///
    /// # Errors
    /// If the simulator failed, which is neither an end of the episode nor an agent fault.
    pub fn action_request(&self) -> Result<ActionRequest<'_>, NonFiniteObservation> {
        let (step, observation) = (self.world.steps(), self.world.observation());
        // Later observations are finite, since a diverging world ends the episode.
        if step == 0 && !are_finite(observation) {
            return Err(NonFiniteObservation {
                agent_task: AgentTask::Episodes(self.task),
                episode: self.episode,
            });
        }
        Ok(ActionRequest { step, observation })
    }

    /// Simulates one control step. `action` is row-major, finite, and has the length of the agent's layout. Returns the outcome
    /// at the end of the episode, after which this must not be called again.
    ///
    /// # Errors
    /// If the action made the world diverge: an agent fault, which ends the episode. The sink receives the step as any other,
    /// so that a replay of the answers ends in the same way.
    pub fn answer(
        &mut self,
        action: &[f64],
        timing: AnswerTiming,
    ) -> Result<Option<EpisodeOutcome>, AgentFaultKind> {
        debug_assert_eq!(self.end, None, "the episode has ended");
        let step = self.world.steps();
        self.sink.observe(self.world.observation());
        let end = self.world.step(action);
        self.times.add(timing.computation_time_s);
        self.sink.step(&StepRow {
            step,
            action,
            timing,
            next_observation: self.world.observation(),
            world: self.world.as_ref(),
        });
        let detail = match self.world.divergence() {
            Some(cause) => Some(cause),
            None if !are_finite(self.world.observation()) => {
                Some("an observation is not finite".to_owned())
            }
            None => None,
        };
        if let Some(detail) = detail {
            self.end = Some(EpisodeEnd::AGENT_FAULT);
            let fault = AgentFaultKind::Diverged { detail };
            self.diverged = Some(fault.clone());
            return Err(fault);
        }
        let horizon = (self.steps() >= self.max_steps).then_some(EpisodeEnd::HORIZON);
        self.end = end.or(horizon);
        Ok(self.end.map(|end| self.outcome(end, None)))
    }

    /// The outcome after an agent fault in `phase`.
    pub fn outcome_after_fault(
        &self,
        phase: Phase,
        fault: AgentFaultKind,
        line: Option<String>,
    ) -> EpisodeOutcome {
        let fault = AgentFault {
            fault,
            agent_task: AgentTask::Episodes(self.task),
            episode: (phase != Phase::StartUp).then_some(self.episode),
            step: (phase == Phase::Step).then(|| self.faulty_step()),
            line,
        };
        self.outcome(EpisodeEnd::AGENT_FAULT, Some(fault))
    }

    /// The outcome after a fault from another source, such as a recording. `None` if it cannot be a fault of this episode
    /// after the steps simulated so far.
    pub fn outcome_after_recorded_fault(&self, fault: AgentFault) -> Option<EpisodeOutcome> {
        let AgentFault {
            agent_task,
            episode,
            step,
            ..
        } = fault;
        let is_consistent = match (episode, step) {
            (Some(episode), Some(step)) => episode == self.episode && step == self.faulty_step(),
            (Some(episode), None) => episode == self.episode && self.steps() == 0,
            (None, None) => self.steps() == 0,
            (None, Some(_)) => false,
        };
        // Divergence is known from the simulation, so the fault must agree with it.
        let agrees = match &self.diverged {
            Some(diverged) => fault.fault == *diverged,
            None => self.end.is_none() && !matches!(fault.fault, AgentFaultKind::Diverged { .. }),
        };
        let is_possible = agrees && agent_task == AgentTask::Episodes(self.task) && is_consistent;
        is_possible.then(|| self.outcome(EpisodeEnd::AGENT_FAULT, Some(fault)))
    }

    /// The step of a fault: the one that waits for its answer, or the one whose action made the world diverge.
    fn faulty_step(&self) -> u32 {
        self.steps() - u32::from(self.diverged.is_some())
    }

    /// How the episode ended; `None` while it is running, and after a fault that the caller detected.
    pub const fn end(&self) -> Option<EpisodeEnd> {
        self.end
    }

    /// The fault, if the last answer made the world diverge.
    pub const fn diverged(&self) -> Option<&AgentFaultKind> {
        self.diverged.as_ref()
    }

    pub fn steps(&self) -> u32 {
        self.world.steps()
    }

    /// The sink of the episode.
    pub const fn sink(&mut self) -> &mut S {
        &mut self.sink
    }

    fn outcome(&self, end: EpisodeEnd, fault: Option<AgentFault>) -> EpisodeOutcome {
        EpisodeOutcome {
            task: self.task,
            episode: self.episode,
            steps: self.steps(),
            end,
            success: fault.is_none() && self.world.success(),
            violations: self.world.violations(),
            computation_time: self.times.summary(),
            fault,
        }
    }
}

fn are_finite(observation: &[f64]) -> bool {
    observation.iter().all(|value| value.is_finite())
}
