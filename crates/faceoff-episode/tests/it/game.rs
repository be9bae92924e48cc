//! Games from answers that are made up.

use faceoff_episode::{
    Answered, Arena, Effect, Entry, FinishedGame, GameCourse, GameSink, GameStepRow, RallyEnding,
    RallyRow, RallyStart, RecordError, Response, SideFault,
};
use faceoff_sim::{Bounds, RallyEnd};
use faceoff_types::{
    AgentFaultKind, Contest, ForfeitCause, GameEnd, GameLimits, Interpolation, Profile, Seed, Side,
};

fn arena() -> Arena {
    let seed = Seed::from_number(3);
    Arena::new(Profile::Ideal, seed, seed.model_mismatch())
}

/// Less than what a joint is pushed to by commands at the bound.
const NARROW: Bounds = Bounds {
    joint_rad_s: 20.0,
    ..Bounds::WIDE
};

fn took(computation_time_s: f64) -> Answered {
    Answered {
        computation_time_s,
        host_time_s: 0.0,
        cpu_time_s: None,
    }
}

fn broken() -> SideFault {
    SideFault {
        kind: AgentFaultKind::ClosedOutput,
        line: None,
    }
}

/// Keeps what is told of a game in few words.
#[derive(Debug, Default, PartialEq)]
struct Told {
    rallies: Vec<(u32, u32)>,
    effects: [Vec<Effect>; 2],
    ends: Vec<(u32, u32, RallyEnding, [bool; 2])>,
    observed: usize,
    /// Joint positions of both robots after each step.
    q: Vec<[f64; 2]>,
}

impl GameSink for Told {
    fn begin_rally(&mut self, start: &RallyStart<'_>) -> Result<(), RecordError> {
        self.rallies.push((start.rally, start.game_step));
        Ok(())
    }
    fn observe(&mut self, observations: [&[f64]; 2]) {
        assert!(observations.iter().all(|numbers| numbers.len() == 23));
        self.observed += 1;
    }
    fn step(&mut self, row: &GameStepRow<'_>) -> Result<(), RecordError> {
        for (effects, side) in self.effects.iter_mut().zip(&row.sides) {
            effects.push(side.effect);
        }
        self.q.push(row.state.q.map(|q| q[0]));
        Ok(())
    }
    fn end_rally(&mut self, row: &RallyRow<'_>) -> Result<(), RecordError> {
        let faults = row.faults.map(|fault| fault.is_some());
        self.ends.push((row.rally, row.steps, row.ending, faults));
        Ok(())
    }
}

/// What a side does at a rally's step.
type Does = fn(rally: u32, step: u32) -> Does1;

enum Does1 {
    Holds(f64),
    Swings(f64),
    Breaks,
    Explodes,
}

fn enters(course: &GameCourse<Told>, side: Side) -> Entry {
    Entry::Plays {
        startup_s: course.needs_start(side).then_some(0.5),
        interpolation: Interpolation::Trajectory,
        reset_s: 0.25,
    }
}

fn play(steps: u32, limits: GameLimits, does: [Does; 2]) -> FinishedGame<Told> {
    play_in(&arena(), steps, limits, does)
}

fn play_in(arena: &Arena, steps: u32, limits: GameLimits, does: [Does; 2]) -> FinishedGame<Told> {
    let mut course = GameCourse::begin(arena, steps, limits, Told::default());
    let mut speeds = [[0.0; 7]; 2];
    while course.end().is_none() {
        course
            .start_rally(Side::BOTH.map(|side| enters(&course, side)))
            .unwrap();
        while course.is_in_rally() {
            let (rally, step) = (course.rally(), course.rally_steps());
            let mut actions = [const { Vec::new() }; 2];
            let mut times = [Some(0.0); 2];
            for side in Side::BOTH {
                let Some(question) = course.question(side).unwrap() else {
                    continue;
                };
                let at = side.index();
                assert_eq!(question.step, step);
                let held: [f64; 7] = question.observation[6..13].try_into().unwrap();
                speeds[at] = question.observation[13..20].try_into().unwrap();
                let (target, time) = match does[at](rally, step) {
                    Does1::Holds(time) => (held, Some(time)),
                    Does1::Swings(time) => (held.map(|q| q + 0.05), Some(time)),
                    Does1::Breaks => (held, None),
                    Does1::Explodes => {
                        let push = speeds[at].map(|dq| if dq > 0.0 { 1e4 } else { -1e4 });
                        actions[at] = [push; 60].concat();
                        continue;
                    }
                };
                actions[at] = Interpolation::Trajectory.held(&target).to_vec();
                times[at] = time;
            }
            let responses = [0, 1].map(|at| {
                let side = Side::BOTH[at];
                match (course.fault(side), times[at]) {
                    (Some(_), _) => Response::Held,
                    (None, None) => Response::Fault {
                        fault: broken(),
                        answered: took(1.0),
                    },
                    (None, Some(time)) => Response::Answer {
                        action: &actions[at],
                        answered: took(time),
                    },
                }
            });
            course.answer(responses).unwrap();
        }
    }
    course.finish()
}

fn holds(_: u32, _: u32) -> Does1 {
    Does1::Holds(0.001)
}

#[test]
fn a_late_answer_moves_nothing_and_counts() {
    fn late(_: u32, step: u32) -> Does1 {
        Does1::Swings(if step < 20 { 0.021 } else { 0.02 })
    }
    let game = play(40, GameLimits::default(), [late, holds]);
    let [first, second] = &game.outcome.sides;
    assert_eq!((first.late_answers, first.answers), (20, 40));
    assert_eq!((second.late_answers, second.answers), (0, 40));
    assert_eq!(game.sink.effects[0][..20], [Effect::Late; 20]);
    assert_eq!(game.sink.effects[0][20..], [Effect::InTime; 20]);
    // The base stays where it was until the first answer that is in time.
    assert!(
        game.sink.q[..20]
            .iter()
            .all(|[first, _]| first.abs() < 1e-3)
    );
    assert!(game.sink.q[39][0] > 0.01, "{:?}", game.sink.q[39]);
    assert_eq!(first.windows[0].computation_time.max_s, 0.021);
    assert_eq!(game.answer_times_s[0].len(), 40);
}

#[test]
fn after_a_fault_the_arm_holds_to_the_rallys_end_and_the_side_is_started_anew() {
    fn breaks_once(rally: u32, step: u32) -> Does1 {
        if (rally, step) == (0, 3) {
            Does1::Breaks
        } else {
            Does1::Holds(0.001)
        }
    }
    let game = play(800, GameLimits::default(), [holds, breaks_once]);
    let told = &game.sink;
    assert_eq!(told.effects[1][..3], [Effect::InTime; 3]);
    assert_eq!(told.effects[1][3], Effect::Fault);
    assert_eq!(told.effects[1][4..752], [Effect::Held; 748]);
    assert_eq!(told.effects[1][752..], [Effect::InTime; 48]);
    assert_eq!(told.effects[0], [Effect::InTime; 800]);
    assert_eq!(told.rallies, [(0, 0), (1, 752)]);
    let [
        (0, 752, first, [false, true]),
        (1, 48, RallyEnding::GameOver, [false, false]),
    ] = told.ends[..]
    else {
        panic!("{:?}", told.ends)
    };
    assert!(matches!(first, RallyEnding::Table(RallyEnd::Foul { .. })));
    let [good, bad] = &game.outcome.sides;
    // Two starts and two resets against one start and two resets.
    assert!((good.time_used_s - (0.5 + 0.5 + 0.8)).abs() < 1e-9);
    assert!((bad.time_used_s - (1.0 + 0.5 + 1.0 + 0.051)).abs() < 1e-9);
    let fault = &bad.faults[0];
    assert_eq!(fault.game_step, 3);
    let contest = Contest::Game { side: Side::Second };
    assert_eq!(
        (fault.fault.contest, fault.fault.episode, fault.fault.step),
        (contest, Some(0), Some(3))
    );
    let faults: Vec<u32> = bad.windows.iter().map(|window| window.faults).collect();
    assert_eq!(faults, [1, 0]);
}

#[test]
fn more_faults_than_allowed_forfeit_at_once_and_both_in_one_step_draw() {
    fn breaks(_: u32, _: u32) -> Does1 {
        Does1::Breaks
    }
    let limits = GameLimits {
        max_faults: 1,
        ..GameLimits::default()
    };
    let game = play(45_000, limits.clone(), [holds, breaks]);
    let cause = ForfeitCause::Faults {
        count: 2,
        allowed: 1,
    };
    let by = Side::Second;
    assert_eq!(game.outcome.end, GameEnd::Forfeit { by, cause });
    assert_eq!(game.outcome.steps, 753);
    let game = play(45_000, limits, [breaks, breaks]);
    let causes = [cause; 2];
    assert_eq!(game.outcome.end, GameEnd::BothForfeit { causes });
}

#[test]
fn the_time_of_a_side_is_its_own() {
    fn slow(_: u32, _: u32) -> Does1 {
        Does1::Holds(0.5)
    }
    let limits = GameLimits {
        total_s: 10.0,
        ..GameLimits::default()
    };
    let game = play(45_000, limits.clone(), [slow, holds]);
    let GameEnd::Forfeit {
        by: Side::First,
        cause: ForfeitCause::Time { used_s, allowed_s },
    } = game.outcome.end
    else {
        panic!("{:?}", game.outcome.end)
    };
    // 0.75 s to start and to get ready.
    assert_eq!((used_s, allowed_s, game.outcome.steps), (10.25, 10.0, 19));
    assert!(game.outcome.sides[1].time_used_s < 1.0);
    let game = play(45_000, limits, [slow, slow]);
    assert!(matches!(game.outcome.end, GameEnd::BothForfeit { .. }));
}

#[test]
fn who_cannot_start_has_a_fault_and_no_process() {
    let limits = GameLimits {
        max_faults: 0,
        ..GameLimits::default()
    };
    let mut course = GameCourse::begin(&arena(), 100, limits, Told::default());
    let fails = Entry::FailedToStart {
        startup_s: 120.0,
        fault: broken(),
    };
    let plays = enters(&course, Side::First);
    course.start_rally([plays, fails]).unwrap();
    let fault = course.fault(Side::Second).unwrap();
    assert_eq!((fault.episode, fault.step), (None, None));
    let game = course.finish();
    assert_eq!((game.outcome.steps, game.outcome.rallies), (0, 1));
    assert_eq!(
        game.sink.ends,
        [(0, 0, RallyEnding::GameOver, [false, true])]
    );
    assert_eq!(game.outcome.sides[1].faults.len(), 1);
    for side in &game.outcome.sides {
        assert_eq!(side.windows, [], "nothing was played");
    }
}

#[test]
fn a_world_that_diverges_is_the_fault_of_the_side_that_made_it() {
    fn explodes(_: u32, _: u32) -> Does1 {
        Does1::Explodes
    }
    let narrow = arena().within(NARROW);
    let game = play_in(&narrow, 1000, GameLimits::default(), [holds, explodes]);
    let [good, bad] = &game.outcome.sides;
    assert_eq!(good.faults, []);
    assert!(!bad.faults.is_empty());
    for fault in &bad.faults {
        let kind = &fault.fault.fault;
        assert!(matches!(kind, AgentFaultKind::Diverged { .. }), "{kind:?}");
    }
    let diverged =
        game.sink.ends.iter().filter(|(_, _, ending, faults)| {
            *faults == [false, true] && ending.as_str() == "diverged"
        });
    assert_eq!(diverged.count(), bad.faults.len());
}
