//! *Golden* episodes and games: a few fixed ones, with contacts, whose observations and states are hashed. A changed hash
//! means changed behaviour of the simulator, and so of the ruleset.
//!
//! `tests/golden/simulator.txt` holds the hashes. This crate's tests compare what the library computes;
//! `faceoff sim golden` prints the hashes of a built program, so that a release can be checked too.

use crate::AirHockeyTask;
use crate::{
    AirHockeyProfile,
    // What a robot gets from its agent for a control step, over the channel that adds delays and noise.
    channel::Command,
    episode::{Episode, constraints::ViolatedConstraints},
    game::{Game, GameSetup},
    model::{EE_DESIRED_HEIGHT_M, JOINTS},
    robot::{inverse_kinematics::inverse_kinematics, plant::Plant},
};
use crate::{Interpolation, PerturbationSettings};
use faceoff_types::Seed;
use std::fmt;

/// The perturbation profiles: without perturbations, and with those of an evaluation.
const PROFILES: [AirHockeyProfile; 2] = [AirHockeyProfile::Ideal, AirHockeyProfile::Evaluation];

/// Control steps of a golden game: enough for several rallies (the parts of a game from a serve to a goal or foul), and for goals.
const GAME_STEPS: u32 = 3000;

/// Control steps of one stroke of [`scripted_action`].
const STROKE_STEPS: u32 = 40;

/// Seed of all golden episodes and games.
const SEED: u64 = 1;

/// A golden episode or game.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Golden {
    /// The task or `game`, and the profile, e.g. `hit ideal`.
    pub name: String,
    /// The first 16 hexadecimal digits of the BLAKE3 hash of its numbers, which are hashed as little-endian bytes.
    pub hash: String,
}

/// A line of `tests/golden/simulator.txt`.
impl fmt::Display for Golden {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.name, self.hash)
    }
}

/// All golden episodes and games, in the order of `tests/golden/simulator.txt`.
pub fn all() -> impl Iterator<Item = Golden> {
    let episodes = PROFILES
        .into_iter()
        .flat_map(|profile| AirHockeyTask::ALL.map(|task| play_episode(task, profile)));
    let games = PROFILES.into_iter().map(|profile| play_game(profile).0);
    episodes.chain(games)
}

/// Runs a golden episode to its end.
#[must_use]
pub fn play_episode(task: AirHockeyTask, profile: AirHockeyProfile) -> Golden {
    Golden {
        name: format!("{task} {profile}"),
        hash: episode_hash(start_episode(task, profile)),
    }
}

/// Runs a golden game; also returns the game in its final state.
#[must_use]
pub fn play_game(profile: AirHockeyProfile) -> (Golden, Game) {
    let mut game = start_game(profile);
    let golden = Golden {
        name: format!("game {profile}"),
        hash: game_hash(&mut game, GAME_STEPS),
    };
    (golden, game)
}

/// A golden episode at its start.
#[must_use]
pub fn start_episode(task: AirHockeyTask, profile: AirHockeyProfile) -> Episode {
    let (active_perturbations, settings) = (
        profile.active_perturbations(),
        PerturbationSettings::default(),
    );
    let root = Seed::from_number(SEED);
    let plant = Plant::for_perturbations(active_perturbations, &settings, root.model_mismatch());
    Episode::new(
        task,
        Interpolation::Cubic,
        active_perturbations,
        &settings,
        &plant,
        root.episode(task, 0),
    )
}

fn start_game(profile: AirHockeyProfile) -> Game {
    let (active_perturbations, settings) = (
        profile.active_perturbations(),
        PerturbationSettings::default(),
    );
    let seed = Seed::from_number(SEED);
    Game::new(GameSetup {
        interpolation: [Interpolation::Cubic; 2],
        active_perturbations,
        plant: Plant::for_perturbations(active_perturbations, &settings, seed.model_mismatch()),
        settings,
        seed,
    })
}

/// Runs an episode to its end with [`scripted_action`]; returns the hash of all observations and states.
#[must_use]
pub fn episode_hash(mut episode: Episode) -> String {
    let mut hash = Hash::default();
    loop {
        hash.add(episode.observation());
        let action = scripted_action(episode.observation(), episode.steps());
        let outcome = episode.step(&action);
        let state = episode.state();
        hash.add(&state.puck);
        hash.add(&state.q);
        hash.add(&state.dq);
        hash.add(&state.universal);
        hash.add(&state.opponent_q.unwrap_or_default());
        if outcome.end.is_some() {
            return hash.digits();
        }
    }
}

/// The violated constraints of a side in a window (500 control steps of a game). It has the name that
/// [`ViolatedConstraints`] had when the first hashes were made, because its `Debug` text is hashed.
#[derive(Debug)]
#[expect(dead_code, reason = "its fields are read by `Debug`")]
struct Violations {
    ee: bool,
    link: bool,
    joint_pos: bool,
    joint_vel: bool,
}

impl From<ViolatedConstraints> for Violations {
    fn from(violated: ViolatedConstraints) -> Self {
        let ViolatedConstraints {
            ee,
            link,
            joint_pos,
            joint_vel,
        } = violated;
        Self {
            ee,
            link,
            joint_pos,
            joint_vel,
        }
    }
}

/// Continues a game for `steps` control steps, both robots with [`scripted_action`]; returns the hash of
/// observations, pucks, ends of rallies and windows (counts of violations). The last two are hashed as their `Debug` text, so a field of
/// these types cannot be renamed without a change of the hash.
pub fn game_hash(game: &mut Game, steps: u32) -> String {
    let mut hash = Hash::default();
    for _ in 0..steps {
        let actions = [0, 1].map(|robot| scripted_action(game.observation(robot), game.steps()));
        for robot in 0..2 {
            hash.add(game.observation(robot));
        }
        let outcome = game.step(actions.each_ref().map(|action| Command::Act(action)));
        hash.add(&game.world().puck().state());
        let window = outcome.window.map(|sides| sides.map(Violations::from));
        hash.add_text(&format!("{:?} {:?}", outcome.rally_end, window));
    }
    hash.digits()
}

/// The action of a scripted agent that strikes the puck, so that the hashes cover contacts: in strokes of 40 control steps it moves the
/// mallet from behind the puck through the puck's position. `observation` is in the robot's base frame and starts with the puck's x, y (m);
/// the joint positions start at index 6. The action is seven positions (rad) and seven velocities (rad/s). The constants are chosen, not
/// derived.
#[must_use]
pub fn scripted_action(observation: &[f64], step: u32) -> [f64; 2 * JOINTS] {
    let q: [f64; JOINTS] = std::array::from_fn(|i| observation[6 + i]);
    let stroke_m = 0.35 * f64::from(step % STROKE_STEPS) / f64::from(STROKE_STEPS);
    let target = [
        (observation[0] - 0.15 + stroke_m).clamp(0.6, 1.35),
        observation[1].clamp(-0.4, 0.4),
        EE_DESIRED_HEIGHT_M,
    ];
    let next = inverse_kinematics(target, &q);
    let mut action = [0.0; 2 * JOINTS];
    for i in 0..JOINTS {
        // Only a fifth of the way, so that the mallet stays at its height; the velocity covers that way in a control step.
        action[i] = q[i] + 0.2 * (next[i] - q[i]);
        action[JOINTS + i] = 0.2 * (next[i] - q[i]) / 0.02;
    }
    action
}

/// BLAKE3 hash of numbers and text.
#[derive(Default)]
struct Hash(blake3::Hasher);

impl Hash {
    fn add(&mut self, numbers: &[f64]) {
        for number in numbers {
            self.0.update(&number.to_le_bytes());
        }
    }

    fn add_text(&mut self, text: &str) {
        self.0.update(text.as_bytes());
    }

    fn digits(&self) -> String {
        self.0.finalize().to_hex()[..16].to_owned()
    }
}
