use crate::{
    arena::Arena,
    record::{Answered, EpisodeStart, StepRow, StepSink},
    time_sum::TimeSum,
};
use faceoff_sim::{EPISODE_STEPS, Episode};
use faceoff_types::{
    AgentFault, AgentFaultKind, Contest, EpisodeEnd, EpisodeOutcome, Interpolation, Phase, Task,
};

/// One episode under way: tells what the agent is to be asked, takes its answers, and decides what
/// comes of it. Whoever drives it brings the answers, from a process, a recording or a function:
///
/// ```
/// # use faceoff_episode::{Answered, Arena, Course, Nowhere};
/// # use faceoff_types::{Interpolation, Phase, Profile, Seed, Task};
/// # let seed = Seed::from_number(1);
/// let arena = Arena::new(Profile::Ideal, seed, seed.model_mismatch());
/// let mut course = Course::begin(&arena, Task::Hit, 0, Some(Interpolation::Linear), Nowhere);
/// let outcome = loop {
///     let joint_positions = course.question()?.observation[6..13].to_vec();
///     let answered = Answered {
///         computation_time_s: 0.001,
///         host_time_s: 0.0,
///         cpu_time_s: None,
///     };
///     match course.answer(&joint_positions, answered) {
///         Ok(None) => {}
///         Ok(Some(outcome)) => break outcome,
///         Err(fault) => break course.failed(Phase::Step, fault, None),
///     }
/// };
/// assert!(outcome.steps <= 500);
/// # Ok::<(), faceoff_episode::NotFinite>(())
/// ```
///
/// The sink learns of the episode's beginning and of each step. Its end is the driver's to tell: a
/// try that does not count is begun again instead.
#[derive(Debug)]
pub struct Course<S> {
    task: Task,
    episode: u32,
    max_steps: u32,
    world: Episode,
    times: TimeSum,
    end: Option<EpisodeEnd>,
    /// The agent's last answer made the world diverge.
    diverged: Option<AgentFaultKind>,
    sink: S,
}

/// What the agent is to be asked.
#[derive(Debug, Clone, Copy)]
pub struct Question<'a> {
    /// The control step, from 0.
    pub step: u32,
    /// 23 numbers with an opponent on the table, 20 without (PROTOCOL); finite.
    pub observation: &'a [f64],
}

/// The initial state is not finite. No agent can be asked then: JSON would say null, and the agent
/// would be blamed for what it makes of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the simulator's first observation of {contest}, episode {episode} is not finite")]
pub struct NotFinite {
    /// What was to be played.
    pub contest: Contest,
    /// Index within the evaluation, or the game's rally.
    pub episode: u32,
}

impl<S: StepSink> Course<S> {
    /// Begins an episode. Without an agent that told its interpolation only its fault can follow; the
    /// initial state, the same for all, is still of interest.
    pub fn begin(
        arena: &Arena,
        task: Task,
        episode: u32,
        interpolation: Option<Interpolation>,
        mut sink: S,
    ) -> Self {
        let world = arena.episode(task, episode, interpolation.unwrap_or(Interpolation::Cubic));
        sink.begin(EpisodeStart {
            episode,
            seed: arena.seed(task, episode),
            interpolation,
            state: &world.state(),
        });
        Self {
            task,
            episode,
            max_steps: EPISODE_STEPS,
            world,
            times: TimeSum::default(),
            end: None,
            diverged: None,
            sink,
        }
    }

    /// Ends the episode after `max_steps` control steps, if the task's horizon is not nearer.
    #[must_use]
    pub fn at_most(self, max_steps: u32) -> Self {
        Self { max_steps, ..self }
    }

    /// What the agent is to be asked next.
    ///
    /// # Errors
    /// The simulator failed: this is neither an end nor the agent's fault.
    pub fn question(&self) -> Result<Question<'_>, NotFinite> {
        let (step, observation) = (self.world.steps(), self.world.observation());
        // Later ones are finite: a world that diverges is the agent's fault.
        if step == 0 && !are_finite(observation) {
            return Err(NotFinite {
                contest: Contest::Task(self.task),
                episode: self.episode,
            });
        }
        Ok(Question { step, observation })
    }

    /// Plays one control step. `action` is row-major, of the interpolation's length, finite. The
    /// outcome comes with the episode's end, after which there must be no further answer.
    ///
    /// # Errors
    /// The answer made the world diverge: the agent's fault, and the episode's end. The step is told to
    /// the sink like any other, so that playing the same answers again leads there again.
    pub fn answer(
        &mut self,
        action: &[f64],
        answered: Answered,
    ) -> Result<Option<EpisodeOutcome>, AgentFaultKind> {
        debug_assert_eq!(self.end, None, "the episode has ended");
        let step = self.world.steps();
        self.sink.observe(self.world.observation());
        let outcome = self.world.step(action);
        self.times.add(answered.computation_time_s);
        self.sink.step(&StepRow {
            step,
            action,
            answered,
            state: &self.world.state(),
            constraints: outcome.constraints,
            next_observation: self.world.observation(),
            puck_lost: self.world.is_puck_lost(),
            impacts: self.world.world().impacts(),
        });
        let detail = match self.world.divergence() {
            Some(divergence) => Some(divergence.what.to_string()),
            None if !are_finite(self.world.observation()) => {
                Some("an observation is not finite".to_owned())
            }
            None => None,
        };
        if let Some(detail) = detail {
            self.end = Some(EpisodeEnd::AgentFault);
            let fault = AgentFaultKind::Diverged { detail };
            self.diverged = Some(fault.clone());
            return Err(fault);
        }
        let horizon = (self.steps() >= self.max_steps).then_some(EpisodeEnd::Horizon);
        self.end = outcome.end.or(horizon);
        Ok(self.end.map(|end| self.outcome(end, None)))
    }

    /// The outcome after the agent's fault, which came when it was asked for `phase`.
    pub fn failed(
        &self,
        phase: Phase,
        fault: AgentFaultKind,
        line: Option<String>,
    ) -> EpisodeOutcome {
        let fault = AgentFault {
            fault,
            contest: Contest::Task(self.task),
            episode: (phase != Phase::StartUp).then_some(self.episode),
            step: (phase == Phase::Step).then(|| self.faulty_step()),
            line,
        };
        self.outcome(EpisodeEnd::AgentFault, Some(fault))
    }

    /// The outcome after a fault that somebody else tells of, as a recording does. `None` if it cannot
    /// be a fault of this episode after the steps played so far.
    pub fn ended_by(&self, fault: AgentFault) -> Option<EpisodeOutcome> {
        let AgentFault {
            contest,
            episode,
            step,
            ..
        } = fault;
        let in_time = match (episode, step) {
            (Some(episode), Some(step)) => episode == self.episode && step == self.faulty_step(),
            (Some(episode), None) => episode == self.episode && self.steps() == 0,
            (None, None) => self.steps() == 0,
            (None, Some(_)) => false,
        };
        // Whether the world diverged is seen here; nobody needs to tell.
        let agrees = match &self.diverged {
            Some(diverged) => fault.fault == *diverged,
            None => self.end.is_none() && !matches!(fault.fault, AgentFaultKind::Diverged { .. }),
        };
        let possible = agrees && contest == Contest::Task(self.task) && in_time;
        possible.then(|| self.outcome(EpisodeEnd::AgentFault, Some(fault)))
    }

    /// The step of a fault: the one whose answer is due, or whose answer made the world diverge.
    fn faulty_step(&self) -> u32 {
        self.steps() - u32::from(self.diverged.is_some())
    }

    /// How the episode ended, unless by a fault that the driver tells of; `None` while it is under way.
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

    /// Where the episode's course goes.
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

pub(crate) fn are_finite(observation: &[f64]) -> bool {
    observation.iter().all(|value| value.is_finite())
}
