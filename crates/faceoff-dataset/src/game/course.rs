//! The course of a game, for replays: positions, rallies, violations and faults. It is read from the recording of both sides, or
//! from a side's own archive, which lacks the seed and what only the other side may see.

use super::{
    files::{
        MOTION_FILE, OUTCOME_FILE, RALLIES_FILE, SIDE_OUTCOME_FILE, entries_file, log_file,
        steps_file,
    },
    rallies::{ListedRally, read_rallies},
    recording::{self, check_files, locate, read_schema},
    rows::GameRows,
    table::GameTable,
    violations::Violation,
};
use crate::{
    dataset::Container,
    error::DatasetError,
    files::{MANIFEST_FILE, RESULTS_FILE},
};
use arrow_array::{cast::AsArray as _, types::Float64Type};
use arrow_schema::Schema;
use faceoff_scoring::tournament::GameScore;
use faceoff_sim::table::frames::table_from_robot;
use faceoff_types::{GameOutcome, MAX_GAME_STEPS, Seed, Side, SideOutcome};
use faceoff_wire::game::{GAME_SCHEMA, GAME_SIDE_SCHEMA, GameManifest, GameSideManifest};
use serde::de::DeserializeOwned;
use std::path::Path;

/// Puck and mallets after a control step: x, y, m, table frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GamePositions {
    pub puck: [f64; 2],
    /// The first side's mallet, then the second's.
    pub mallets: [[f64; 2]; 2],
}

/// The course of a recorded game.
#[derive(Debug)]
pub struct GameCourse {
    /// The score; its seed is a placeholder if [`Self::seed`] is `None`.
    pub score: GameScore,
    /// Absent in a side's own archive.
    pub seed: Option<Seed>,
    pub rallies: Vec<ListedRally>,
    /// After each control step of the game.
    pub positions: Vec<GamePositions>,
    /// What each side did; `None` for the other side of a side's own archive.
    pub sides: [Option<SideCourse>; 2],
}

/// What one side did in a game.
#[derive(Debug)]
pub struct SideCourse {
    pub outcome: SideOutcome,
    /// In the order of their first sample.
    pub violations: Vec<Violation>,
}

/// All files of a side's own archive except its manifest.
const fn side_files(side: Side) -> [&'static str; 7] {
    [
        MOTION_FILE,
        RALLIES_FILE,
        steps_file(side),
        entries_file(side),
        log_file(side),
        SIDE_OUTCOME_FILE,
        RESULTS_FILE,
    ]
}

impl GameCourse {
    /// Reads `game.zip`, a side's own archive, a folder to which one of them was unpacked, or a folder with a `game.zip`. Every
    /// file is compared with its hash.
    ///
    /// # Errors
    /// [`DatasetError`].
    pub fn read(path: &Path) -> Result<Self, DatasetError> {
        let (_, container) = locate(path)?;
        let manifest = container.bytes(MANIFEST_FILE)?;
        let (seed, outcomes) = match read_schema(&manifest)?.as_str() {
            GAME_SCHEMA => {
                let manifest: GameManifest = parse(MANIFEST_FILE, &manifest)?;
                check_files(&container, &manifest.files, &recording::FILES)?;
                let outcome: GameOutcome = parse(OUTCOME_FILE, &container.bytes(OUTCOME_FILE)?)?;
                (Some(manifest.spec.seed), outcome.sides.map(Some))
            }
            GAME_SIDE_SCHEMA => {
                let GameSideManifest { side, files, .. } = parse(MANIFEST_FILE, &manifest)?;
                check_files(&container, &files, &side_files(side))?;
                let outcome = parse(SIDE_OUTCOME_FILE, &container.bytes(SIDE_OUTCOME_FILE)?)?;
                let mut outcomes = [None, None];
                outcomes[side.index()] = Some(outcome);
                (None, outcomes)
            }
            other => {
                return Err(DatasetError::Foreign(format!(
                    "the recording's layout is {other:?}, this version reads {GAME_SCHEMA} and {GAME_SIDE_SCHEMA}"
                )));
            }
        };
        let score = read_score(&container)?;
        // No rows are added: only the tables' schemas are needed.
        let schemas = GameRows::new();
        let table = |name, schema: &Schema| GameTable::open(container.range(name)?, name, schema);
        let rallies = read_rallies(table(RALLIES_FILE, schemas.rallies.schema())?)?;
        let positions = read_positions(table(MOTION_FILE, schemas.motion.schema())?)?;
        check_rallies(&rallies, positions.len())?;
        let mut sides = [None, None];
        for ((side, outcome), step_rows) in Side::BOTH.into_iter().zip(outcomes).zip(&schemas.sides)
        {
            if let Some(outcome) = outcome {
                let steps = table(steps_file(side), step_rows.schema())?;
                sides[side.index()] = Some(SideCourse {
                    outcome,
                    violations: Violation::read(steps)?,
                });
            }
        }
        Ok(Self {
            score,
            seed,
            rallies,
            positions,
            sides,
        })
    }

    /// The side whose own archive it is; `None` for the recording of both sides.
    #[must_use]
    pub fn only_side(&self) -> Option<Side> {
        match self.sides {
            [Some(_), None] => Some(Side::First),
            [None, Some(_)] => Some(Side::Second),
            _ => None,
        }
    }
}

fn parse<T: DeserializeOwned>(name: &str, bytes: &[u8]) -> Result<T, DatasetError> {
    serde_json::from_slice(bytes).map_err(DatasetError::unreadable(name))
}

/// Reads `results.json`, which has no seed in a side's own archive.
fn read_score(container: &Container) -> Result<GameScore, DatasetError> {
    let mut results: serde_json::Value = parse(RESULTS_FILE, &container.bytes(RESULTS_FILE)?)?;
    if let Some(fields) = results.as_object_mut() {
        fields
            .entry("seed")
            .or_insert_with(|| "0".repeat(64).into());
    }
    serde_json::from_value(results).map_err(DatasetError::unreadable(RESULTS_FILE))
}

fn read_positions(mut table: GameTable) -> Result<Vec<GamePositions>, DatasetError> {
    let mut positions = Vec::new();
    loop {
        let row_count = table.fill()?;
        let Some(batch) = table.take(row_count).filter(|_| row_count > 0) else {
            return Ok(positions);
        };
        if positions.len() + row_count > MAX_GAME_STEPS as usize {
            return Err(DatasetError::Unreadable(format!(
                "{MOTION_FILE} has more rows than a game has control steps, {MAX_GAME_STEPS}"
            )));
        }
        let column = |name: &str| batch[name].as_primitive::<Float64Type>();
        let puck = ["puck_x", "puck_y"].map(column);
        let mallets = Side::BOTH.map(|side| {
            ["x", "y", "z"].map(|axis| column(&format!("robot_{}_ee_{axis}", side.number())))
        });
        positions.extend((0..batch.num_rows()).map(|row| GamePositions {
            puck: puck.map(|column| column.value(row)),
            mallets: [0, 1].map(|robot| {
                let [x, y, _] =
                    table_from_robot(robot, mallets[robot].map(|column| column.value(row)));
                [x, y]
            }),
        }));
    }
}

/// Checks that the rallies follow each other and cover all control steps.
fn check_rallies(rallies: &[ListedRally], steps: usize) -> Result<(), DatasetError> {
    let mut end = 0;
    for (number, rally) in (0..).zip(rallies) {
        if rally.rally != number || rally.game_step != end {
            return Err(DatasetError::Unreadable(format!(
                "{RALLIES_FILE} has rally {} from control step {} on, expected rally {number} from {end} on",
                rally.rally, rally.game_step
            )));
        }
        end = rally.end_step();
    }
    if end as usize != steps {
        return Err(DatasetError::Unreadable(format!(
            "the rallies of {RALLIES_FILE} have {end} control steps, {MOTION_FILE} has {steps}"
        )));
    }
    Ok(())
}
