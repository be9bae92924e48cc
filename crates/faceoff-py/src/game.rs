//! A game of two robots, as Python's half drives it.

use crate::{
    actions::{ActionMode, Actions},
    errors::{ClosedError, OrderError, argument, broken, fenced},
    observation,
};
use faceoff_sim::{
    Command, GameSetup, GameState, GameStep, Interpolation, JOINTS, PerturbationSettings, Plant,
    RallyEnd, channel::observation::OBSERVATION_WITH_OPPONENT_LEN, model::INITIAL_Q,
};
use faceoff_types::{Factor, Factors, Seed};
use numpy::{PyReadonlyArray1, PyReadwriteArray2, PyUntypedArrayMethods};
use pyo3::{prelude::*, types::PyDict};
use serde::Deserialize;

/// How a game is played, as Python's half states it in JSON. Pairs are robot 1's first.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Setup {
    interpolation: [Interpolation; 2],
    action_mode: [ActionMode; 2],
    clip_actions: bool,
    factors: Vec<Factor>,
    perturbations: PerturbationSettings,
    mismatch_seed: Option<Seed>,
}

/// A game under way. When it is over is Python's half to decide.
#[pyclass(module = "faceoff._native")]
pub struct Game {
    setup: Setup,
    actions: [Actions; 2],
    commanded: [[f64; JOINTS]; 2],
    state: State,
}

enum State {
    Unstarted,
    Playing(Box<faceoff_sim::Game>),
    Closed,
    Broken,
}

#[pymethods]
impl Game {
    #[new]
    fn new(setup: &str) -> PyResult<Self> {
        let setup: Setup = serde_json::from_str(setup)
            .map_err(|error| argument("setup", "what the environments write", error))?;
        setup
            .perturbations
            .check()
            .map_err(|error| argument("perturbations", "magnitudes that a world has", error))?;
        let actions = [0, 1].map(|robot| Actions {
            mode: setup.action_mode[robot],
            interpolation: setup.interpolation[robot],
            clip: setup.clip_actions,
        });
        Ok(Self {
            setup,
            actions,
            commanded: [INITIAL_Q; 2],
            state: State::Unstarted,
        })
    }

    /// Begins the game of a seed: of number 0 the one that `faceoff play` plays with it. Writes what both are told,
    /// [2][23].
    fn reset(
        &mut self,
        py: Python<'_>,
        seed: u64,
        number: u32,
        mut observations: PyReadwriteArray2<'_, f32>,
    ) -> PyResult<()> {
        if matches!(self.state, State::Closed) {
            return Err(closed());
        }
        let root = Seed::from_number(seed);
        let setup = &self.setup;
        let factors = setup
            .factors
            .iter()
            .fold(Factors::NONE, |set, factor| set.with(*factor));
        let season = setup.mismatch_seed.unwrap_or_else(|| root.model_mismatch());
        let game = py.detach(|| {
            fenced(|| {
                Ok(faceoff_sim::Game::new(GameSetup {
                    interpolation: setup.interpolation,
                    factors,
                    settings: setup.perturbations.clone(),
                    plant: Plant::under(factors, &setup.perturbations, season),
                    seed: match number {
                        0 => root,
                        _ => root.derive("game", &number.to_le_bytes()),
                    },
                }))
            })
        })?;
        write(&game, &mut observations)?;
        self.commanded = [INITIAL_Q; 2];
        self.state = State::Playing(Box::new(game));
        Ok(())
    }

    /// One control step of both robots; an arm without an action holds. Writes what both are told, and returns what it
    /// led to.
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        actions: [Option<PyReadonlyArray1<'py, f64>>; 2],
        mut observations: PyReadwriteArray2<'_, f32>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let game = self.state.playing()?;
        let mut commands: [Option<Vec<f64>>; 2] = [None, None];
        let mut commanded = self.commanded;
        for (robot, action) in actions.iter().enumerate() {
            let Some(action) = action else { continue };
            let action = action.as_slice()?;
            let reader = &self.actions[robot];
            if action.len() != reader.len() {
                let expected = format!("{} numbers for robot {}", reader.len(), robot + 1);
                return Err(argument("action", expected, action.len()));
            }
            reader.check(action, |_| format!(" of robot {}", robot + 1))?;
            let mut command = vec![0.0; reader.len()];
            reader.command(action, &mut commanded[robot], &mut command);
            commands[robot] = Some(command);
        }
        let played = py.detach(|| {
            fenced(|| {
                Ok(game.step([0, 1].map(|robot| match &commands[robot] {
                    Some(command) => Command::Act(command),
                    None => Command::Late,
                })))
            })
        });
        let played = match played {
            Ok(played) => played,
            Err(error) => {
                self.state = State::Broken;
                return Err(error);
            }
        };
        self.commanded = match played.rally_end {
            Some(_) => [INITIAL_Q; 2],
            None => commanded,
        };
        write(game, &mut observations)?;
        tell(py, game, &played)
    }

    /// The true state: the puck's 6 numbers in the table's frame; of each robot joint positions and velocities, 7 each,
    /// and the end effector's 3 in its own base frame.
    fn state(&mut self) -> PyResult<(Vec<f64>, [Vec<f64>; 2])> {
        Ok(flat(&self.state.playing()?.state()))
    }

    /// Gives the game up.
    fn close(&mut self) {
        self.state = State::Closed;
    }
}

impl State {
    fn playing(&mut self) -> PyResult<&mut faceoff_sim::Game> {
        match self {
            Self::Playing(game) => Ok(game),
            Self::Unstarted => Err(OrderError::new_err(
                "expected reset() first, got another call",
            )),
            Self::Closed => Err(closed()),
            Self::Broken => Err(broken("an earlier step did")),
        }
    }
}

fn closed() -> PyErr {
    ClosedError::new_err("expected an open environment, got one that was closed: make a new one")
}

fn write(game: &faceoff_sim::Game, observations: &mut PyReadwriteArray2<'_, f32>) -> PyResult<()> {
    const LEN: usize = OBSERVATION_WITH_OPPONENT_LEN;
    if observations.shape() != [2, LEN] {
        let got = format!("one of shape {:?}", observations.shape());
        return Err(argument(
            "observations",
            format!("an array of shape (2, {LEN})"),
            got,
        ));
    }
    let rows = observations.as_slice_mut()?.chunks_exact_mut(LEN);
    for (robot, row) in rows.enumerate() {
        observation::write(game.observation(robot), row);
    }
    Ok(())
}

fn tell<'py>(
    py: Python<'py>,
    game: &faceoff_sim::Game,
    played: &GameStep,
) -> PyResult<Bound<'py, PyDict>> {
    let told = PyDict::new(py);
    let (kind, by) = match played.rally_end {
        None => (None, None),
        Some(RallyEnd::Goal { by }) => (Some("goal"), Some(by)),
        Some(RallyEnd::Foul { by }) => (Some("foul"), Some(by)),
        Some(RallyEnd::Stuck) => (Some("stuck"), None),
        Some(RallyEnd::LeftTable) => (Some("left_table"), None),
        Some(RallyEnd::Diverged { .. }) => (Some("diverged"), None),
    };
    let constraints = played
        .constraints
        .map(|values| [values.ee, values.link, values.joint_pos, values.joint_vel]);
    told.set_item("rally_end", kind)?;
    told.set_item("by", by)?;
    told.set_item("constraints", constraints)?;
    told.set_item("diverged", played.divergence.map_or([false; 2], |of| of.by))?;
    told.set_item("goals", game.referee().goals)?;
    told.set_item("fouls", game.referee().fouls)?;
    told.set_item("score", game.referee().score())?;
    let (puck, robots) = flat(&played.state);
    told.set_item("puck", puck)?;
    told.set_item("robots", robots)?;
    Ok(told)
}

fn flat(state: &GameState) -> (Vec<f64>, [Vec<f64>; 2]) {
    let robots =
        [0, 1].map(|robot| [&state.q[robot][..], &state.dq[robot], &state.ee[robot]].concat());
    (state.puck.to_vec(), robots)
}
