//! Games from scripted answers: late answers, faults, forfeits and divergence.

use faceoff_airhockey::{
    Effect, FinishedGame, GameSink, GameStepRow, RallyEnding, RallyReadiness, RallyRow, RallyStart,
    Response, RunningGame, SideFault, SimulationSetup,
};
use faceoff_episode::{AnswerTiming, RecordError};
use faceoff_sim::{AirHockeyProfile, Bounds, Interpolation, RallyEnd};
use faceoff_types::{
    ACTION_LIMIT, AgentFaultKind, AgentTask, ForfeitCause, GameEnd, GameLimits, Seed, Side,
};
use std::ops::Range;

/// Indices in an observation.
const JOINT_POSITIONS: Range<usize> = 6..13;
const JOINT_VELOCITIES: Range<usize> = 13..20;

/// Control steps of a game of full length, which ends earlier in these tests.
const FULL_GAME_STEPS: u32 = 45_000;

fn simulation_setup() -> SimulationSetup {
    let seed = Seed::from_number(3); // arbitrary
    SimulationSetup::new(AirHockeyProfile::Ideal, seed, seed.model_mismatch())
}

/// Bounds on the simulated motion that the largest commands exceed.
const NARROW_BOUNDS: Bounds = Bounds {
    joint_rad_s: 20.0,
    ..Bounds::WIDE
};

fn timing(computation_time_s: f64) -> AnswerTiming {
    AnswerTiming {
        computation_time_s,
        host_time_s: 0.0,
        cpu_time_s: None,
    }
}

fn side_fault() -> SideFault {
    SideFault {
        kind: AgentFaultKind::ClosedOutput,
        line: None,
    }
}

/// Records a summary of what a sink receives.
#[derive(Debug, Default, PartialEq)]
struct SinkLog {
    /// Number and first game step of each rally.
    rallies: Vec<(u32, u32)>,
    /// Effect of each step, per side.
    effects: [Vec<Effect>; 2],
    /// Number, steps, ending and faults (per side) of each rally.
    ends: Vec<(u32, u32, RallyEnding, [bool; 2])>,
    observations: usize,
    /// Position of the first joint of both robots after each step, rad.
    first_joint: Vec<[f64; 2]>,
}

impl GameSink for SinkLog {
    fn begin_rally(&mut self, start: &RallyStart<'_>) -> Result<(), RecordError> {
        self.rallies.push((start.rally, start.game_step));
        Ok(())
    }
    fn observe(&mut self, observations: [&[f64]; 2]) {
        assert!(observations.iter().all(|numbers| numbers.len() == 23));
        self.observations += 1;
    }
    fn step(&mut self, row: &GameStepRow<'_>) -> Result<(), RecordError> {
        for (effects, side) in self.effects.iter_mut().zip(&row.sides) {
            effects.push(side.effect);
        }
        self.first_joint
            .push(row.state.q.map(|positions| positions[0]));
        Ok(())
    }
    fn end_rally(&mut self, row: &RallyRow<'_>) -> Result<(), RecordError> {
        let faults = row.faults.map(|fault| fault.is_some());
        self.ends.push((row.rally, row.steps, row.ending, faults));
        Ok(())
    }
}

/// The behaviour of a side: its response at a step of a rally.
type Script = fn(rally: u32, step: u32) -> ScriptedStep;

/// What a side does in a step. The numbers are computation times in seconds.
enum ScriptedStep {
    /// Command the present position.
    Hold(f64),
    /// Command a position 0.05 rad further.
    Swing(f64),
    /// Give no valid answer.
    Fault,
    /// Command the largest numbers, so that the simulation diverges.
    Diverge,
}

fn ready(running: &RunningGame<SinkLog>, side: Side) -> RallyReadiness {
    RallyReadiness::Ready {
        startup_s: running.needs_start(side).then_some(0.5),
        interpolation: Interpolation::Trajectory,
        reset_s: 0.25,
    }
}

fn play(steps: u32, limits: GameLimits, scripts: [Script; 2]) -> FinishedGame<SinkLog> {
    play_in(&simulation_setup(), steps, limits, scripts)
}

fn play_in(
    setup: &SimulationSetup,
    steps: u32,
    limits: GameLimits,
    scripts: [Script; 2],
) -> FinishedGame<SinkLog> {
    let mut running = RunningGame::begin(setup, steps, limits, SinkLog::default());
    let mut speeds = [[0.0; 7]; 2];
    while running.end().is_none() {
        running
            .start_rally(Side::BOTH.map(|side| ready(&running, side)))
            .unwrap();
        while running.is_in_rally() {
            let (rally, step) = (running.rally(), running.rally_steps());
            let mut actions = [const { Vec::new() }; 2];
            let mut times = [Some(0.0); 2];
            for side in Side::BOTH {
                let Some(request) = running.action_request(side).unwrap() else {
                    continue;
                };
                let index = side.index();
                assert_eq!(request.step, step);
                let held: [f64; 7] = request.observation[JOINT_POSITIONS].try_into().unwrap();
                speeds[index] = request.observation[JOINT_VELOCITIES].try_into().unwrap();
                let (target, time) = match scripts[index](rally, step) {
                    ScriptedStep::Hold(time) => (held, Some(time)),
                    ScriptedStep::Swing(time) => (held.map(|q| q + 0.05), Some(time)),
                    ScriptedStep::Fault => (held, None),
                    ScriptedStep::Diverge => {
                        let push = speeds[index].map(|speed| {
                            if speed > 0.0 {
                                ACTION_LIMIT
                            } else {
                                -ACTION_LIMIT
                            }
                        });
                        actions[index] = [push; 3 * 20].concat(); // 3 rows per millisecond
                        continue;
                    }
                };
                actions[index] = Interpolation::Trajectory.hold_position(&target).to_vec();
                times[index] = time;
            }
            let responses = [0, 1].map(|index| {
                let side = Side::BOTH[index];
                match (running.fault(side), times[index]) {
                    (Some(_), _) => Response::Held,
                    (None, None) => Response::Fault {
                        fault: side_fault(),
                        timing: timing(1.0),
                    },
                    (None, Some(time)) => Response::Answer {
                        action: &actions[index],
                        timing: timing(time),
                    },
                }
            });
            running.answer(responses).unwrap();
        }
    }
    running.finish()
}

fn hold(_: u32, _: u32) -> ScriptedStep {
    ScriptedStep::Hold(0.001)
}

#[test]
fn late_answers_have_no_effect_and_are_counted() {
    fn late(_: u32, step: u32) -> ScriptedStep {
        // The limit is 0.02 s.
        ScriptedStep::Swing(if step < 20 { 0.021 } else { 0.02 })
    }
    let game = play(40, GameLimits::default(), [late, hold]);
    let [first, second] = &game.outcome.sides;
    assert_eq!((first.late_answers, first.answers), (20, 40));
    assert_eq!((second.late_answers, second.answers), (0, 40));
    assert_eq!(game.sink.effects[0][..20], [Effect::Late; 20]);
    assert_eq!(game.sink.effects[0][20..], [Effect::InTime; 20]);
    // The first joint does not move until the first answer in time.
    assert!(
        game.sink.first_joint[..20]
            .iter()
            .all(|[first, _]| first.abs() < 1e-3)
    );
    assert!(
        game.sink.first_joint[39][0] > 0.01,
        "{:?}",
        game.sink.first_joint[39]
    );
    assert_eq!(first.windows[0].computation_time.max_s, 0.021);
    assert_eq!(game.answer_times_s[0].len(), 40);
}

#[test]
fn fault_holds_the_arm_and_restarts_the_agent() {
    fn fault_once(rally: u32, step: u32) -> ScriptedStep {
        if (rally, step) == (0, 3) {
            ScriptedStep::Fault
        } else {
            ScriptedStep::Hold(0.001)
        }
    }
    let game = play(800, GameLimits::default(), [hold, fault_once]);
    let log = &game.sink;
    // Both arms hold, so the first rally ends with a foul, since the puck stays in one half for too long: after 752 steps.
    assert_eq!(log.effects[1][..3], [Effect::InTime; 3]);
    assert_eq!(log.effects[1][3], Effect::Fault);
    // After the fault no answers are expected until the end of the rally.
    assert_eq!(log.effects[1][4..752], [Effect::Held; 748]);
    assert_eq!(log.effects[1][752..], [Effect::InTime; 48]);
    assert_eq!(log.effects[0], [Effect::InTime; 800]);
    assert_eq!(log.rallies, [(0, 0), (1, 752)]);
    let [
        (0, 752, first, [false, true]),
        (1, 48, RallyEnding::GameOver, [false, false]),
    ] = log.ends[..]
    else {
        panic!("{:?}", log.ends)
    };
    assert!(matches!(first, RallyEnding::Table(RallyEnd::Foul { .. })));
    let [holding_side, faulty_side] = &game.outcome.sides;
    // One start and two resets, against two starts and two resets.
    assert!((holding_side.time_used_s - (0.5 + 0.5 + 0.8)).abs() < 1e-9);
    assert!((faulty_side.time_used_s - (1.0 + 0.5 + 1.0 + 0.051)).abs() < 1e-9);
    let fault = &faulty_side.faults[0];
    assert_eq!(fault.game_step, 3);
    let agent_task = AgentTask::Game { side: Side::Second };
    assert_eq!(
        (
            fault.fault.agent_task,
            fault.fault.episode,
            fault.fault.step
        ),
        (agent_task, Some(0), Some(3))
    );
    let faults: Vec<u32> = faulty_side
        .windows
        .iter()
        .map(|window| window.faults)
        .collect();
    assert_eq!(faults, [1, 0]);
}

#[test]
fn too_many_faults_forfeit_for_one_or_both_sides() {
    fn always_fault(_: u32, _: u32) -> ScriptedStep {
        ScriptedStep::Fault
    }
    let limits = GameLimits {
        max_faults: 1,
        ..GameLimits::default()
    };
    let game = play(FULL_GAME_STEPS, limits.clone(), [hold, always_fault]);
    let cause = ForfeitCause::Faults {
        count: 2,
        allowed: 1,
    };
    let by = Side::Second;
    assert_eq!(game.outcome.end, GameEnd::Forfeit { by, cause });
    // The second fault is in the first step of the second rally.
    assert_eq!(game.outcome.steps, 753);
    let game = play(FULL_GAME_STEPS, limits, [always_fault, always_fault]);
    let causes = [cause; 2];
    assert_eq!(game.outcome.end, GameEnd::BothForfeit { causes });
}

#[test]
fn sides_have_separate_time_budgets() {
    fn slow(_: u32, _: u32) -> ScriptedStep {
        ScriptedStep::Hold(0.5)
    }
    let limits = GameLimits {
        total_s: 10.0,
        ..GameLimits::default()
    };
    let game = play(FULL_GAME_STEPS, limits.clone(), [slow, hold]);
    let GameEnd::Forfeit {
        by: Side::First,
        cause: ForfeitCause::Time { used_s, allowed_s },
    } = game.outcome.end
    else {
        panic!("{:?}", game.outcome.end)
    };
    // Includes 0.75 s for start and reset.
    assert_eq!((used_s, allowed_s, game.outcome.steps), (10.25, 10.0, 19));
    assert!(game.outcome.sides[1].time_used_s < 1.0);
    let game = play(FULL_GAME_STEPS, limits, [slow, slow]);
    assert!(matches!(game.outcome.end, GameEnd::BothForfeit { .. }));
}

#[test]
fn failed_start_is_a_fault() {
    let limits = GameLimits {
        max_faults: 0,
        ..GameLimits::default()
    };
    let mut running = RunningGame::begin(&simulation_setup(), 100, limits, SinkLog::default());
    let start_failed = RallyReadiness::StartFailed {
        startup_s: 120.0,
        fault: side_fault(),
    };
    let ready_entry = ready(&running, Side::First);
    running.start_rally([ready_entry, start_failed]).unwrap();
    let fault = running.fault(Side::Second).unwrap();
    assert_eq!((fault.episode, fault.step), (None, None));
    let game = running.finish();
    assert_eq!((game.outcome.steps, game.outcome.rallies), (0, 1));
    assert_eq!(
        game.sink.ends,
        [(0, 0, RallyEnding::GameOver, [false, true])]
    );
    assert_eq!(game.outcome.sides[1].faults.len(), 1);
    for side in &game.outcome.sides {
        assert_eq!(side.windows, [], "no step was played");
    }
}

#[test]
fn divergence_is_the_fault_of_its_side() {
    fn diverge(_: u32, _: u32) -> ScriptedStep {
        ScriptedStep::Diverge
    }
    let narrow_setup = simulation_setup().with_bounds(NARROW_BOUNDS);
    let game = play_in(&narrow_setup, 1000, GameLimits::default(), [hold, diverge]);
    let [holding_side, faulty_side] = &game.outcome.sides;
    assert_eq!(holding_side.faults, []);
    assert!(!faulty_side.faults.is_empty());
    for fault in &faulty_side.faults {
        let kind = &fault.fault.fault;
        assert!(matches!(kind, AgentFaultKind::Diverged { .. }), "{kind:?}");
    }
    let diverged =
        game.sink.ends.iter().filter(|(_, _, ending, faults)| {
            *faults == [false, true] && ending.as_str() == "diverged"
        });
    assert_eq!(diverged.count(), faulty_side.faults.len());
}
