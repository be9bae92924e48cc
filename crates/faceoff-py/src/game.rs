//! A game of two robots, driven by the Python half. It consists of rallies: each lasts until a goal, a foul or another
//! reason to put the puck down again.

use crate::{
    actions::{ActionFormat, ActionMode},
    errors::{
        ClosedError, OrderError, argument_error, catch_panic, check_perturbations, simulator_error,
    },
    observation,
};
use faceoff_sim::{
    Command, Factor, Factors, GameSetup, GameState, GameStep, Interpolation, JOINTS,
    PerturbationSettings, Plant, RallyEnd, channel::observation::OBSERVATION_WITH_OPPONENT_LEN,
    model::INITIAL_Q,
};
use faceoff_types::Seed;
use numpy::{PyReadonlyArray1, PyReadwriteArray2, PyUntypedArrayMethods};
use pyo3::{prelude::*, types::PyDict};
use serde::Deserialize;

/// Setup of a game, written by the Python half in JSON. In pairs robot 1 comes first.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Setup {
    interpolation: [Interpolation; 2],
    action_mode: [ActionMode; 2],
    clip_actions: bool,
    factors: Vec<Factor>,
    perturbations: PerturbationSettings,
    /// Seed of the arms' deviation from their model; `None` derives it from the seed of the game.
    mismatch_seed: Option<Seed>,
}

/// A game. The Python half decides when it ends.
#[pyclass(module = "faceoff._native")]
pub struct Game {
    setup: Setup,
    action_formats: [ActionFormat; 2],
    commanded: [[f64; JOINTS]; 2],
    state: State,
}

enum State {
    Unstarted,
    Playing(Box<faceoff_sim::Game>),
    Closed,
    Failed,
}

#[pymethods]
impl Game {
    #[new]
    fn new(setup: &str) -> PyResult<Self> {
        let setup: Setup = serde_json::from_str(setup)
            .map_err(|error| argument_error("setup", "a setup in JSON", error))?;
        check_perturbations(&setup.perturbations)?;
        let action_formats = [0, 1].map(|robot| ActionFormat {
            mode: setup.action_mode[robot],
            interpolation: setup.interpolation[robot],
            clip: setup.clip_actions,
        });
        Ok(Self {
            setup,
            action_formats,
            commanded: [INITIAL_Q; 2],
            state: State::Unstarted,
        })
    }

    /// Begins game `number` of a seed; number 0 is that of `faceoff play`. Writes the observations of both robots,
    /// [2][23].
    fn reset(
        &mut self,
        py: Python<'_>,
        seed: u64,
        number: u32,
        mut observations: PyReadwriteArray2<'_, f32>,
    ) -> PyResult<()> {
        if matches!(self.state, State::Closed) {
            return Err(closed_error());
        }
        let root = Seed::from_number(seed);
        let setup = &self.setup;
        let factors = setup
            .factors
            .iter()
            .fold(Factors::NONE, |set, factor| set.with(*factor));
        let mismatch_seed = setup.mismatch_seed.unwrap_or_else(|| root.model_mismatch());
        let game = py.detach(|| {
            catch_panic(|| {
                Ok(faceoff_sim::Game::new(GameSetup {
                    interpolation: setup.interpolation,
                    factors,
                    settings: setup.perturbations.clone(),
                    plant: Plant::for_factors(factors, &setup.perturbations, mismatch_seed),
                    seed: match number {
                        0 => root,
                        _ => root.derive("game", &number.to_le_bytes()),
                    },
                }))
            })
        })?;
        write_observations(&game, &mut observations)?;
        self.commanded = [INITIAL_Q; 2];
        self.state = State::Playing(Box::new(game));
        Ok(())
    }

    /// One control step of both robots; an arm without an action holds. Writes the observations of both, and returns
    /// the results of the step.
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        actions: [Option<PyReadonlyArray1<'py, f64>>; 2],
        mut observations: PyReadwriteArray2<'_, f32>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let game = self.state.running_game()?;
        let mut commands: [Option<Vec<f64>>; 2] = [None, None];
        let mut commanded = self.commanded;
        for (robot, action) in actions.iter().enumerate() {
            let Some(action) = action else { continue };
            let action = action.as_slice()?;
            let action_format = &self.action_formats[robot];
            if action.len() != action_format.len() {
                let expected = format!("{} numbers for robot {}", action_format.len(), robot + 1);
                return Err(argument_error("action", expected, action.len()));
            }
            action_format.check(action, |_| format!(" of robot {}", robot + 1))?;
            let mut command = vec![0.0; action_format.len()];
            action_format.command(action, &mut commanded[robot], &mut command);
            commands[robot] = Some(command);
        }
        let step = py.detach(|| {
            catch_panic(|| {
                Ok(game.step([0, 1].map(|robot| match &commands[robot] {
                    Some(command) => Command::Act(command),
                    None => Command::Late,
                })))
            })
        });
        let step = match step {
            Ok(step) => step,
            Err(error) => {
                self.state = State::Failed;
                return Err(error);
            }
        };
        self.commanded = match step.rally_end {
            Some(_) => [INITIAL_Q; 2],
            None => commanded,
        };
        write_observations(game, &mut observations)?;
        step_dict(py, game, &step)
    }

    /// The true state: the puck's 6 numbers in the table's frame; for each robot 7 joint positions, 7 joint velocities
    /// and the end effector's 3 coordinates in its own base frame.
    fn state(&mut self) -> PyResult<(Vec<f64>, [Vec<f64>; 2])> {
        Ok(flatten(&self.state.running_game()?.state()))
    }

    /// Releases the game.
    fn close(&mut self) {
        self.state = State::Closed;
    }
}

impl State {
    fn running_game(&mut self) -> PyResult<&mut faceoff_sim::Game> {
        match self {
            Self::Playing(game) => Ok(game),
            Self::Unstarted => Err(OrderError::new_err(
                "expected reset() first, got another call",
            )),
            Self::Closed => Err(closed_error()),
            Self::Failed => Err(simulator_error("an earlier step failed")),
        }
    }
}

fn closed_error() -> PyErr {
    ClosedError::new_err("expected an open environment, got one that was closed: make a new one")
}

fn write_observations(
    game: &faceoff_sim::Game,
    observations: &mut PyReadwriteArray2<'_, f32>,
) -> PyResult<()> {
    const LEN: usize = OBSERVATION_WITH_OPPONENT_LEN;
    if observations.shape() != [2, LEN] {
        let got = format!("one of shape {:?}", observations.shape());
        return Err(argument_error(
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

fn step_dict<'py>(
    py: Python<'py>,
    game: &faceoff_sim::Game,
    step: &GameStep,
) -> PyResult<Bound<'py, PyDict>> {
    let result = PyDict::new(py);
    let (kind, by) = match step.rally_end {
        None => (None, None),
        Some(RallyEnd::Goal { by }) => (Some("goal"), Some(by)),
        Some(RallyEnd::Foul { by }) => (Some("foul"), Some(by)),
        Some(RallyEnd::Stuck) => (Some("stuck"), None),
        Some(RallyEnd::LeftTable) => (Some("left_table"), None),
        Some(RallyEnd::Diverged { .. }) => (Some("diverged"), None),
    };
    let constraints = step
        .constraints
        .map(|values| [values.ee, values.link, values.joint_pos, values.joint_vel]);
    result.set_item("rally_end", kind)?;
    result.set_item("by", by)?;
    result.set_item("constraints", constraints)?;
    result.set_item(
        "diverged",
        step.divergence
            .map_or([false; 2], |divergence| divergence.robots_at_fault),
    )?;
    result.set_item("goals", game.referee().goals)?;
    result.set_item("fouls", game.referee().fouls)?;
    result.set_item("score", game.referee().score())?;
    let (puck, robots) = flatten(&step.state);
    result.set_item("puck", puck)?;
    result.set_item("robots", robots)?;
    Ok(result)
}

fn flatten(state: &GameState) -> (Vec<f64>, [Vec<f64>; 2]) {
    let robots =
        [0, 1].map(|robot| [&state.q[robot][..], &state.dq[robot], &state.ee[robot]].concat());
    (state.puck.to_vec(), robots)
}
