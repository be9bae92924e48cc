//! A *game* between two agents, robot 1 and robot 2 (0 and 1 in the code). It is a sequence of *rallies*; a rally lasts from a serve to a
//! goal, a foul or another end. Violated constraints are counted per *window*, a part of the game with a fixed number of control steps.

pub mod referee;
mod state;

pub use state::GameState;

use crate::{
    ActivePerturbations,
    channel::{AgentChannel, Command, observation::OBSERVATION_WITH_OPPONENT_LEN},
    episode::{
        constraints::{ConstraintValues, ViolatedConstraints},
        task::PLAYABLE_Y_M,
    },
    perturbation::table_perturbations::TablePerturbations,
    robot::plant::Plant,
    stream::RandomStream,
    world::{Bounds, Divergence, Impacts, World},
};
use crate::{AirHockeyRuleset, Interpolation, PerturbationSettings};
use faceoff_types::{Seed, WINDOW_STEPS};
use referee::{GAME_RULES, RallyEnd, Referee};

/// Settings of a game.
#[derive(Debug, Clone)]
pub struct GameSetup {
    /// How the two agents' actions become trajectories.
    pub interpolation: [Interpolation; 2],
    /// The active kinds of perturbations. Both robots share the table, the puck's tracking and the plant; noise and delays are
    /// separate.
    pub active_perturbations: ActivePerturbations,
    /// Magnitudes of the perturbations.
    pub settings: PerturbationSettings,
    /// The physical properties of both arms; nominal unless the active perturbations contain the model mismatch.
    pub plant: Plant,
    /// The game's seed. The seed of each rally is derived from it and the rally's number.
    pub seed: Seed,
}

/// A running game. It is deterministic: it reads no clock and does no I/O. A clone continues with the same bits.
#[derive(Debug, Clone)]
pub struct Game {
    setup: GameSetup,
    bounds: Bounds,
    referee: Referee,
    rally: Rally,
    /// Control steps so far.
    steps: u32,
    /// Constraints that each robot violated in the current window.
    violations: [ViolatedConstraints; 2],
}

/// What a rally inherits from the earlier part of its game. With the game's setup it determines the start of the rally.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GameProgress {
    /// Number of the rally, from 0.
    pub rally: u32,
    /// Control steps of the game before the rally.
    pub steps: u32,
    /// Goals and fouls before the rally, and who serves.
    pub referee: Referee,
    /// Constraints that each robot violated in the current window before the rally.
    pub violations: [ViolatedConstraints; 2],
}

/// State that is created for each rally.
#[derive(Debug, Clone)]
struct Rally {
    number: u32,
    world: World,
    channels: [AgentChannel; 2],
    table: TablePerturbations,
}

/// Result of a control step of a game. Pairs list robot 1 first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GameStep {
    /// The end of the rally, if this step ended it. The next step belongs to a new rally; the caller resets
    /// both agents.
    pub rally_end: Option<RallyEnd>,
    /// Constraint values after this step; if it ended the rally, still those of the ended rally.
    pub constraints: [ConstraintValues; 2],
    /// The constraints that each robot violated in the window that ends with this step; `None` if no window ends.
    pub window: Option<[ViolatedConstraints; 2]>,
    /// The true state after this step; if it ended the rally, still that of the ended rally.
    pub state: GameState,
    /// Set if this step ended the rally by divergence (the world's state would have left the bounds of the simulation).
    pub divergence: Option<Divergence>,
    /// Had the (simulated) tracking lost the puck after this step?
    pub puck_lost: bool,
    /// The contacts of the puck that began in this step.
    pub impacts: Impacts,
}

impl Game {
    /// A game at the start of its first rally; a random draw decides on which side the puck starts.
    #[must_use]
    pub fn new(setup: GameSetup) -> Self {
        let serving_robot = usize::from(RandomStream::new(&setup.seed, "first_side").unit() < 0.5);
        let bounds = Bounds::of(AirHockeyRuleset::CURRENT);
        let rally = Rally::new(&setup, bounds, 0, serving_robot);
        Self {
            setup,
            bounds,
            referee: Referee::new(serving_robot),
            rally,
            steps: 0,
            violations: [ViolatedConstraints::default(); 2],
        }
    }

    /// A game at the start of a later rally, see [`Self::progress`].
    #[must_use]
    pub fn at_rally(setup: GameSetup, progress: &GameProgress) -> Self {
        let bounds = Bounds::of(AirHockeyRuleset::CURRENT);
        let serving_robot = progress.referee.serving_robot;
        let rally = Rally::new(&setup, bounds, progress.rally, serving_robot);
        Self {
            setup,
            bounds,
            referee: progress.referee.clone(),
            rally,
            steps: progress.steps,
            violations: progress.violations,
        }
    }

    /// The progress of the game, from which [`Self::at_rally`] makes the same game. Call it at the start of a rally: it contains nothing
    /// of what has happened in the rally.
    #[must_use]
    pub fn progress(&self) -> GameProgress {
        GameProgress {
            rally: self.rally.number,
            steps: self.steps,
            referee: self.referee.clone(),
            violations: self.violations,
        }
    }

    /// The same game with other bounds of the simulation than those of the current ruleset.
    #[must_use]
    pub fn with_bounds(mut self, bounds: Bounds) -> Self {
        self.bounds = bounds;
        self.rally.world.set_bounds(bounds);
        self
    }

    /// The observation of a robot's agent: 23 numbers in its own base frame.
    #[must_use]
    pub fn observation(&self, robot: usize) -> &[f64; OBSERVATION_WITH_OPPONENT_LEN] {
        self.rally.channels[robot].observation()
    }

    /// One control step of both robots. The caller decides when the game is over. A world that diverges ends
    /// the rally; the robots at fault are those that `rally_end` names.
    pub fn step(&mut self, commands: [Command<'_>; 2]) -> GameStep {
        let Rally {
            world,
            channels,
            table,
            number,
        } = &mut self.rally;
        for (channel, command) in channels.iter_mut().zip(commands) {
            channel.command(world, command);
        }
        let puck_lost = table.control_step(world);
        for channel in channels {
            channel.update_observation(world, puck_lost);
        }
        self.steps += 1;

        let (state, constraints) = GameState::with_constraints(world);
        for (values, violations) in constraints.iter().zip(&mut self.violations) {
            values.mark(violations);
        }
        let divergence = world.divergence();
        let impacts = *world.impacts();
        let rally_end = match divergence {
            Some(Divergence {
                robots_at_fault, ..
            }) => {
                let end = RallyEnd::Diverged {
                    by: robots_at_fault,
                };
                self.referee.record_end(end);
                Some(end)
            }
            None => self.referee.judge(world.puck()),
        };
        if rally_end.is_some() {
            let next = *number + 1;
            self.rally = Rally::new(&self.setup, self.bounds, next, self.referee.serving_robot);
        }
        let window = self
            .steps
            .is_multiple_of(WINDOW_STEPS)
            .then(|| std::mem::take(&mut self.violations));
        GameStep {
            rally_end,
            constraints,
            window,
            state,
            divergence,
            puck_lost,
            impacts,
        }
    }

    /// Sets the interpolation of a robot's later actions, after a restart of its agent. Call it only between two
    /// rallies: commands of the current rally use the previous interpolation.
    pub fn set_interpolation(&mut self, robot: usize, interpolation: Interpolation) {
        self.setup.interpolation[robot] = interpolation;
        self.rally.channels[robot].set_interpolation(interpolation);
    }

    /// The current true state.
    #[must_use]
    pub fn state(&self) -> GameState {
        GameState::with_constraints(&self.rally.world).0
    }

    #[must_use]
    pub fn steps(&self) -> u32 {
        self.steps
    }

    /// Number of the current rally, from 0.
    #[must_use]
    pub fn rally(&self) -> u32 {
        self.rally.number
    }

    /// Goals and fouls so far.
    #[must_use]
    pub fn referee(&self) -> &Referee {
        &self.referee
    }

    /// The physical world of the current rally.
    #[must_use]
    pub fn world(&self) -> &World {
        &self.rally.world
    }
}

impl Rally {
    /// A rally with both robots in their initial state and the puck at rest on the side of the robot `serving_robot`.
    fn new(setup: &GameSetup, bounds: Bounds, number: u32, serving_robot: usize) -> Self {
        let seed = setup.seed.rally(number);
        let mut stream = RandomStream::new(&seed, "initial_state");
        let [near, far] = GAME_RULES.start_x_m;
        let x = stream.uniform(near, far);
        let y = stream.uniform(-PLAYABLE_Y_M, PLAYABLE_Y_M);
        let x = if serving_robot == 0 { -x } else { x };
        let mut world = World::with_robots(&setup.plant, 2, [x, y, 0.0, 0.0, 0.0, 0.0]);
        world.set_bounds(bounds);
        let table = TablePerturbations::new(
            setup.active_perturbations,
            &setup.settings,
            &seed,
            &mut world,
        );
        let channels = [0, 1].map(|robot| {
            let interpolation = setup.interpolation[robot];
            AgentChannel::new(
                robot,
                interpolation,
                setup.active_perturbations,
                &setup.settings,
                &seed,
                &world,
            )
        });
        Self {
            number,
            world,
            channels,
            table,
        }
    }
}
