//! The Robot Air Hockey Challenge as a competition of the platform: its tasks and its violations.

use faceoff_scoring::{
    COMPUTATION_TIME_MAX_POINTS, COMPUTATION_TIME_MIN_POINTS, EE_POINTS, JOINT_POS_POINTS,
    JOINT_VEL_POINTS, LINK_POINTS,
};
use faceoff_types::{Competition, EPISODE_STEPS, Task, TaskInfo, TaskWeights, ViolationInfo};

/// The description that boards, tables, forms and files are made from.
#[must_use]
pub fn competition() -> Competition {
    Competition {
        id: "airhockey-2023".to_owned(),
        title: "Robot Air Hockey Challenge".to_owned(),
        tasks: vec![
            task(
                Task::Hit,
                "Hit",
                "Score a goal against an opponent that moves in a fixed pattern.",
            ),
            task(
                Task::Defend,
                "Defend",
                "Stop an incoming puck on the agent’s side of the table.",
            ),
            task(
                Task::Prepare,
                "Prepare",
                "Move a puck from the rim to a good hitting position.",
            ),
        ],
        violations: vec![
            violation(
                "ee",
                "end effector",
                "end effector out of bounds",
                EE_POINTS,
            ),
            violation(
                "link",
                "elbow, wrist",
                "elbow or wrist too low",
                LINK_POINTS,
            ),
            violation(
                "joint_pos",
                "joint position",
                "joint position",
                JOINT_POS_POINTS,
            ),
            violation(
                "joint_vel",
                "joint velocity",
                "joint velocity",
                JOINT_VEL_POINTS,
            ),
            ViolationInfo {
                points: [COMPUTATION_TIME_MIN_POINTS, COMPUTATION_TIME_MAX_POINTS],
                ..violation("computation_time", "answer time", "late answers", 0.0)
            },
        ],
    }
}

fn task(task: Task, title: &str, aim: &str) -> TaskInfo {
    TaskInfo {
        task,
        title: title.to_owned(),
        aim: aim.to_owned(),
        weight: TaskWeights::default().weight(task),
        max_steps: EPISODE_STEPS,
    }
}

fn violation(name: &str, title: &str, breach: &str, points: f64) -> ViolationInfo {
    ViolationInfo {
        name: name.to_owned(),
        title: title.to_owned(),
        breach: breach.to_owned(),
        points: [points, points],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_scoring::MAX_EPISODE_PENALTY;

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
        ] {
            assert_ne!(other, hash);
        }
    }

    #[test]
    fn tasks_are_in_the_order_of_results() {
        let tasks: Vec<Task> = competition().task_names().collect();
        assert_eq!(tasks, Task::ALL);
    }
}
