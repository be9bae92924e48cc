//! What a series of games came to.

use anyhow::Context;
use faceoff_runner::GameSpec;
use faceoff_scoring::tournament::{
    GameScore, GoalDifference, PlayedGame, Side, Spread, Why, mirrored,
};
use faceoff_types::{Profile, RoundNumber, Ruleset, Seed, TeamName};
use serde::Serialize;

/// What a series is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Kind {
    /// Two games of one seed each, sides swapped.
    MirroredPairs,
    /// Games with seeds of their own, at home in turn.
    Games,
}

/// What a series is, before a game of it is played. Pairs are in the order of the command line.
pub(super) struct Series<'a> {
    pub(super) kind: Kind,
    /// Pairs or games that were asked for.
    pub(super) wanted: u32,
    pub(super) agents: [&'a str; 2],
    /// Its seed is that from which the games' follow.
    pub(super) spec: &'a GameSpec,
}

/// `results.json` of a series. Pairs of numbers are in the order of the command line.
#[derive(Debug, Serialize)]
pub(super) struct SeriesResults {
    pub(super) series: Kind,
    /// Pairs or games that were asked for; fewer have been played if it ended early.
    wanted: u32,
    pub(super) ruleset: Ruleset,
    pub(super) profile: Profile,
    /// From which those of the games follow.
    pub(super) seed: Seed,
    mismatch_seed: Seed,
    pub(super) steps: u32,
    pub(super) agents: [String; 2],
    /// Games that each won.
    pub(super) wins: [u32; 2],
    pub(super) draws: u32,
    /// The first agent's goals less the second's, of a pair's two games together, or of a game.
    pub(super) goal_difference: GoalDifference,
    /// Of mirrored pairs, from the second one on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) spread: Option<Spread>,
    pub(super) games: Vec<SeriesGame>,
}

/// One game of a series. Pairs of numbers are in the order of the command line, whoever was at home.
#[derive(Debug, Clone, Serialize)]
pub(super) struct SeriesGame {
    /// Where its recording is.
    folder: String,
    /// The mirrored pair, from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) pair: Option<u32>,
    seed: Seed,
    /// Which of the agents was at home, 0 or 1.
    home: u32,
    pub(super) goals: [u32; 2],
    fouls: [u32; 2],
    /// As it counts, points for fouls included, 10 : 0 after a forfeit.
    pub(super) score: [u32; 2],
    penalty_points: [f64; 2],
    /// 0 or 1; none: a draw.
    pub(super) winner: Option<u32>,
    #[serde(flatten)]
    why: Why,
    #[serde(skip)]
    entry: PlayedGame,
}

impl SeriesGame {
    pub(super) fn of(
        score: &GameScore,
        folder: String,
        pair: Option<u32>,
        swapped: bool,
    ) -> anyhow::Result<Self> {
        let team = |name: &str| name.parse::<TeamName>().expect("a plain word");
        let mut teams = [team("first"), team("second")];
        let at_home = |values: [u32; 2]| {
            if swapped {
                [values[1], values[0]]
            } else {
                values
            }
        };
        if swapped {
            teams.reverse();
        }
        let mut entry = score.entry(RoundNumber::FIRST, teams);
        entry.pair = pair;
        let entry = PlayedGame::try_from(entry).context("the game's own numbers")?;
        let mut penalty_points = entry.penalty_points();
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
            goals: at_home(entry.counted_goals()),
            fouls: at_home([first.fouls, second.fouls]),
            score: at_home(entry.score()),
            penalty_points,
            winner,
            why: score.why,
            entry,
        })
    }

    /// The first agent's goals less the second's.
    pub(super) fn difference(&self) -> i64 {
        i64::from(self.goals[0]) - i64::from(self.goals[1])
    }
}

impl SeriesResults {
    pub(super) fn of(series: &Series<'_>, games: &[SeriesGame]) -> anyhow::Result<Self> {
        let Series {
            kind,
            wanted,
            agents,
            spec,
        } = *series;
        let won = |agent| games.iter().filter(|game| game.winner == agent).count() as u32;
        let per_unit = match kind {
            Kind::MirroredPairs => 2,
            Kind::Games => 1,
        };
        let differences = games
            .chunks(per_unit)
            .map(|games| games.iter().map(SeriesGame::difference).sum());
        let pairs = mirrored(games.iter().map(|game| &game.entry)).context("the pairs")?;
        Ok(Self {
            series: kind,
            wanted,
            ruleset: spec.ruleset,
            profile: spec.profile,
            seed: spec.seed,
            mismatch_seed: spec.mismatch_seed,
            steps: spec.steps,
            agents: agents.map(str::to_owned),
            wins: [won(Some(0)), won(Some(1))],
            draws: won(None),
            goal_difference: GoalDifference::of(differences),
            spread: pairs.spread,
            games: games.to_vec(),
        })
    }
}
