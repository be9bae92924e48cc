//! The Robot Air Hockey Challenge as a competition of the platform: its tasks, how their episodes end, and its violations.

mod env;
mod simulator;

pub use simulator::{AirHockey, simulator};

use faceoff_episode::{action_space, recording_columns};
use faceoff_scoring::{
    COMPUTATION_TIME_MAX_POINTS, COMPUTATION_TIME_MIN_POINTS, TIER_BOUNDS,
    tournament::{EE_POINTS, JOINT_POS_POINTS, JOINT_VEL_POINTS, LINK_POINTS},
};
use faceoff_sim::AirHockeyTask;
pub use faceoff_sim::episode::constraints::{EE, JOINT_POS, JOINT_VEL, LINK};
pub use faceoff_sim::episode::ends::{CROSSED_MIDDLE, LEFT_TABLE, REACHED_AXIS, STOPPED};
use faceoff_types::{
    Competition, EPISODE_STEPS, EndInfo, EpisodeEnd, Millionths, Task, TaskInfo, ViolationInfo,
    ViolationName,
};

/// Score a goal.
pub const HIT: Task = AirHockeyTask::Hit.name();
/// Stop an incoming puck.
pub const DEFEND: Task = AirHockeyTask::Defend.name();
/// Move a puck to a good hitting position.
pub const PREPARE: Task = AirHockeyTask::Prepare.name();
/// The tasks in the order of boards.
pub const TASKS: [Task; 3] = [HIT, DEFEND, PREPARE];

/// The description that boards, tables, forms and files are made from.
#[must_use]
pub fn competition() -> Competition {
    Competition {
        id: "airhockey-2023".to_owned(),
        title: "Robot Air Hockey Challenge".to_owned(),
        tasks: vec![
            task(
                HIT,
                "Hit",
                400_000,
                "Score a goal against an opponent that moves in a fixed pattern.",
            ),
            task(
                DEFEND,
                "Defend",
                400_000,
                "Stop an incoming puck on the agent’s side of the table.",
            ),
            task(
                PREPARE,
                "Prepare",
                200_000,
                "Move a puck from the rim to a good hitting position.",
            ),
        ],
        ends: [
            (EpisodeEnd::HORIZON, "time limit reached"),
            (LEFT_TABLE, "puck left the table"),
            (CROSSED_MIDDLE, "puck crossed the middle"),
            (STOPPED, "puck stopped"),
            (REACHED_AXIS, "puck reached the long axis"),
            (EpisodeEnd::AGENT_FAULT, "agent fault"),
        ]
        .map(|(end, title)| EndInfo {
            end,
            title: title.to_owned(),
        })
        .into(),
        violations: vec![
            violation(
                EE,
                [
                    "end effector",
                    "end effector out of bounds",
                    "ee",
                    "End-effector position, metres beyond the bound.",
                ],
                EE_POINTS,
            ),
            violation(
                LINK,
                [
                    "elbow, wrist",
                    "elbow or wrist too low",
                    "link",
                    "Height of elbow and wrist, metres beyond the bound.",
                ],
                LINK_POINTS,
            ),
            violation(
                JOINT_POS,
                [
                    "joint position",
                    "joint position",
                    "pos",
                    "Joint position, rad beyond 95 % of the limit.",
                ],
                JOINT_POS_POINTS,
            ),
            violation(
                JOINT_VEL,
                [
                    "joint velocity",
                    "joint velocity",
                    "vel",
                    "Joint velocity, rad/s beyond 95 % of the limit.",
                ],
                JOINT_VEL_POINTS,
            ),
            ViolationInfo {
                breach: "late answers".to_owned(),
                points: [COMPUTATION_TIME_MIN_POINTS, COMPUTATION_TIME_MAX_POINTS],
                ..violation(
                    ViolationName::COMPUTATION_TIME,
                    [
                        "answer time",
                        "answer time",
                        "time",
                        "Computation time: the episodes with penalty points for it.",
                    ],
                    0.0,
                )
            },
        ],
        actions: action_space(),
        recording: recording_columns(),
        tiers: Some(TIER_BOUNDS),
    }
}

/// `weight` in millionths.
fn task(task: Task, title: &str, weight: u32, aim: &str) -> TaskInfo {
    TaskInfo {
        task,
        title: title.to_owned(),
        aim: aim.to_owned(),
        weight: Millionths::new(weight),
        max_steps: EPISODE_STEPS,
    }
}

/// The texts are title, breach, short heading and measure; the heading of columns is the breach.
fn violation(
    name: ViolationName,
    [title, breach, short, measure]: [&str; 4],
    points: f64,
) -> ViolationInfo {
    ViolationInfo {
        name,
        title: title.to_owned(),
        column: breach.to_owned(),
        breach: breach.to_owned(),
        short: short.to_owned(),
        measure: measure.to_owned(),
        points: [points, points],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_scoring::tournament::MAX_EPISODE_PENALTY;

    #[test]
    fn weights_and_points_sum_to_those_of_the_rules() {
        let competition = competition();
        let weights: f64 = competition
            .tasks
            .iter()
            .map(|task| task.weight.as_f64())
            .sum();
        assert_eq!(weights, 1.0);
        let most: f64 = competition
            .violations
            .iter()
            .map(|violation| violation.points[1])
            .sum();
        assert_eq!(most, MAX_EPISODE_PENALTY);
    }

    #[test]
    fn hash_covers_rules_and_no_texts() {
        let hash = competition().hash();
        let changed = |change: fn(&mut Competition)| {
            let mut other = competition();
            change(&mut other);
            other.hash()
        };
        assert_eq!(changed(|other| other.title.clear()), hash);
        assert_eq!(changed(|other| other.tasks[0].aim.clear()), hash);
        assert_eq!(changed(|other| other.violations[0].breach.clear()), hash);
        for other in [
            changed(|other| other.id.push('x')),
            changed(|other| other.tasks[0].max_steps += 1),
            changed(|other| other.tasks.swap(0, 1)),
            changed(|other| other.violations[0].points[1] += 1.0),
            changed(|other| other.tiers = None),
        ] {
            assert_ne!(other, hash);
        }
    }

    #[test]
    fn tasks_are_in_the_order_of_results() {
        let tasks: Vec<Task> = competition().task_names().collect();
        assert_eq!(tasks, TASKS);
    }
}
