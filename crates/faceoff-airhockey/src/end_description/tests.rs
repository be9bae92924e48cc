//! Each kind of end is described in the words that a team reads. States are x, y (m), vx, vy (m/s) of the puck in the table frame.

use super::*;

const DEFEND: Task = AirHockeyTask::Defend.name();
use faceoff_sim::{episode::task, table::puck::Puck};

/// Success and description of an episode that ends in this state; if the state does not end it, the limit of 500 steps does.
fn describe(task: Task, x: f64, y: f64, vx: f64, vy: f64) -> (bool, String) {
    let state = [x, y, 0.0, vx, vy, 0.0];
    let simulated = task.try_into().expect("a task of air hockey");
    let puck = Puck {
        pose: [x, y, 0.0],
        velocity: [vx, vy, 0.0],
    };
    let end = task::end(simulated, &puck, 500).expect("an episode is over after 500 steps");
    (
        task::success(simulated, &puck),
        describe_end(task, end, &state, 500, None),
    )
}

#[test]
fn ends_of_hit_are_described() {
    for (state, success, expected) in [
        (
            [0.98, 0.03, 1.2, 0.0],
            true,
            "goal: puck passed the line x = 0.974 m at y = 0.03 m, inside ±0.125 m, with 1.20 m/s",
        ),
        (
            [0.98, 0.126, 1.2, 0.0],
            false,
            "puck left the table beside the goal: x = 0.98 m, y = 0.13 m, outside ±0.125 m",
        ),
        (
            [-0.98, -0.1, -1.2, 0.0],
            false,
            "own goal: puck passed x = −0.974 m at y = −0.10 m",
        ),
        (
            [0.1, 0.52, 1.2, 3.0],
            false,
            "puck left the table over a long side: x = 0.10 m, y = 0.52 m",
        ),
        (
            [0.1, 0.5, 101.0, 0.0],
            false,
            "puck was lost: its speed exceeded 100 m/s",
        ),
        (
            [0.31, 0.2, -0.42, 0.0],
            false,
            "puck came back without a goal: x = 0.31 m in the opponent's half, moving back at 0.42 m/s",
        ),
        (
            [0.0001, 0.2, -0.0004, 0.0],
            false,
            "puck came back without a goal: x = 0.0001 m in the opponent's half, moving back at 0.0004 m/s",
        ),
        (
            [-0.5, 0.2, 0.0, 0.0],
            false,
            "time was up after 500 steps, without a goal: puck at x = −0.50 m, y = 0.20 m, 0.00 m/s",
        ),
    ] {
        let [x, y, vx, vy] = state;
        assert_eq!(describe(HIT, x, y, vx, vy), (success, expected.to_owned()));
    }
}

#[test]
fn ends_of_defend_are_described() {
    for (state, success, expected) in [
        (
            [-0.55, 0.1, 0.05, 0.0],
            true,
            "puck stopped (below 0.1 m/s) at x = −0.55 m, inside −0.8 … −0.2",
        ),
        (
            [-0.86, 0.1, 0.05, 0.0],
            false,
            "puck stopped (below 0.1 m/s) at x = −0.86 m, outside −0.8 … −0.2",
        ),
        (
            [-0.8001, 0.1, 0.05, 0.0],
            false,
            "puck stopped (below 0.1 m/s) at x = −0.8001 m, outside −0.8 … −0.2",
        ),
        (
            [0.01, 0.1, 0.3, 0.0],
            false,
            "puck was sent back across the middle: x = 0.01 m, vx = 0.30 m/s; it had to stay in the agent's half",
        ),
        (
            [-0.975, 0.0, -1.0, 0.0],
            false,
            "own goal: puck passed x = −0.974 m at y = 0.00 m",
        ),
        (
            [0.975, 0.0, 1.0, 0.0],
            false,
            "puck left through the opponent's goal: puck passed the line x = 0.974 m at y = 0.00 m, inside ±0.125 m, with 1.00 m/s",
        ),
        (
            [-0.5, 0.0, 0.12, 0.0],
            false,
            "time was up after 500 steps: puck at x = −0.50 m, inside −0.8 … −0.2; vx = 0.12 m/s, not below 0.1",
        ),
        (
            [-0.5, 0.0, 0.05, 0.2],
            true,
            "time was up after 500 steps: puck at x = −0.50 m, inside −0.8 … −0.2",
        ),
    ] {
        let [x, y, vx, vy] = state;
        let (is_success, description) = describe(DEFEND, x, y, vx, vy);
        assert_eq!((is_success, description), (success, expected.to_owned()));
    }
}

#[test]
fn ends_of_prepare_are_described() {
    for (state, success, expected) in [
        (
            [-0.5, 0.009, 0.05, 0.0],
            true,
            "puck reached the table's long axis (|y| < 0.01 m) at x = −0.50 m, inside −0.8 … −0.2",
        ),
        (
            [-0.9, 0.009, 0.05, 0.0],
            false,
            "puck reached the table's long axis (|y| < 0.01 m) at x = −0.90 m, outside −0.8 … −0.2",
        ),
        (
            [-0.5, 0.009, 0.2, 0.0],
            false,
            "puck reached the table's long axis (|y| < 0.01 m) at x = −0.50 m, inside −0.8 … −0.2; vx = 0.20 m/s, not below 0.1",
        ),
        (
            [0.02, 0.3, 0.2, 0.0],
            false,
            "puck crossed the middle line: x = 0.02 m, and it had to stay at x ≤ −0.2 m",
        ),
        (
            [-0.5, 0.3, 0.0, 0.0],
            true,
            "time was up after 500 steps: puck at x = −0.50 m, inside −0.8 … −0.2",
        ),
        (
            [-0.5, -0.392, 0.0, 0.0],
            false,
            "time was up after 500 steps: puck at x = −0.50 m, inside −0.8 … −0.2; y = −0.392 m, outside ±0.39105 m",
        ),
        (
            [-0.98, 0.2, -0.5, 0.0],
            false,
            "puck left the table beside the goal: x = −0.98 m, y = 0.20 m, outside ±0.125 m",
        ),
    ] {
        let [x, y, vx, vy] = state;
        let (is_success, description) = describe(PREPARE, x, y, vx, vy);
        assert_eq!((is_success, description), (success, expected.to_owned()));
    }
}

#[test]
fn fault_description_contains_the_fault() {
    let description = |fault| describe_end(HIT, EpisodeEnd::AGENT_FAULT, &[0.0; 6], 3, fault);
    assert_eq!(
        description(Some(&AgentFaultKind::NonFinite)),
        "the agent's fault ended the episode: the action holds a number that is not finite"
    );
    assert_eq!(description(None), "a fault of the agent ended the episode");
}

#[test]
fn described_position_agrees_with_success() {
    for millimetre in -960..0 {
        let x = f64::from(millimetre) / 1000.0;
        let (success, description) = describe(DEFEND, x, 0.2, 0.0, 0.0);
        assert_eq!(success, description.contains("inside"), "{description}");
    }
}
