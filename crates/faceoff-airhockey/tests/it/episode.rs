//! Episodes from scripted answers: recordings, limits on steps, faults and divergence.

use faceoff_airhockey::{DEFEND, HIT, PREPARE, TASKS};
use faceoff_airhockey::{SimulationSetup, recording_columns};
use faceoff_episode::{
    ActionRequest, AnswerTiming, EpisodeStart, NullSink, RecordError, RunningEpisode, StateColumns,
    StepRow, StepSink, World,
};
use faceoff_sim::{AirHockeyProfile, Bounds, Interpolation};
use faceoff_types::{
    ACTION_LIMIT, AgentFault, AgentFaultKind, EpisodeEnd, EpisodeOutcome, Phase, Seed, Task,
};
use std::ops::Range;

/// Records everything that a sink receives. Floats are formatted so that they round-trip to the bit.
#[derive(Default)]
struct SinkLog {
    lines: Vec<String>,
    actions: Vec<Vec<f64>>,
    times: Vec<AnswerTiming>,
}

/// The values of a state's columns.
#[derive(Debug, Default)]
struct State(Vec<Option<f64>>);

impl StateColumns for State {
    fn put(&mut self, values: &[f64]) {
        self.0.extend(values.iter().copied().map(Some));
    }
    fn put_absent(&mut self, count: usize) {
        self.0.extend(std::iter::repeat_n(None, count));
    }
}

impl SinkLog {
    fn state(&mut self, world: &dyn World) {
        let mut state = State::default();
        world.record_state(&mut state);
        assert_eq!(state.0.len(), recording_columns().state.len());
        self.lines
            .push(format!("{state:?} {:?}", world.constraint_values()));
    }
}

impl StepSink for SinkLog {
    fn begin(&mut self, start: EpisodeStart<'_>) {
        let (episode, seed, layout) = (start.episode, start.seed, start.layout);
        self.lines.push(format!("{episode} {seed} {layout:?}"));
        self.state(start.world);
    }
    fn observe(&mut self, observation: &[f64]) {
        self.lines.push(format!("{observation:?}"));
    }
    fn step(&mut self, row: &StepRow<'_>) {
        self.lines.push(format!(
            "{} {:?} {:?} {:?}",
            row.step, row.action, row.timing, row.next_observation
        ));
        self.state(row.world);
        self.actions.push(row.action.to_vec());
        self.times.push(row.timing);
    }
    fn end(&mut self, outcome: &EpisodeOutcome, _: u32) -> Result<(), RecordError> {
        self.lines.push(format!("{outcome:?}"));
        Ok(())
    }
}

/// Indices in an observation.
const JOINT_POSITIONS: Range<usize> = 6..13;
const JOINT_VELOCITIES: Range<usize> = 13..20;

/// Index of the episode within the evaluation; arbitrary.
const EPISODE: u32 = 4;

fn simulation_setup() -> SimulationSetup {
    let seed = Seed::from_number(3); // arbitrary
    SimulationSetup::new(AirHockeyProfile::Evaluation, seed, seed.model_mismatch())
}

fn begin<S: StepSink>(task: Task, sink: S) -> RunningEpisode<S> {
    RunningEpisode::begin(
        &simulation_setup(),
        task,
        EPISODE,
        Some(Interpolation::Cubic.into()),
        sink,
    )
    .unwrap()
}

/// Answers with slightly moved joint positions, and a computation time that depends on the step.
fn answer<S: StepSink>(running: &mut RunningEpisode<S>) -> Option<EpisodeOutcome> {
    let request = running.action_request().unwrap();
    let mut action = request.observation[JOINT_POSITIONS].to_vec();
    action[0] += 0.01;
    action.extend([0.0; 7]);
    let timing = AnswerTiming {
        computation_time_s: 0.001 * f64::from(request.step),
        host_time_s: 0.0,
        cpu_time_s: None,
    };
    running.answer(&action, timing).unwrap()
}

#[test]
fn replayed_answers_give_the_same_recording() {
    for task in TASKS {
        let mut played = SinkLog::default();
        let mut running = begin(task, &mut played);
        let outcome = loop {
            if let Some(outcome) = answer(&mut running) {
                break outcome;
            }
        };
        assert_eq!(running.end(), Some(outcome.end));
        assert_eq!((outcome.task, outcome.episode), (task, EPISODE));
        let max_s = 0.001 * f64::from(outcome.steps - 1);
        assert_eq!(outcome.computation_time.max_s, max_s);

        let mut running = begin(task, SinkLog::default());
        let mut replayed = None;
        for (action, timing) in played.actions.iter().zip(&played.times) {
            assert_eq!(replayed, None, "the episode ends with the last answer");
            replayed = running.answer(action, *timing).unwrap();
        }
        assert_eq!(replayed, Some(outcome));
        assert_eq!(running.sink().lines, played.lines);
    }
}

#[test]
fn episode_can_be_limited_in_steps() {
    let mut running = begin(HIT, NullSink).with_max_steps(2);
    assert_eq!(answer(&mut running), None);
    let outcome = answer(&mut running).unwrap();
    assert_eq!((outcome.steps, outcome.end), (2, EpisodeEnd::HORIZON));
}

#[test]
fn fault_has_the_position_of_the_pending_answer() {
    let mut running = begin(DEFEND, NullSink);
    for (phase, episode, step) in [
        (Phase::StartUp, None, None),
        (Phase::Reset, Some(EPISODE), None),
        (Phase::Step, Some(EPISODE), Some(2)),
    ] {
        while phase == Phase::Step && running.steps() < 2 {
            assert_eq!(answer(&mut running), None);
        }
        let line = Some("oops".to_owned());
        let outcome = running.outcome_after_fault(phase, AgentFaultKind::NonFinite, line);
        let fault = outcome.fault.clone().unwrap();
        assert_eq!((fault.episode, fault.step), (episode, step));
        assert_eq!(fault.agent_task, DEFEND.into());
        assert_eq!(outcome.end, EpisodeEnd::AGENT_FAULT);
        assert!(!outcome.success);
        assert_eq!(running.outcome_after_recorded_fault(fault), Some(outcome));
    }
}

#[test]
fn inconsistent_recorded_fault_is_refused() {
    let mut running = begin(DEFEND, NullSink).with_max_steps(2);
    assert_eq!(answer(&mut running), None);
    let outcome = running.outcome_after_fault(Phase::Step, AgentFaultKind::NonFinite, None);
    let fault = outcome.fault.unwrap();
    let fault_with = |change: &dyn Fn(&mut AgentFault)| {
        let mut fault = fault.clone();
        change(&mut fault);
        fault
    };
    for inconsistent in [
        fault_with(&|fault| fault.agent_task = HIT.into()),
        fault_with(&|fault| fault.episode = Some(EPISODE + 1)),
        fault_with(&|fault| fault.step = Some(0)),
        fault_with(&|fault| fault.step = None),
        fault_with(&|fault| (fault.episode, fault.step) = (None, None)),
        fault_with(&|fault| fault.episode = None),
    ] {
        assert_eq!(
            running.outcome_after_recorded_fault(inconsistent.clone()),
            None,
            "{inconsistent}"
        );
    }
    assert!(
        running
            .outcome_after_recorded_fault(fault.clone())
            .is_some()
    );
    assert!(answer(&mut running).is_some());
    let after_the_end = fault_with(&|fault| fault.step = Some(2));
    assert_eq!(running.outcome_after_recorded_fault(after_the_end), None);
}

/// An action with all numbers at the limit of actions, in the direction in which each joint already turns.
fn extreme_action(observation: &[f64]) -> Vec<f64> {
    let joint_velocities = &observation[JOINT_VELOCITIES];
    (0..Interpolation::Trajectory.len())
        .map(|i| ACTION_LIMIT.copysign(joint_velocities[i % 7]))
        .collect()
}

fn begin_within<S: StepSink>(bounds: Bounds, sink: S) -> RunningEpisode<S> {
    let layout = Some(Interpolation::Trajectory.into());
    let setup = simulation_setup().with_bounds(bounds);
    RunningEpisode::begin(&setup, PREPARE, EPISODE, layout, sink).unwrap()
}

#[test]
fn divergence_is_an_agent_fault() {
    let timing = AnswerTiming {
        computation_time_s: 0.001,
        host_time_s: 0.0,
        cpu_time_s: None,
    };
    // A simulation beyond its bounds counts as diverged; within these an agent reaches the bound of joint velocities soon.
    let narrow_bounds = Bounds {
        joint_rad_s: 50.0,
        ..Bounds::WIDE
    };
    let mut played = SinkLog::default();
    let mut running = begin_within(narrow_bounds, &mut played);
    let kind = loop {
        let ActionRequest { observation, .. } = running.action_request().unwrap();
        assert!(observation.iter().all(|number| number.is_finite()));
        let action = extreme_action(observation);
        match running.answer(&action, timing) {
            Ok(None) => {}
            Ok(Some(outcome)) => panic!("the episode ended by {:?}", outcome.end),
            Err(kind) => break kind,
        }
    };
    assert!(matches!(kind, AgentFaultKind::Diverged { .. }), "{kind:?}");
    assert!(
        kind.to_string()
            .contains("made the simulated world diverge")
    );
    assert_eq!(running.diverged(), Some(&kind));
    let outcome = running.outcome_after_fault(Phase::Step, kind, Some("{}".to_owned()));
    let fault = outcome.fault.clone().unwrap();
    // The diverging step is recorded, and the fault has its number.
    assert_eq!(fault.step, Some(outcome.steps - 1));
    assert_eq!(
        (outcome.end, outcome.success),
        (EpisodeEnd::AGENT_FAULT, false)
    );

    // A replay of the answers ends in the same way and accepts no other fault.
    let mut running = begin_within(narrow_bounds, SinkLog::default());
    let (last, before) = played.actions.split_last().unwrap();
    for action in before {
        assert_eq!(running.answer(action, timing), Ok(None));
        assert_eq!(running.outcome_after_recorded_fault(fault.clone()), None);
    }
    running.answer(last, timing).unwrap_err();
    assert_eq!(running.sink().lines, played.lines);
    let fault_with = |change: &dyn Fn(&mut AgentFault)| {
        let mut fault = fault.clone();
        change(&mut fault);
        fault
    };
    for other in [
        fault_with(&|fault| fault.fault = AgentFaultKind::NonFinite),
        fault_with(&|fault| fault.fault = AgentFaultKind::Diverged { detail: "x".into() }),
        fault_with(&|fault| fault.step = Some(outcome.steps)),
        fault_with(&|fault| fault.step = None),
    ] {
        assert_eq!(
            running.outcome_after_recorded_fault(other.clone()),
            None,
            "{other}"
        );
    }
    assert_eq!(running.outcome_after_recorded_fault(fault), Some(outcome));

    // The first ruleset had no such bounds.
    let mut running = begin_within(Bounds::of(faceoff_sim::AirHockeyRuleset::First), NullSink);
    for action in &played.actions {
        assert!(running.answer(action, timing).is_ok());
    }
}
