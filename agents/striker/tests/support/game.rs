//! Plays games of two robots in this process, without pipes, clocks and sandbox.

use faceoff_sim::{AirHockeyProfile, Command, Game, GameSetup, GameStep, Interpolation, RallyEnd};
use faceoff_sim::{PerturbationSettings, Plant, ViolatedConstraints};
use faceoff_types::Seed;
use striker::{Env, Policy, Task};

use super::env::env;

/// Index of robot 1, in pairs the first.
pub const ROBOT_1: usize = 0;
/// Index of robot 2.
pub const ROBOT_2: usize = 1;

/// Control of a robot.
pub enum Player {
    /// Keeps the first pose of a rally, as `agents/hold` does: 7 joint positions and 7 zero velocities; `None` before the first step.
    Hold(Option<[f64; 14]>),
    /// An agent in this process.
    Agent(Box<dyn Policy>),
}

impl Player {
    /// A player that keeps the first pose of each rally.
    pub const fn hold() -> Self {
        Self::Hold(None)
    }

    /// An agent for the robot with this index, [`ROBOT_1`] or [`ROBOT_2`].
    pub fn agent<P: Policy + 'static>(
        make_policy: impl Fn(Task, &Env) -> P,
        robot_index: usize,
    ) -> Self {
        Self::Agent(Box::new(make_policy(
            Task::Tournament,
            &env(2, robot_index),
        )))
    }

    pub fn reset(&mut self) {
        match self {
            Self::Hold(pose) => *pose = None,
            Self::Agent(agent) => agent.reset(),
        }
    }

    pub fn act(&mut self, observation: &[f64]) -> [f64; 14] {
        match self {
            Self::Hold(pose) => *pose.get_or_insert_with(|| {
                std::array::from_fn(|i| if i < 7 { observation[6 + i] } else { 0.0 })
            }),
            Self::Agent(agent) => {
                let action = agent.act(observation).expect("an observation of a game");
                std::array::from_fn(|i| action[i / 7][i % 7])
            }
        }
    }
}

/// Penalty points of a window with each violation, in the order of [`Tally::violated_windows`].
const POINTS: [u32; 4] = [3, 3, 2, 1];

/// Result of a game. In pairs robot 1 comes first.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Tally {
    pub score: [u32; 2],
    pub goals: [u32; 2],
    pub fouls: [u32; 2],
    /// Rallies (from one serve to the next) that ended with a stuck puck.
    pub stuck: u32,
    /// Rallies that ended with the puck off the table.
    pub left_table: u32,
    /// Penalty points over all windows (stretches of 500 control steps), without those for computation time.
    pub penalty_points: [u32; 2],
    /// Windows with each violation: end effector, link, joint position, joint velocity.
    pub violated_windows: [[u32; 4]; 2],
}

impl Tally {
    fn count_window(&mut self, violations: &[ViolatedConstraints; 2]) {
        for (robot, v) in violations.iter().enumerate() {
            let violated = [v.ee, v.link, v.joint_pos, v.joint_vel];
            for (k, (is_violated, points)) in violated.into_iter().zip(POINTS).enumerate() {
                self.violated_windows[robot][k] += u32::from(is_violated);
                self.penalty_points[robot] += u32::from(is_violated) * points;
            }
        }
    }
}

/// A new game with the perturbations of `profile`; the seed determines all random draws.
pub fn new_game(profile: AirHockeyProfile, seed: u64) -> Game {
    let seed = Seed::from_number(seed);
    let settings = PerturbationSettings::default();
    Game::new(GameSetup {
        interpolation: [Interpolation::Cubic; 2],
        active_perturbations: profile.active_perturbations(),
        plant: Plant::for_perturbations(
            profile.active_perturbations(),
            &settings,
            seed.model_mismatch(),
        ),
        settings,
        seed,
    })
}

/// Plays `steps` control steps; `on_step` is called after each of them.
pub fn play(
    game: &mut Game,
    players: &mut [Player; 2],
    steps: u32,
    mut on_step: impl FnMut(&Game, &[Player; 2], &GameStep),
) -> Tally {
    let mut tally = Tally::default();
    for player in players.iter_mut() {
        player.reset();
    }
    for _ in 0..steps {
        let actions = [0, 1].map(|robot| players[robot].act(game.observation(robot)));
        let step = game.step([Command::Act(&actions[0]), Command::Act(&actions[1])]);
        on_step(game, players, &step);
        if let Some(violations) = &step.window {
            tally.count_window(violations);
        }
        if let Some(end) = step.rally_end {
            tally.stuck += u32::from(end == RallyEnd::Stuck);
            tally.left_table += u32::from(end == RallyEnd::LeftTable);
            for player in players.iter_mut() {
                player.reset();
            }
        }
    }
    let referee = game.referee();
    tally.score = referee.score();
    tally.goals = referee.goals;
    tally.fouls = referee.fouls;
    tally
}
