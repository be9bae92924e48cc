//! Episodes in a world other than air hockey: a mass on a line, which the agent pushes to the origin.

use faceoff_episode::{
    AnswerTiming, EpisodeStart, NullSink, RecordError, RunningEpisode, StateColumns, StepRow,
    StepSink, World, WorldFactory,
};
use faceoff_types::{
    ActionLayout, AgentFaultKind, EpisodeEnd, EpisodeOutcome, Phase, Seed, Task, UnknownTask,
    Violations,
};
use std::any::Any;

/// Control steps of the longest episode.
const MAX_STEPS: u32 = 40;
/// Beyond this distance from the origin, m, the mass is lost.
const BOUND_M: f64 = 10.0;

/// The agent's action is a displacement, m.
const DISPLACEMENT: ActionLayout = ActionLayout::new(Some(1), &[1]);
/// The agent's action is half of a displacement, m.
const HALF_DISPLACEMENT: ActionLayout = ActionLayout::new(Some(2), &[1]);

#[derive(Debug)]
struct PointMass {
    /// Is an action half of a displacement?
    halves: bool,
    position_m: [f64; 1],
    steps: u32,
}

impl World for PointMass {
    fn steps(&self) -> u32 {
        self.steps
    }

    fn observation(&self) -> &[f64] {
        &self.position_m
    }

    fn step(&mut self, action: &[f64]) -> Option<EpisodeEnd> {
        self.position_m[0] += match self.halves {
            false => action[0],
            true => action[0] / 2.0,
        };
        self.steps += 1;
        self.success().then_some(STOPPED)
    }

    fn divergence(&self) -> Option<String> {
        let is_lost = self.position_m[0].abs() > BOUND_M;
        is_lost.then(|| "the mass is lost".to_owned())
    }

    fn success(&self) -> bool {
        self.position_m[0].abs() < 0.01
    }

    fn violations(&self) -> Violations {
        Violations::default()
    }

    fn record_state(&self, columns: &mut dyn StateColumns) {
        columns.put(&self.position_m);
    }

    fn constraint_values(&self) -> &[f64] {
        &[]
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}

/// Makes the worlds, each a mass on a line, at a position that depends on seed and episode, or at `start_m`.
struct PointMassFactory {
    start_m: Option<f64>,
}

impl WorldFactory for PointMassFactory {
    fn seed(&self, task: Task, index: u32) -> Seed {
        Seed::from_number(5).episode(task, index)
    }

    fn max_steps(&self, _: Task) -> u32 {
        MAX_STEPS
    }

    fn reset(
        &self,
        task: Task,
        index: u32,
        layout: Option<ActionLayout>,
    ) -> Result<Box<dyn World>, UnknownTask> {
        if task != REACH {
            return Err(UnknownTask::new(task.as_str(), [REACH]));
        }
        let drawn = f64::from(self.seed(task, index).as_bytes()[0]) / 256.0 + 1.0;
        Ok(Box::new(PointMass {
            halves: layout == Some(HALF_DISPLACEMENT),
            position_m: [self.start_m.unwrap_or(drawn)],
            steps: 0,
        }))
    }
}

/// The task of the other world.
const REACH: Task = Task::new("reach");
/// The mass has come to the origin.
const STOPPED: EpisodeEnd = EpisodeEnd::new("stopped");

/// Positions that a recording has.
#[derive(Default)]
struct Positions {
    layout: Option<ActionLayout>,
    true_m: Vec<f64>,
    observed_m: Vec<f64>,
    next_observed_m: Vec<f64>,
}

/// The true position, as recordings have it.
fn position(world: &dyn World) -> f64 {
    let mass: &PointMass = world.as_any().downcast_ref().unwrap();
    mass.position_m[0]
}

impl StepSink for Positions {
    fn begin(&mut self, start: EpisodeStart<'_>) {
        self.layout = start.layout;
        self.true_m.push(position(start.world));
    }
    fn observe(&mut self, observation: &[f64]) {
        self.observed_m.push(observation[0]);
    }
    fn step(&mut self, row: &StepRow<'_>) {
        self.true_m.push(position(row.world));
        self.next_observed_m.push(row.next_observation[0]);
    }
    fn end(&mut self, _: &EpisodeOutcome, _: u32) -> Result<(), RecordError> {
        Ok(())
    }
}

const TIMING: AnswerTiming = AnswerTiming {
    computation_time_s: 0.001,
    host_time_s: 0.0,
    cpu_time_s: None,
};

/// Plays an episode with an agent that answers with `factor` times the observed position.
fn play<S: StepSink>(
    factory: &PointMassFactory,
    layout: ActionLayout,
    factor: f64,
    sink: S,
) -> Result<EpisodeOutcome, AgentFaultKind> {
    let mut running = RunningEpisode::begin(factory, REACH, 3, Some(layout), sink).unwrap();
    loop {
        let action = [factor * running.action_request().unwrap().observation[0]];
        if let Some(outcome) = running.answer(&action, TIMING)? {
            return Ok(outcome);
        }
    }
}

#[test]
fn other_world_is_played_and_recorded() {
    let factory = PointMassFactory { start_m: None };
    let mut recorded = Positions::default();
    let outcome = play(&factory, HALF_DISPLACEMENT, -1.0, &mut recorded).unwrap();
    assert_eq!((outcome.end, outcome.success), (STOPPED, true));
    assert_eq!(outcome.computation_time.max_s, TIMING.computation_time_s);
    assert_eq!(recorded.layout, Some(HALF_DISPLACEMENT));
    let steps = usize::try_from(outcome.steps).unwrap();
    assert_eq!(recorded.true_m.len(), 1 + steps);
    assert_eq!(recorded.observed_m, recorded.true_m[..steps]);
    assert_eq!(recorded.next_observed_m, recorded.true_m[1..]);
    assert_eq!(recorded.true_m[1], recorded.true_m[0] / 2.0);

    let again = play(&factory, HALF_DISPLACEMENT, -1.0, NullSink).unwrap();
    assert_eq!(again, outcome, "the same seed gives the same episode");
    let idle = play(&factory, DISPLACEMENT, 0.0, NullSink).unwrap();
    assert_eq!(
        (idle.steps, idle.end, idle.success),
        (MAX_STEPS, EpisodeEnd::HORIZON, false)
    );
}

#[test]
fn other_world_that_diverges_is_an_agent_fault() {
    let factory = PointMassFactory { start_m: Some(1.0) };
    let fault = play(&factory, DISPLACEMENT, 100.0, NullSink).unwrap_err();
    let detail = "the mass is lost".to_owned();
    assert_eq!(fault, AgentFaultKind::Diverged { detail });
    let running = RunningEpisode::begin(&factory, REACH, 3, None, NullSink).unwrap();
    let outcome = running.outcome_after_fault(Phase::StartUp, fault, None);
    assert_eq!((outcome.steps, outcome.success), (0, false));
}

#[test]
fn first_observation_that_is_not_finite_is_no_agent_fault() {
    let factory = PointMassFactory {
        start_m: Some(f64::NAN),
    };
    let running = RunningEpisode::begin(&factory, REACH, 3, None, NullSink).unwrap();
    let error = running.action_request().unwrap_err();
    assert_eq!(error.episode, 3);
}

#[test]
fn world_refuses_tasks_of_other_worlds() {
    let factory = PointMassFactory { start_m: None };
    let refused = RunningEpisode::begin(&factory, Task::new("hit"), 3, None, NullSink);
    let error = refused.unwrap_err().to_string();
    assert_eq!(error, "unknown task \"hit\": expected reach");
}
