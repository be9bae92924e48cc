//! Saved states of games.

use super::{
    game::{GameOrigin, ReplayableGame},
    settings::GameSettings,
};
use crate::errors::{argument_error, catch_panic, check_version};
use faceoff_sim::{
    ViolatedConstraints,
    game::{GameProgress, referee::Referee},
};
use pyo3::{
    prelude::*,
    types::{PyBytes, PyDict},
};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The exact state of a game. In memory it is a copy; pickled it is the start of the current rally with the actions since
/// then, which are simulated again on loading.
#[pyclass(frozen, module = "faceoff._native")]
pub struct GameSnapshot {
    pub settings: Arc<GameSettings>,
    pub game: ReplayableGame,
}

/// What a pickled state contains.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SavedGame {
    /// The version of the package that wrote it.
    faceoff: String,
    settings: GameSettings,
    seed: u64,
    /// The game's number among those of its seed.
    number: u32,
    is_over: bool,
    /// Number, control steps of the game, goals, fouls and serving robot at the start of the current rally.
    rally: u32,
    steps: u32,
    goals: [u32; 2],
    fouls: [u32; 2],
    serving_robot: usize,
    /// Whether each robot had violated the constraints ee, link, joint_pos, joint_vel at that time.
    violations: [[bool; 4]; 2],
    /// `None` is a number of a robot that was not commanded.
    actions: Vec<Option<f64>>,
}

#[pymethods]
impl GameSnapshot {
    /// The seed of the game.
    #[getter]
    fn seed(&self) -> u64 {
        self.game.origin.seed
    }

    /// The game's number among those of its seed.
    #[getter]
    fn game_number(&self) -> u32 {
        self.game.origin.number
    }

    /// Control steps of the game so far.
    #[getter]
    fn steps(&self) -> u32 {
        self.game.simulation.steps()
    }

    fn __repr__(&self) -> String {
        format!(
            "<state of a game: seed {}, game {}, step {}>",
            self.game.origin.seed,
            self.game.origin.number,
            self.game.simulation.steps()
        )
    }

    // A snapshot is immutable, so a copy is the same object.
    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyDict>) -> Py<Self> {
        slf
    }

    fn __reduce__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let game = &self.game;
        let GameProgress {
            rally,
            steps,
            referee,
            violations,
        } = &game.rally_start;
        let saved = SavedGame {
            faceoff: env!("CARGO_PKG_VERSION").to_owned(),
            settings: GameSettings::clone(&self.settings),
            seed: game.origin.seed,
            number: game.origin.number,
            is_over: game.is_over,
            rally: *rally,
            steps: *steps,
            goals: referee.goals,
            fouls: referee.fouls,
            serving_robot: referee.serving_robot,
            violations: violations.map(|v| [v.ee, v.link, v.joint_pos, v.joint_vel]),
            actions: game
                .actions
                .iter()
                .map(|number| (!number.is_nan()).then_some(*number))
                .collect(),
        };
        let json = serde_json::to_vec(&saved)
            .map_err(|error| argument_error("state", "a state that can be serialised", error))?;
        let load = py.import("faceoff._native")?.getattr("load_game")?;
        Ok((load, (PyBytes::new(py, &json),)))
    }
}

/// Loads a pickled state by simulating its rally again.
#[pyfunction]
pub fn load_game(py: Python<'_>, data: &[u8]) -> PyResult<GameSnapshot> {
    let saved: SavedGame = serde_json::from_slice(data)
        .map_err(|error| argument_error("state", "a game pickled by faceoff", error))?;
    check_version(&saved.faceoff)?;
    if saved.serving_robot > 1 {
        return Err(argument_error(
            "state",
            "a serving robot of 0 or 1",
            saved.serving_robot,
        ));
    }
    let settings = serde_json::to_string(&saved.settings)
        .map_err(|error| argument_error("state", "valid settings", error))?;
    let settings = GameSettings::read(&settings)?;
    let origin = GameOrigin {
        seed: saved.seed,
        number: saved.number,
    };
    let progress = GameProgress {
        rally: saved.rally,
        steps: saved.steps,
        referee: Referee {
            goals: saved.goals,
            fouls: saved.fouls,
            ..Referee::new(saved.serving_robot)
        },
        violations: saved
            .violations
            .map(|[ee, link, joint_pos, joint_vel]| ViolatedConstraints {
                ee,
                link,
                joint_pos,
                joint_vel,
            }),
    };
    let actions: Vec<f64> = saved
        .actions
        .iter()
        .map(|number| number.unwrap_or(f64::NAN))
        .collect();
    let replay = || ReplayableGame::replay(&settings, origin, &progress, &actions);
    let mut game = py.detach(|| catch_panic(replay))?;
    game.is_over = saved.is_over;
    Ok(GameSnapshot {
        settings: Arc::new(settings),
        game,
    })
}
