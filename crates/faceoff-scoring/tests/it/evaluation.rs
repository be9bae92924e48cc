//! Tests of the scores of episodes, tasks and evaluations (an evaluation is one agent's run of all tasks).

use crate::support::{bounds, episode, task_result, weights};
use faceoff_airhockey::{
    DEFEND, EE, EVALUATION, HIT, IDEAL, JOINT_POS, JOINT_VEL, LINK, PREPARE, competition,
};
use faceoff_scoring::{StepTimes, episode_penalty, score_evaluation, score_task};
use faceoff_types::{
    AgentFault, AgentFaultKind, ComputationTime, EpisodeEnd, Seed, TaskMap, Tier, ViolationName,
};

#[test]
fn violations_have_own_points_and_count_once() {
    let clean = episode(HIT, 0);
    assert_eq!(episode_penalty(&competition(), &clean), 0.0);
    let penalty = |ee, link, joint_pos, joint_vel| {
        let violations = [
            (EE, ee),
            (LINK, link),
            (JOINT_POS, joint_pos),
            (JOINT_VEL, joint_vel),
        ]
        .into_iter()
        .collect();
        episode_penalty(
            &competition(),
            &faceoff_types::EpisodeOutcome {
                violations,
                ..clean.clone()
            },
        )
    };
    assert_eq!(penalty(true, false, false, false), 3.0);
    assert_eq!(penalty(false, true, false, false), 3.0);
    assert_eq!(penalty(false, false, true, false), 2.0);
    assert_eq!(penalty(false, false, false, true), 1.0);
    assert_eq!(penalty(true, true, true, true), 9.0);
}

#[test]
fn agent_fault_is_failure_with_full_time_penalty() {
    let mut faulty = episode(DEFEND, 0);
    faulty.end = EpisodeEnd::AGENT_FAULT;
    faulty.success = true; // must not count after a fault
    faulty.violations = [EE].into();
    faulty.computation_time = ComputationTime {
        mean_s: 0.03,
        max_s: 0.03,
    };
    faulty.fault = Some(AgentFault {
        fault: AgentFaultKind::NonFinite,
        agent_task: DEFEND.into(),
        episode: Some(0),
        step: Some(3),
        line: None,
    });
    assert_eq!(
        episode_penalty(&competition(), &faulty),
        5.0,
        "2 points once, not per cause"
    );
    let result = score_task(&competition(), &[faulty], &StepTimes::default(), bounds());
    assert_eq!(
        (
            result.successes,
            result.violations.get(ViolationName::COMPUTATION_TIME)
        ),
        (0, 1)
    );
}

#[test]
fn task_result_does_not_depend_on_episode_order() {
    let mut outcomes: Vec<_> = (0..50).map(|index| episode(PREPARE, index)).collect();
    for outcome in &mut outcomes[..20] {
        outcome.success = true;
        outcome.steps = 100;
    }
    for outcome in &mut outcomes[10..20] {
        outcome.violations = [EE, JOINT_VEL].into();
    }
    outcomes[3].computation_time = ComputationTime {
        mean_s: 0.001,
        max_s: 0.05,
    };
    let mut times = StepTimes::for_steps(3);
    for time_s in [0.1, 0.2, 0.3] {
        times.add(time_s);
    }
    let result = score_task(&competition(), &outcomes, &times, bounds());
    assert_eq!(
        (result.episodes, result.successes, result.success_rate),
        (50, 20, 0.4)
    );
    assert_eq!(result.penalty_points, 10.0 * 4.0 + 0.5);
    assert_eq!(
        result.tier,
        Some(Tier::Improvable),
        "over 50 episodes: deployable up to 25 points, improvable up to 75"
    );
    assert_eq!(
        (result.violations.get(EE), result.violations.get(JOINT_VEL)),
        (10, 10)
    );
    assert_eq!(
        (
            result.violations.get(LINK),
            result.violations.get(JOINT_POS)
        ),
        (0, 0)
    );
    assert_eq!(result.violations.get(ViolationName::COMPUTATION_TIME), 1);
    assert_eq!(result.steps, 20 * 100 + 30 * 500);

    outcomes.reverse();
    assert_eq!(
        score_task(&competition(), &outcomes, &times, bounds()),
        result
    );
}

#[test]
fn evaluation_has_worst_tier_and_weighted_score() {
    let seed = Seed::from_number(7);
    let tasks = TaskMap::from([
        (HIT, task_result(50, 25, 10.0)),
        (DEFEND, task_result(50, 40, 60.0)),
        (PREPARE, task_result(50, 5, 0.0)),
    ]);
    let result = score_evaluation(
        faceoff_airhockey::RULESET,
        EVALUATION,
        seed,
        &Default::default(),
        &weights(),
        bounds(),
        tasks.clone(),
    );
    assert_eq!((result.score, result.penalty_points), (54.0, 60.0));
    assert_eq!(result.tier, Some(Tier::Improvable));
    assert_eq!(
        (result.ruleset.as_str(), result.profile),
        ("airhockey-2023.3", EVALUATION)
    );
    assert_eq!((result.seed, result.tasks), (seed, tasks.clone()));

    let mut hit_alone = tasks;
    hit_alone.retain(|task, _| *task == HIT);
    let result = score_evaluation(
        faceoff_airhockey::RULESET,
        IDEAL,
        seed,
        &Default::default(),
        &weights(),
        bounds(),
        hit_alone,
    );
    assert_eq!((result.score, result.tier), (20.0, Some(Tier::Deployable)));
    let empty = score_evaluation(
        faceoff_airhockey::RULESET,
        IDEAL,
        seed,
        &Default::default(),
        &weights(),
        bounds(),
        TaskMap::new(),
    );
    assert_eq!((empty.score, empty.penalty_points), (0.0, 0.0));
    assert_eq!(empty.tier, Some(Tier::Deployable));
}

#[test]
fn result_without_tiers_has_no_field_for_them() {
    let task = score_task(
        &competition(),
        &[episode(HIT, 0)],
        &StepTimes::for_steps(0),
        None,
    );
    assert_eq!(task.tier, None);
    let result = score_evaluation(
        faceoff_airhockey::RULESET,
        EVALUATION,
        Seed::from_number(1),
        &Default::default(),
        &weights(),
        None,
        TaskMap::from([(HIT, task)]),
    );
    assert_eq!(result.tier, None);
    let json = serde_json::to_string(&result).unwrap();
    assert!(!json.contains("tier"), "{json}");
    let read: faceoff_types::EvaluationResult = serde_json::from_str(&json).unwrap();
    assert_eq!(read, result);
}

#[test]
fn results_round_trip_as_json() {
    let tasks = TaskMap::from([(HIT, task_result(30, 7, 12.5))]);
    let result = score_evaluation(
        faceoff_airhockey::RULESET,
        EVALUATION,
        Seed::from_number(1),
        &Default::default(),
        &weights(),
        bounds(),
        tasks,
    );
    let json = serde_json::to_string(&result).unwrap();
    assert_eq!(
        serde_json::from_str::<faceoff_types::EvaluationResult>(&json).unwrap(),
        result
    );
    assert!(
        json.contains(r#""success_rate":0.23333333333333334"#),
        "{json}"
    );
}
