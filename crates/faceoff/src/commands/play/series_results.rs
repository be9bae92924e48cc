//! Results of a series of games.

use anyhow::Context;
use faceoff_runner::GameSpec;
use faceoff_scoring::tournament::{
    GameScore, GoalDifference, PlayedGame, ResultReason, Side, VarianceComparison,
    find_mirrored_pairs,
};
use faceoff_types::{Profile, RoundNumber, Ruleset, Seed, TeamName};
use serde::Serialize;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum SeriesKind {
    /// Two games on one seed, with swapped sides.
    MirroredPairs,
    /// Games with their own seeds and alternating home sides.
    Games,
}

/// Settings of a series. Arrays of two have the agent that the command line names first at index 0.
pub(super) struct Series<'a> {
    pub(super) kind: SeriesKind,
    /// Requested number of pairs or games.
    pub(super) count: u32,
    pub(super) agents: [&'a str; 2],
    /// Settings of all games, and the seed from which the games' seeds are derived.
    pub(super) spec: &'a GameSpec,
}

/// `results.json` of a series. Arrays of two have the agent that the command line names first at index 0.
#[derive(Debug, Serialize)]
pub(super) struct SeriesResults {
    pub(super) series: SeriesKind,
    /// Requested number of pairs or games; a series that ended early has fewer.
    wanted: u32,
    pub(super) ruleset: Ruleset,
    pub(super) profile: Profile,
    /// The seed from which the games' seeds are derived.
    pub(super) seed: Seed,
    mismatch_seed: Seed,
    pub(super) steps: u32,
    pub(super) agents: [String; 2],
    /// Games that each agent won.
    pub(super) wins: [u32; 2],
    pub(super) draws: u32,
    /// The first agent's goals minus the second's, per pair or per game.
    pub(super) goal_difference: GoalDifference,
    /// The variance of the goal difference of mirrored pairs compared with that of independent games; absent with fewer than two pairs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) spread: Option<VarianceComparison>,
    pub(super) games: Vec<SeriesGame>,
}

/// One game of a series. Arrays of two have the agent that the command line names first at index 0, whether it plays at home or
/// not.
#[derive(Debug, Clone, Serialize)]
pub(super) struct SeriesGame {
    /// Folder of the recording.
    folder: String,
    /// Number of the mirrored pair, from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) pair: Option<u32>,
    seed: Seed,
    /// Index of the agent that plays as the home side, 0 or 1.
    home: u32,
    pub(super) goals: [u32; 2],
    fouls: [u32; 2],
    /// The counted score, including points for fouls; after a forfeit 10 : 0, or a larger lead.
    pub(super) score: [u32; 2],
    penalty_points: [f64; 2],
    /// Index of the agent that won, 0 or 1; `None`: a draw.
    pub(super) winner: Option<u32>,
    #[serde(flatten)]
    reason: ResultReason,
    /// The game as the scoring of tournaments reads it.
    #[serde(skip)]
    played_game: PlayedGame,
}

impl SeriesGame {
    /// The game with this score. `swapped`: the second agent of the command line played as the home side.
    pub(super) fn new(
        score: &GameScore,
        folder: String,
        pair: Option<u32>,
        swapped: bool,
    ) -> anyhow::Result<Self> {
        let team = |name: &str| name.parse::<TeamName>().expect("a plain word");
        let mut teams = [team("first"), team("second")];
        let in_agent_sequence = |values: [u32; 2]| {
            if swapped {
                [values[1], values[0]]
            } else {
                values
            }
        };
        if swapped {
            teams.reverse();
        }
        let mut game_entry = score.game_entry(RoundNumber::FIRST, teams);
        game_entry.pair = pair;
        let played_game = PlayedGame::try_from(game_entry).context("reading the game's score")?;
        let mut penalty_points = played_game.penalty_points();
        if swapped {
            penalty_points.reverse();
        }
        let [first, second] = &score.sides;
        let winner = score.winner.map(|side| match (side, swapped) {
            (Side::Home, false) | (Side::Away, true) => 0,
            (Side::Home, true) | (Side::Away, false) => 1,
        });
        Ok(Self {
            folder,
            pair,
            seed: score.seed,
            home: u32::from(swapped),
            goals: in_agent_sequence(played_game.counted_goals()),
            fouls: in_agent_sequence([first.fouls, second.fouls]),
            score: in_agent_sequence(played_game.score()),
            penalty_points,
            winner,
            reason: score.reason,
            played_game,
        })
    }

    /// The first agent's goals minus the second's.
    pub(super) fn difference(&self) -> i64 {
        i64::from(self.goals[0]) - i64::from(self.goals[1])
    }
}

impl SeriesResults {
    pub(super) fn new(series: &Series<'_>, games: &[SeriesGame]) -> anyhow::Result<Self> {
        let Series {
            kind,
            count,
            agents,
            spec,
        } = *series;
        let count_won_by = |agent| games.iter().filter(|game| game.winner == agent).count() as u32;
        let games_per_row = match kind {
            SeriesKind::MirroredPairs => 2,
            SeriesKind::Games => 1,
        };
        let differences = games
            .chunks(games_per_row)
            .map(|games| games.iter().map(SeriesGame::difference).sum());
        let pairs = find_mirrored_pairs(games.iter().map(|game| &game.played_game))
            .context("comparing the pairs")?;
        Ok(Self {
            series: kind,
            wanted: count,
            ruleset: spec.ruleset,
            profile: spec.profile,
            seed: spec.seed,
            mismatch_seed: spec.mismatch_seed,
            steps: spec.steps,
            agents: agents.map(str::to_owned),
            wins: [count_won_by(Some(0)), count_won_by(Some(1))],
            draws: count_won_by(None),
            goal_difference: GoalDifference::from_differences(differences),
            spread: pairs.variances,
            games: games.to_vec(),
        })
    }
}
