//! Output arrays of the games' steps, a row per game, in memory of Python. The *info* of a game is 23 numbers about its last
//! step, such as the score.

use super::game::ReplayableGame;
use crate::{errors::argument_error, observation};
use faceoff_sim::{
    Game, GameState, GameStep, JOINTS, RallyEnd,
    channel::observation::OBSERVATION_WITH_OPPONENT_LEN,
};
use numpy::{PyReadwriteArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use rayon::prelude::*;

/// Names of the reasons why a rally ends; their positions are the codes in [`GameRow::write_game_info`].
pub const RALLY_ENDS: [&str; 5] = ["goal", "foul", "stuck", "left_table", "diverged"];

/// Count of numbers in a game's info; see [`GameRow::write_game_info`].
pub const GAME_INFO_LEN: usize = 23;

/// Count of numbers in a true state: the puck's 6 in the table frame; for each robot its joint positions and velocities (7
/// each), and the end effector's 3 in its own base frame.
pub const GAME_STATE_LEN: usize = 6 + 2 * (2 * JOINTS + 3);

const OBSERVATIONS_LEN: usize = 2 * OBSERVATION_WITH_OPPONENT_LEN;

/// The arrays, allocated by the Python half: observations, final observations, infos, true states. The first two have two rows per
/// game, robot 1 first; the others have one.
#[derive(FromPyObject)]
pub struct GameArrays<'py>(
    PyReadwriteArray2<'py, f32>,
    PyReadwriteArray2<'py, f32>,
    PyReadwriteArray2<'py, f64>,
    PyReadwriteArray2<'py, f64>,
);

/// The part of each array that belongs to one game.
pub struct GameRow<'a> {
    observations: &'a mut [f32],
    final_observations: &'a mut [f32],
    game_info: &'a mut [f64],
    state: &'a mut [f64],
}

impl GameArrays<'_> {
    /// The rows of `games` games.
    ///
    /// # Errors
    /// If an array has another shape or is not contiguous.
    pub fn rows(&mut self, games: usize) -> PyResult<Vec<GameRow<'_>>> {
        let Self(observations, finals, game_info, states) = self;
        let check_shape = |name, shape: &[usize], rows, width| {
            if shape == [rows, width] {
                return Ok(());
            }
            let expected = format!("an array of shape ({rows}, {width})");
            Err(argument_error(
                name,
                expected,
                format!("one of shape {shape:?}"),
            ))
        };
        let width = OBSERVATION_WITH_OPPONENT_LEN;
        check_shape("observations", observations.shape(), 2 * games, width)?;
        check_shape("final observations", finals.shape(), 2 * games, width)?;
        check_shape("game_info", game_info.shape(), games, GAME_INFO_LEN)?;
        check_shape("states", states.shape(), games, GAME_STATE_LEN)?;
        let observations = observations
            .as_slice_mut()?
            .chunks_exact_mut(OBSERVATIONS_LEN);
        let finals = finals.as_slice_mut()?.chunks_exact_mut(OBSERVATIONS_LEN);
        let game_info = game_info.as_slice_mut()?.chunks_exact_mut(GAME_INFO_LEN);
        let states = states.as_slice_mut()?.chunks_exact_mut(GAME_STATE_LEN);
        Ok(observations
            .zip(finals)
            .zip(game_info.zip(states))
            .map(
                |((observations, final_observations), (game_info, state))| GameRow {
                    observations,
                    final_observations,
                    game_info,
                    state,
                },
            )
            .collect())
    }
}

impl GameRow<'_> {
    /// Writes the row of a game that was started or restored.
    pub fn write_start(&mut self, game: &ReplayableGame) {
        write_both(&game.simulation, self.observations);
        self.state
            .copy_from_slice(&flatten(&game.simulation.state()));
        self.game_info.fill(0.0);
        self.game_info[..2].fill(-1.0);
        self.write_counts(game, [0; 2]);
    }

    /// Writes the row of a game after a step that gained these points for each side.
    pub fn write_step(&mut self, game: &ReplayableGame, step: &GameStep, points: [u32; 2]) {
        write_both(&game.simulation, self.observations);
        self.state.copy_from_slice(&flatten(&step.state));
        self.write_game_info(game, step, points);
    }

    /// Writes the observations of a new game; those of the game before it become the final ones.
    pub fn write_successor(&mut self, next: &ReplayableGame) {
        self.final_observations.copy_from_slice(self.observations);
        write_both(&next.simulation, self.observations);
    }

    /// Writes the game's info: code of the rally's end in [`RALLY_ENDS`] and the robot that brought it about (−1: none), 2 × 4 constraint values (ee,
    /// link, joint_pos, joint_vel), whether each robot has made the world diverge, goals, fouls, score, points of the
    /// step, control steps of the game, its number, and whether it is over.
    fn write_game_info(&mut self, game: &ReplayableGame, step: &GameStep, points: [u32; 2]) {
        let (code, by) = match step.rally_end {
            None => (-1.0, None),
            Some(RallyEnd::Goal { by }) => (0.0, Some(by)),
            Some(RallyEnd::Foul { by }) => (1.0, Some(by)),
            Some(RallyEnd::Stuck) => (2.0, None),
            Some(RallyEnd::LeftTable) => (3.0, None),
            Some(RallyEnd::Diverged { .. }) => (4.0, None),
        };
        self.game_info[0] = code;
        self.game_info[1] = by.map_or(-1.0, |robot| robot as f64);
        for (values, numbers) in step
            .constraints
            .iter()
            .zip(self.game_info[2..10].chunks_exact_mut(4))
        {
            numbers.copy_from_slice(&[values.ee, values.link, values.joint_pos, values.joint_vel]);
        }
        let diverged = step
            .divergence
            .map_or([false; 2], |divergence| divergence.robots_at_fault);
        for (number, has_diverged) in self.game_info[10..12].iter_mut().zip(diverged) {
            *number = f64::from(u8::from(has_diverged));
        }
        self.write_counts(game, points);
    }

    fn write_counts(&mut self, game: &ReplayableGame, points: [u32; 2]) {
        let referee = game.simulation.referee();
        let counts = [referee.goals, referee.fouls, referee.score(), points];
        for (number, count) in self.game_info[12..20].iter_mut().zip(counts.concat()) {
            *number = f64::from(count);
        }
        self.game_info[20] = f64::from(game.simulation.steps());
        self.game_info[21] = f64::from(game.origin.number);
        self.game_info[22] = f64::from(u8::from(game.is_over));
    }
}

/// Writes the observations of both robots, each from its own side.
fn write_both(game: &Game, out: &mut [f32]) {
    for (robot, row) in out
        .chunks_exact_mut(OBSERVATION_WITH_OPPONENT_LEN)
        .enumerate()
    {
        observation::write(game.observation(robot), row);
    }
}

/// A true state as [`GAME_STATE_LEN`] numbers.
pub fn flatten(state: &GameState) -> Vec<f64> {
    let robot = |robot: usize| [&state.q[robot][..], &state.dq[robot], &state.ee[robot]].concat();
    [&state.puck[..], &robot(0), &robot(1)].concat()
}

/// Games with their rows, for parallel processing.
pub fn games_with_rows<'a, 'g, 'r>(
    games: &'g mut [ReplayableGame],
    rows: &'a mut [GameRow<'r>],
) -> impl IndexedParallelIterator<Item = (&'g mut ReplayableGame, &'a mut GameRow<'r>)> {
    games.par_iter_mut().zip(rows.par_iter_mut())
}
