use faceoff_episode::{
    Answered, Arena, Course, EpisodeStart, Nowhere, Question, RecordError, StepRow, StepSink,
};
use faceoff_sim::Bounds;
use faceoff_types::{
    AgentFault, AgentFaultKind, EpisodeEnd, EpisodeOutcome, Interpolation, Phase, Profile, Ruleset,
    Seed, Task,
};

/// All that a sink is told, to the last bit: floats are shown so that they read back the same.
#[derive(Default)]
struct Told {
    course: Vec<String>,
    actions: Vec<Vec<f64>>,
    times: Vec<Answered>,
}

impl StepSink for Told {
    fn begin(&mut self, start: EpisodeStart<'_>) {
        self.course.push(format!("{start:?}"));
    }
    fn observe(&mut self, observation: &[f64]) {
        self.course.push(format!("{observation:?}"));
    }
    fn step(&mut self, row: &StepRow<'_>) {
        self.course.push(format!("{row:?}"));
        self.actions.push(row.action.to_vec());
        self.times.push(row.answered);
    }
    fn end(&mut self, outcome: &EpisodeOutcome, _: u32) -> Result<(), RecordError> {
        self.course.push(format!("{outcome:?}"));
        Ok(())
    }
}

fn arena() -> Arena {
    let seed = Seed::from_number(3);
    Arena::new(Profile::Evaluation, seed, seed.model_mismatch())
}

fn begin<S: StepSink>(task: Task, sink: S) -> Course<S> {
    Course::begin(&arena(), task, 4, Some(Interpolation::Cubic), sink)
}

/// Answers with the joints as they are, drifting, and a time that tells the step.
fn answer<S: StepSink>(course: &mut Course<S>) -> Option<EpisodeOutcome> {
    let question = course.question().unwrap();
    let mut action = question.observation[6..13].to_vec();
    action[0] += 0.01;
    action.extend([0.0; 7]);
    let answered = Answered {
        computation_time_s: 0.001 * f64::from(question.step),
        host_time_s: 0.0,
        cpu_time_s: None,
    };
    course.answer(&action, answered).unwrap()
}

#[test]
fn the_same_answers_give_the_same_course_and_outcome() {
    for task in Task::ALL {
        let mut played = Told::default();
        let mut course = begin(task, &mut played);
        let outcome = loop {
            if let Some(outcome) = answer(&mut course) {
                break outcome;
            }
        };
        assert_eq!(course.end(), Some(outcome.end));
        assert_eq!((outcome.task, outcome.episode), (task, 4));
        let max_s = 0.001 * f64::from(outcome.steps - 1);
        assert_eq!(outcome.computation_time.max_s, max_s);

        let mut course = begin(task, Told::default());
        let mut again = None;
        for (action, answered) in played.actions.iter().zip(&played.times) {
            assert_eq!(again, None, "it ends with the last answer");
            again = course.answer(action, *answered).unwrap();
        }
        assert_eq!(again, Some(outcome));
        assert_eq!(course.sink().course, played.course);
    }
}

#[test]
fn an_episode_can_be_made_shorter() {
    let mut course = begin(Task::Hit, Nowhere).at_most(2);
    assert_eq!(answer(&mut course), None);
    let outcome = answer(&mut course).unwrap();
    assert_eq!((outcome.steps, outcome.end), (2, EpisodeEnd::Horizon));
}

#[test]
fn a_fault_counts_where_the_agent_was_asked() {
    let mut course = begin(Task::Defend, Nowhere);
    for (phase, episode, step) in [
        (Phase::StartUp, None, None),
        (Phase::Reset, Some(4), None),
        (Phase::Step, Some(4), Some(2)),
    ] {
        while phase == Phase::Step && course.steps() < 2 {
            assert_eq!(answer(&mut course), None);
        }
        let line = Some("oops".to_owned());
        let outcome = course.failed(phase, AgentFaultKind::NonFinite, line);
        let fault = outcome.fault.clone().unwrap();
        assert_eq!((fault.episode, fault.step), (episode, step));
        assert_eq!(fault.contest, Task::Defend.into());
        assert_eq!(outcome.end, EpisodeEnd::AgentFault);
        assert!(!outcome.success);
        assert_eq!(course.ended_by(fault), Some(outcome));
    }
}

#[test]
fn a_fault_of_another_time_or_place_cannot_have_ended_the_episode() {
    let mut course = begin(Task::Defend, Nowhere).at_most(2);
    assert_eq!(answer(&mut course), None);
    let outcome = course.failed(Phase::Step, AgentFaultKind::NonFinite, None);
    let fault = outcome.fault.unwrap();
    let with = |change: &dyn Fn(&mut AgentFault)| {
        let mut fault = fault.clone();
        change(&mut fault);
        fault
    };
    for elsewhere in [
        with(&|fault| fault.contest = Task::Hit.into()),
        with(&|fault| fault.episode = Some(5)),
        with(&|fault| fault.step = Some(0)),
        with(&|fault| fault.step = None),
        with(&|fault| (fault.episode, fault.step) = (None, None)),
        with(&|fault| fault.episode = None),
    ] {
        assert_eq!(course.ended_by(elsewhere.clone()), None, "{elsewhere}");
    }
    assert!(course.ended_by(fault.clone()).is_some());
    assert!(answer(&mut course).is_some());
    let after_the_end = with(&|fault| fault.step = Some(2));
    assert_eq!(course.ended_by(after_the_end), None);
}

/// Everything at its bound, the way that each joint turns already.
fn pump(observation: &[f64]) -> Vec<f64> {
    let dq = &observation[13..20];
    (0..Interpolation::Trajectory.len())
        .map(|i| 1e4f64.copysign(dq[i % 7]))
        .collect()
}

fn begin_within<S: StepSink>(bounds: Bounds, sink: S) -> Course<S> {
    let interpolation = Some(Interpolation::Trajectory);
    let arena = arena().within(bounds);
    Course::begin(&arena, Task::Prepare, 4, interpolation, sink)
}

#[test]
fn commands_that_make_the_world_diverge_are_the_agents_fault() {
    let answered = Answered {
        computation_time_s: 0.001,
        host_time_s: 0.0,
        cpu_time_s: None,
    };
    let narrow = Bounds {
        joint_rad_s: 50.0,
        ..Bounds::WIDE
    };
    let mut played = Told::default();
    let mut course = begin_within(narrow, &mut played);
    let kind = loop {
        let Question { observation, .. } = course.question().unwrap();
        assert!(observation.iter().all(|number| number.is_finite()));
        let action = pump(observation);
        match course.answer(&action, answered) {
            Ok(None) => {}
            Ok(Some(outcome)) => panic!("it ended by {:?}", outcome.end),
            Err(kind) => break kind,
        }
    };
    assert!(matches!(kind, AgentFaultKind::Diverged { .. }), "{kind:?}");
    assert!(
        kind.to_string()
            .contains("made the simulated world diverge")
    );
    assert_eq!(course.diverged(), Some(&kind));
    let outcome = course.failed(Phase::Step, kind, Some("{}".to_owned()));
    let fault = outcome.fault.clone().unwrap();
    // The step was played: it is recorded, and named by the fault.
    assert_eq!(fault.step, Some(outcome.steps - 1));
    assert_eq!(
        (outcome.end, outcome.success),
        (EpisodeEnd::AgentFault, false)
    );

    // The recorded answers lead there again, and no other fault agrees with that.
    let mut course = begin_within(narrow, Told::default());
    let (last, before) = played.actions.split_last().unwrap();
    for action in before {
        assert_eq!(course.answer(action, answered), Ok(None));
        assert_eq!(course.ended_by(fault.clone()), None);
    }
    course.answer(last, answered).unwrap_err();
    assert_eq!(course.sink().course, played.course);
    let with = |change: &dyn Fn(&mut AgentFault)| {
        let mut fault = fault.clone();
        change(&mut fault);
        fault
    };
    for other in [
        with(&|fault| fault.fault = AgentFaultKind::NonFinite),
        with(&|fault| fault.fault = AgentFaultKind::Diverged { detail: "x".into() }),
        with(&|fault| fault.step = Some(outcome.steps)),
        with(&|fault| fault.step = None),
    ] {
        assert_eq!(course.ended_by(other.clone()), None, "{other}");
    }
    assert_eq!(course.ended_by(fault), Some(outcome));

    // What the first ruleset recorded moved without such bounds.
    let mut course = begin_within(Bounds::of(Ruleset::First), Nowhere);
    for action in &played.actions {
        assert!(course.answer(action, answered).is_ok());
    }
}
