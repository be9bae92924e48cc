//! The Robot Air Hockey Challenge as a competition of the platform: its description (tasks, ends of episodes, violations, and profiles,
//! which are sets of perturbations), its world, and games of two agents. The effects of answers in games and the content of their
//! recordings are decided here only.
//!
//! This crate starts no process, opens no file and reads no clock.

mod columns;
mod drawings;
mod end_description;
mod game_record;
mod hello_env;
mod magnitudes;
mod running_game;
mod running_side;
mod simulation_setup;
mod simulator;
mod world;

pub use columns::{action_space, recording_columns};
pub use end_description::{OWN_GOAL, PUCK_TOO_FAST, SLOW_GOAL, describe_end};
pub use game_record::{
    Effect, GameSink, GameStepRow, RallyEnding, RallyReadiness, RallyRow, RallyStart, Response,
    SideFault, SideStep,
};
pub use running_game::{FinishedGame, RunningGame};
pub use simulation_setup::SimulationSetup;
pub use simulator::{AirHockey, checked_magnitudes, simulation_setup, simulator};
pub use world::AirHockeyWorld;

use faceoff_scoring::{
    COMPUTATION_TIME_MAX_POINTS, COMPUTATION_TIME_MIN_POINTS, TIER_BOUNDS,
    tournament::{EE_POINTS, JOINT_POS_POINTS, JOINT_VEL_POINTS, LINK_POINTS},
};
pub use faceoff_sim::Interpolation;
pub use faceoff_sim::episode::constraints::{EE, JOINT_POS, JOINT_VEL, LINK};
pub use faceoff_sim::episode::ends::{CROSSED_MIDDLE, LEFT_TABLE, REACHED_AXIS, STOPPED};
use faceoff_sim::{AirHockeyProfile, AirHockeyRuleset, AirHockeyTask};
use faceoff_types::{
    ACTION_LIMIT, CONTROL_STEP_S, Competition, EPISODE_STEPS, EndInfo, EpisodeEnd, Millionths,
    Profile, ProfileInfo, Ruleset, RulesetInfo, Task, TaskInfo, ViolationInfo, ViolationName,
};

/// Score a goal.
pub const HIT: Task = AirHockeyTask::Hit.name();
/// Stop an incoming puck.
pub const DEFEND: Task = AirHockeyTask::Defend.name();
/// Move a puck to a good hitting position.
pub const PREPARE: Task = AirHockeyTask::Prepare.name();
/// The tasks in the order of boards.
pub const TASKS: [Task; 3] = [HIT, DEFEND, PREPARE];

/// The versions of simulator and scoring, oldest first; see [`AirHockeyRuleset`].
pub const RULESETS: [Ruleset; 3] = [
    AirHockeyRuleset::First.name(),
    AirHockeyRuleset::Second.name(),
    AirHockeyRuleset::Third.name(),
];
/// The ruleset of new evaluations.
pub const RULESET: Ruleset = AirHockeyRuleset::CURRENT.name();

/// The simulator that teams have, without perturbations.
pub const IDEAL: Profile = AirHockeyProfile::Ideal.name();
/// Masses, gains and friction of the *plant*, the robot in the evaluator's simulator, differ from the nominal model that teams have.
pub const MODEL_MISMATCH: Profile = AirHockeyProfile::ModelMismatch.name();
/// Noise on the observations.
pub const OBSERVATION_NOISE: Profile = AirHockeyProfile::ObservationNoise.name();
/// Air flow pushes a moving puck.
pub const DISTURBANCE: Profile = AirHockeyProfile::Disturbance.name();
/// The puck's pose freezes for some steps.
pub const TRACKING_LOSS: Profile = AirHockeyProfile::TrackingLoss.name();
/// Delays, and tilt and friction of the table, as in a real laboratory; for rehearsals on a robot.
pub const DELAY: Profile = AirHockeyProfile::Delay.name();
/// Model mismatch, noise, disturbance and tracking loss together; for evaluations that count.
pub const EVALUATION: Profile = AirHockeyProfile::Evaluation.name();
/// The profiles of an ablation: no perturbation, each one of [`EVALUATION`] alone, and all of them; not [`DELAY`].
pub const ABLATION_PROFILES: [Profile; 6] = [
    IDEAL,
    MODEL_MISMATCH,
    OBSERVATION_NOISE,
    DISTURBANCE,
    TRACKING_LOSS,
    EVALUATION,
];

/// The description that boards, tables, forms and files are made from.
#[must_use]
pub fn competition() -> Competition {
    Competition {
        id: "airhockey-2023".to_owned(),
        title: "Robot Air Hockey Challenge".to_owned(),
        short_title: "Robot Air Hockey".to_owned(),
        subject: "robot air hockey".to_owned(),
        summary: "Teams write programs that play air hockey with a simulated KUKA arm. Every day all of them face the same new \
                  episodes; the board shows who succeeds most often, and who would be safe on a real robot."
            .to_owned(),
        rulesets: AirHockeyRuleset::ALL.map(ruleset).into(),
        has_replays: true,
        has_games: true,
        tasks: vec![
            TaskInfo {
                aim: "Score against a goalkeeper that moves in a fixed pattern.".to_owned(),
                achievement: "goal".to_owned(),
                drawing: drawings::HIT.to_owned(),
                ..task(HIT, "Hit", 400_000)
            },
            TaskInfo {
                aim: "Stop an incoming puck on the agent’s side of the table.".to_owned(),
                achievement: "stop".to_owned(),
                drawing: drawings::DEFEND.to_owned(),
                ..task(DEFEND, "Defend", 400_000)
            },
            TaskInfo {
                aim: "Move a puck from the rim to a good hitting position.".to_owned(),
                achievement: "preparation".to_owned(),
                drawing: drawings::PREPARE.to_owned(),
                ..task(PREPARE, "Prepare", 200_000)
            },
        ],
        ends: [
            (EpisodeEnd::HORIZON, "time limit reached"),
            (LEFT_TABLE, "puck left the table (goal or elsewhere)"),
            (CROSSED_MIDDLE, "puck crossed the middle or came back"),
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
                description: "late answers".to_owned(),
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
        profiles: vec![
            profile(
                IDEAL,
                'I',
                "ideal",
                "The simulator that the teams have, without perturbations.",
            ),
            profile(
                MODEL_MISMATCH,
                'M',
                "model mismatch",
                "Model mismatch alone.",
            ),
            profile(
                OBSERVATION_NOISE,
                'N',
                "observation noise",
                "Observation noise alone.",
            ),
            profile(
                DISTURBANCE,
                'D',
                "disturbance",
                "Air-flow disturbance alone.",
            ),
            profile(TRACKING_LOSS, 'T', "tracking loss", "Tracking loss alone."),
            profile(
                DELAY,
                'L',
                "delay",
                "Delays, tilt and friction as in a real laboratory, alone.",
            ),
            profile(
                EVALUATION,
                'E',
                "evaluation (M, N, D and T together)",
                "Model mismatch, noise, disturbance and tracking loss together; used for evaluations that count.",
            ),
        ],
        ideal_profile: IDEAL,
        counting_profile: EVALUATION,
        magnitudes: magnitudes::magnitudes(),
    }
}

const fn ruleset(ruleset: AirHockeyRuleset) -> RulesetInfo {
    RulesetInfo {
        ruleset: ruleset.name(),
        action_limit: match ruleset {
            // It only required finite numbers.
            AirHockeyRuleset::First => f64::MAX,
            AirHockeyRuleset::Second | AirHockeyRuleset::Third => ACTION_LIMIT,
        },
    }
}

/// A task without its descriptive texts. `weight` is in millionths.
fn task(task: Task, title: &str, weight: u32) -> TaskInfo {
    TaskInfo {
        task,
        title: title.to_owned(),
        aim: String::new(),
        achievement: String::new(),
        drawing: String::new(),
        weight: Millionths::new(weight),
        max_steps: EPISODE_STEPS,
        control_step_s: CONTROL_STEP_S,
    }
}

fn profile(profile: Profile, letter: char, title: &str, description: &str) -> ProfileInfo {
    ProfileInfo {
        profile,
        title: title.to_owned(),
        description: description.to_owned(),
        letter,
        is_in_ablations: ABLATION_PROFILES.contains(&profile),
    }
}

/// A kind of violation. `description` is also the heading of columns; `short` is a short heading, and `measure` the measured
/// quantity with its unit.
fn violation(
    name: ViolationName,
    [title, description, short, measure]: [&str; 4],
    points: f64,
) -> ViolationInfo {
    ViolationInfo {
        name,
        title: title.to_owned(),
        column_heading: description.to_owned(),
        description: description.to_owned(),
        short: short.to_owned(),
        measure: measure.to_owned(),
        points: [points, points],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_scoring::tournament::MAX_EPISODE_PENALTY;
    use faceoff_types::{ProfileMap, StageRules, Variation};
    use std::collections::HashSet;

    #[test]
    fn weights_and_points_sum_to_those_of_the_rules() {
        let competition = competition();
        let weights: f64 = competition
            .tasks
            .iter()
            .map(|task| task.weight.as_f64())
            .sum();
        assert_eq!(weights, 1.0);
        let max_points: f64 = competition
            .violations
            .iter()
            .map(|violation| violation.points[1])
            .sum();
        assert_eq!(max_points, MAX_EPISODE_PENALTY);
    }

    #[test]
    fn profiles_are_those_of_the_simulator_with_unique_letters() {
        let competition = competition();
        let names: Vec<_> = competition.profile_names().collect();
        assert_eq!(names, AirHockeyProfile::ALL.map(AirHockeyProfile::name));
        let letters: HashSet<char> = competition
            .profiles
            .iter()
            .map(|info| info.letter)
            .collect();
        assert_eq!(letters.len(), names.len());
        let ablated: Vec<_> = competition.ablation_profiles().collect();
        assert_eq!(ablated, ABLATION_PROFILES);
        assert_eq!(competition.find_profile("delay"), Ok(DELAY));
        assert_eq!(
            competition.find_profile("easy").unwrap_err().to_string(),
            "unknown profile \"easy\": expected ideal, model_mismatch, observation_noise, disturbance, tracking_loss, delay or evaluation"
        );
    }

    #[test]
    fn rules_are_checked_and_map_is_sorted_by_profile() {
        let competition = competition();
        let mut rules = StageRules {
            ruleset: RULESET,
            profile: DELAY,
            tasks: TASKS.to_vec(),
            episodes_per_task: 1,
            max_faults: 0,
            variation: Variation::default(),
            limits: Default::default(),
            runtimes: None,
        };
        assert_eq!(competition.check_and_normalise_rules(&mut rules), Ok(()));
        rules.profile = Profile::new("easy");
        let refused = competition
            .check_and_normalise_rules(&mut rules)
            .unwrap_err();
        assert_eq!(refused.field(), "profile");
        let mut map = ProfileMap::from([(rules.profile, 0), (EVALUATION, 1), (IDEAL, 2)]);
        competition.sort_profiles(&mut map);
        let sorted: Vec<_> = map.into_keys().collect();
        assert_eq!(sorted, [IDEAL, EVALUATION, rules.profile]);
    }

    #[test]
    fn competition_hash_covers_rules_but_not_texts() {
        let hash = competition().hash();
        let changed = |change: fn(&mut Competition)| {
            let mut other = competition();
            change(&mut other);
            other.hash()
        };
        assert_eq!(changed(|other| other.title.clear()), hash);
        assert_eq!(changed(|other| other.tasks[0].aim.clear()), hash);
        assert_eq!(
            changed(|other| other.violations[0].description.clear()),
            hash
        );
        for other in [
            changed(|other| other.id.push('x')),
            changed(|other| other.tasks[0].max_steps += 1),
            changed(|other| other.tasks.swap(0, 1)),
            changed(|other| drop(other.profiles.pop())),
            changed(|other| other.violations[0].points[1] += 1.0),
            changed(|other| other.tiers = None),
        ] {
            assert_ne!(other, hash);
        }
    }

    #[test]
    fn inconsistent_competition_is_refused() {
        assert_eq!(competition().check(), Ok(()));
        let refused = |change: fn(&mut Competition)| {
            let mut other = competition();
            change(&mut other);
            other.check().unwrap_err()
        };
        for (problem, words) in [
            (
                refused(|other| other.actions.agents_choose_layout = false),
                "layouts",
            ),
            (refused(|other| other.actions.layouts.clear()), "layout"),
            (refused(|other| other.profiles.clear()), "profile"),
            (refused(|other| other.recording.limits.truncate(3)), "limit"),
            (refused(|other| drop(other.violations.remove(0))), "limit"),
        ] {
            assert!(problem.contains(words), "{problem}");
        }
    }

    #[test]
    fn tasks_are_in_the_order_of_results() {
        let tasks: Vec<Task> = competition().task_names().collect();
        assert_eq!(tasks, TASKS);
    }
}
