//! Games of two robots, driven by the Python half: one for PettingZoo, or many for training.

mod game;
mod rows;
mod settings;
mod snapshot;

pub use rows::{GAME_INFO_LEN, GAME_STATE_LEN, RALLY_ENDS};
pub use snapshot::{GameSnapshot, load_game};

use crate::{
    errors::{
        OrderError, argument_error, borrow_mut, catch_panic, closed_error, missing_reset_error,
        simulator_error,
    },
    pool::{Pool, pool_if_parallel},
    step::Autoreset,
};
use game::{GameOrigin, ReplayableGame};
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use rayon::prelude::*;
use rows::{GameArrays, GameRow, flatten, games_with_rows};
use settings::GameSettings;
use std::sync::Arc;

/// Games with the same settings, for environments of one game or of many.
#[pyclass(module = "faceoff._native")]
pub struct Games {
    settings: Arc<GameSettings>,
    autoreset: Autoreset,
    /// Number of games.
    count: usize,
    pool: Pool,
    state: State,
}

enum State {
    /// Empty before the first reset.
    Open(Vec<ReplayableGame>),
    Closed,
    /// A step panicked.
    Failed,
}

#[pymethods]
impl Games {
    /// Arguments were checked by the Python half. The first reset creates the games.
    #[new]
    fn new(setup: &str, count: usize, threads: usize, autoreset: &str) -> PyResult<Self> {
        if count == 0 || threads == 0 {
            return Err(argument_error("games, threads", "at least 1", 0));
        }
        Ok(Self {
            settings: Arc::new(GameSettings::read(setup)?),
            autoreset: Autoreset::read(autoreset)?,
            count,
            pool: Pool::new(threads),
            state: State::Open(Vec::new()),
        })
    }

    /// Starts the games for which `mask` is true: number 0 of their seed, or, without a seed, the one after their last game. Rows of
    /// other games are not written.
    fn reset(
        slf: &Bound<'_, Self>,
        py: Python<'_>,
        mask: PyReadonlyArray1<'_, bool>,
        seeds: Vec<Option<u64>>,
        mut rows: GameArrays<'_>,
    ) -> PyResult<()> {
        let this = &mut *borrow_mut(slf)?;
        let mut rows = rows.rows(this.count)?;
        let mask = mask.as_slice()?;
        if mask.len() != this.count || seeds.len() != this.count {
            let expected = format!("one for each of {} games", this.count);
            return Err(argument_error("mask, seeds", expected, mask.len()));
        }
        let games = this.state.open_games()?;
        if games.is_empty() && (mask.contains(&false) || seeds.contains(&None)) {
            return Err(OrderError::new_err(
                "reset: expected a reset of all games first, got one of some",
            ));
        }
        let settings = &*this.settings;
        let origin = |seed: Option<u64>, game: Option<&ReplayableGame>| match (seed, game) {
            (Some(seed), _) => GameOrigin { seed, number: 0 },
            (None, previous) => GameOrigin {
                seed: previous.map_or(0, |game| game.origin.seed),
                number: previous.map_or(0, |game| game.origin.number.wrapping_add(1)),
            },
        };
        let pool = pool_if_parallel(&mut this.pool)?;
        let started: Vec<Option<ReplayableGame>> = py.detach(|| {
            catch_panic(|| {
                let start = |index: usize| {
                    let previous = games.get(index);
                    let origin = origin(seeds[index], previous);
                    mask[index].then(|| ReplayableGame::start(settings, origin, previous))
                };
                Ok(match pool {
                    None => (0..mask.len()).map(start).collect(),
                    Some(pool) => {
                        pool.install(|| (0..mask.len()).into_par_iter().map(start).collect())
                    }
                })
            })
        })?;
        let is_first = games.is_empty();
        for (index, started) in started.into_iter().enumerate() {
            let Some(game) = started else { continue };
            rows[index].write_start(&game);
            if is_first {
                games.push(game);
            } else {
                games[index] = game;
            }
        }
        Ok(())
    }

    /// One control step of every game; `actions` are those of robot 1 and of robot 2, [games][action], or `None` if that
    /// robot's arm holds. The interpreter's lock is released.
    fn step(
        slf: &Bound<'_, Self>,
        py: Python<'_>,
        actions: [Option<PyReadonlyArray2<'_, f64>>; 2],
        mut rows: GameArrays<'_>,
    ) -> PyResult<()> {
        let this = &mut *borrow_mut(slf)?;
        let mut rows = rows.rows(this.count)?;
        let mut actions_by_robot: [Option<&[f64]>; 2] = [None, None];
        for (robot, array) in actions.iter().enumerate() {
            if let Some(array) = array {
                actions_by_robot[robot] = Some(this.check_actions(robot, array)?);
            }
        }
        let lens = this.settings.action_formats().map(|format| format.len());
        let (settings, autoreset) = (&*this.settings, this.autoreset);
        let pool = pool_if_parallel(&mut this.pool)?;
        let games = this.state.open_games()?;
        check_call_order(games, autoreset)?;
        let step = |index: usize, game: &mut ReplayableGame, row: &mut GameRow<'_>| {
            let game_actions = [0, 1].map(|robot: usize| {
                let len = lens[robot];
                actions_by_robot[robot].map(|actions| &actions[index * len..][..len])
            });
            step_one(settings, autoreset, game, game_actions, row);
        };
        // A panic leaves games in the middle of a step, so all of them become unusable.
        let stepped = py.detach(|| {
            catch_panic(|| {
                match pool {
                    None => {
                        for (index, (game, row)) in games.iter_mut().zip(&mut rows).enumerate() {
                            step(index, game, row);
                        }
                    }
                    Some(pool) => pool.install(|| {
                        games_with_rows(games, &mut rows)
                            .enumerate()
                            .for_each(|(index, (game, row))| step(index, game, row));
                    }),
                }
                Ok(())
            })
        });
        if stepped.is_err() {
            this.state = State::Failed;
        }
        stepped
    }

    /// The exact state of a game.
    fn save(slf: &Bound<'_, Self>, index: usize) -> PyResult<GameSnapshot> {
        let this = &mut *borrow_mut(slf)?;
        let settings = Arc::clone(&this.settings);
        let game = this.game(index)?.clone();
        Ok(GameSnapshot { settings, game })
    }

    /// Restores a state that was saved in an environment with the same settings, and writes the game's row. Before the
    /// first reset there are no games yet: then they are restored one after another, from index 0 on.
    fn restore(
        slf: &Bound<'_, Self>,
        index: usize,
        snapshot: &Bound<'_, GameSnapshot>,
        mut rows: GameArrays<'_>,
    ) -> PyResult<()> {
        let this = &mut *borrow_mut(slf)?;
        let snapshot = snapshot.get();
        if *snapshot.settings != *this.settings {
            return Err(argument_error(
                "state",
                "one of an environment with the same actions, interpolation, perturbations and length of games",
                "one of another environment",
            ));
        }
        let mut rows = rows.rows(this.count)?;
        let count = this.count;
        let games = this.state.open_games()?;
        if games.len() == index && index < count {
            games.push(snapshot.game.clone());
        }
        let game = this.game(index)?;
        game.clone_from(&snapshot.game);
        rows[index].write_start(game);
        Ok(())
    }

    /// The seed and number of each game.
    fn origins(slf: &Bound<'_, Self>) -> PyResult<Vec<(u64, u32)>> {
        let this = &mut *borrow_mut(slf)?;
        let origin = |game: &ReplayableGame| (game.origin.seed, game.origin.number);
        Ok(this.state.open_games()?.iter().map(origin).collect())
    }

    /// The present true state of a game, [`GAME_STATE_LEN`] numbers.
    fn state(slf: &Bound<'_, Self>, index: usize) -> PyResult<Vec<f64>> {
        let this = &mut *borrow_mut(slf)?;
        Ok(flatten(&this.game(index)?.simulation.state()))
    }

    /// Number of threads of the pool.
    #[getter]
    fn threads(slf: &Bound<'_, Self>) -> PyResult<usize> {
        Ok(borrow_mut(slf)?.pool.threads())
    }

    /// Releases games and threads. Later calls are refused.
    fn close(slf: &Bound<'_, Self>) -> PyResult<()> {
        let this = &mut *borrow_mut(slf)?;
        this.state = State::Closed;
        this.pool = Pool::new(this.pool.threads());
        Ok(())
    }
}

impl Games {
    fn check_actions<'a>(
        &self,
        robot: usize,
        actions: &'a PyReadonlyArray2<'_, f64>,
    ) -> PyResult<&'a [f64]> {
        let format = &self.settings.action_formats()[robot];
        if actions.shape() != [self.count, format.len()] {
            return Err(argument_error(
                "actions",
                format!("an array of shape ({}, {})", self.count, format.len()),
                format!("one of shape {:?}", actions.shape()),
            ));
        }
        let actions = actions.as_slice()?;
        let is_single = self.count == 1;
        format.check(actions, |index| {
            let robot = robot + 1;
            if is_single {
                format!(" of robot_{robot}")
            } else {
                format!(" of robot_{robot} in game {index}")
            }
        })?;
        Ok(actions)
    }

    fn game(&mut self, index: usize) -> PyResult<&mut ReplayableGame> {
        let count = self.count;
        let games = self.state.open_games()?;
        if games.is_empty() {
            return Err(missing_reset_error());
        }
        games
            .get_mut(index)
            .ok_or_else(|| argument_error("index", format!("below {count}"), index))
    }
}

impl State {
    fn open_games(&mut self) -> PyResult<&mut Vec<ReplayableGame>> {
        match self {
            Self::Open(games) => Ok(games),
            Self::Closed => Err(closed_error()),
            Self::Failed => Err(simulator_error("an earlier step failed")),
        }
    }
}

/// Steps a game, or starts the next one if it is over.
fn step_one(
    settings: &GameSettings,
    autoreset: Autoreset,
    game: &mut ReplayableGame,
    actions: [Option<&[f64]>; 2],
    row: &mut GameRow<'_>,
) {
    if game.is_over {
        game.start_next(settings);
        row.write_start(game);
        return;
    }
    let before = game.simulation.referee().score();
    let step = game.step(settings, actions);
    let after = game.simulation.referee().score();
    let points = [0, 1].map(|robot| after[robot] - before[robot]);
    row.write_step(game, &step, points);
    if game.is_over && autoreset == Autoreset::SameStep {
        game.start_next(settings);
        row.write_successor(game);
    }
}

fn check_call_order(games: &[ReplayableGame], autoreset: Autoreset) -> PyResult<()> {
    if games.is_empty() {
        return Err(missing_reset_error());
    }
    if autoreset != Autoreset::Disabled {
        return Ok(());
    }
    match games.iter().position(|game| game.is_over) {
        None => Ok(()),
        Some(_) if games.len() == 1 => Err(OrderError::new_err(
            "step: expected a game under way, got one that has ended: call reset() first",
        )),
        Some(index) => Err(OrderError::new_err(format!(
            "step: expected games under way, but game {index} has ended: call \
             reset(options={{\"reset_mask\": mask}}) first"
        ))),
    }
}
