use super::rules::{Side, final_score, winner};
use crate::episode::MAX_EPISODE_PENALTY;
use faceoff_types::{FOULS_PER_POINT, GAME_WINDOWS, TeamName, WINDOW_STEPS};
use serde::{Deserialize, Serialize};

/// A played game, one entry of `games.json`. Pairs are `[home, away]`.
///
/// Reading it refuses a team that plays itself, numbers that the rules cannot give, a game with neither
/// `fouls` nor `score`, and a `score` that contradicts goals and fouls.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "RawGame")]
pub struct PlayedGame {
    raw: RawGame,
    score: [u32; 2],
}

#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct RawGame {
    round: u32,
    home: TeamName,
    away: TeamName,
    goals: [u32; 2],
    #[serde(skip_serializing_if = "Option::is_none")]
    fouls: Option<[u32; 2]>,
    #[serde(skip_serializing)] // `ScoredGame` writes the one that was worked out
    score: Option<[u32; 2]>,
    penalty_points: [f64; 2],
    /// Length of the game in windows of 500 steps, where it is not the usual one.
    #[serde(skip_serializing_if = "Option::is_none")]
    windows: Option<u32>,
}

/// Why an entry is no game of the rules.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("round {round}, {home} against {away}: {why}")]
pub struct InvalidGame {
    round: u32,
    home: TeamName,
    away: TeamName,
    why: String,
}

/// A game with its result; adds the final score and the winner to the fields of the entry.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScoredGame {
    #[serde(flatten)]
    raw: RawGame,
    /// Final score, points for the opponent's fouls included.
    pub score: [u32; 2],
    /// The winner; `None` is a draw.
    pub winner: Option<TeamName>,
}

impl PlayedGame {
    /// The highest round number: a tournament has a few rounds, and standings list them all.
    pub const MAX_ROUND: u32 = 100;
    /// The longest game, in windows.
    pub const MAX_WINDOWS: u32 = 100_000;

    /// The round, from 1.
    #[must_use]
    pub const fn round(&self) -> u32 {
        self.raw.round
    }

    /// The two teams, home first.
    #[must_use]
    pub const fn teams(&self) -> [&TeamName; 2] {
        [&self.raw.home, &self.raw.away]
    }

    /// Goals scored, without points for fouls.
    #[must_use]
    pub const fn goals(&self) -> [u32; 2] {
        self.raw.goals
    }

    /// Final score.
    #[must_use]
    pub const fn score(&self) -> [u32; 2] {
        self.score
    }

    /// Penalty points of both teams over the game.
    #[must_use]
    pub const fn penalty_points(&self) -> [f64; 2] {
        self.raw.penalty_points
    }

    /// The winner; `None` is a draw.
    #[must_use]
    pub fn winner(&self) -> Option<Side> {
        winner(
            self.score,
            self.raw.penalty_points,
            self.raw.windows.unwrap_or(GAME_WINDOWS),
        )
    }

    /// The game with its result.
    #[must_use]
    pub fn scored(&self) -> ScoredGame {
        ScoredGame {
            raw: self.raw.clone(),
            score: self.score,
            winner: self
                .winner()
                .map(|side| self.teams()[side as usize].clone()),
        }
    }
}

impl TryFrom<RawGame> for PlayedGame {
    type Error = InvalidGame;

    fn try_from(mut raw: RawGame) -> Result<Self, InvalidGame> {
        match raw.check() {
            Ok(score) => {
                // −0 is a valid 0, but would be written with its sign.
                raw.penalty_points = raw.penalty_points.map(|points| points + 0.0);
                Ok(Self { raw, score })
            }
            Err(why) => Err(InvalidGame {
                round: raw.round,
                home: raw.home,
                away: raw.away,
                why,
            }),
        }
    }
}

impl RawGame {
    /// The final score, or what is wrong with the entry.
    fn check(&self) -> Result<[u32; 2], String> {
        if !(1..=PlayedGame::MAX_ROUND).contains(&self.round) {
            return Err(format!(
                "round: expected 1 to {}, got {}",
                PlayedGame::MAX_ROUND,
                self.round
            ));
        }
        if self.home == self.away {
            return Err("a team cannot play itself".to_owned());
        }
        let windows = self.windows.unwrap_or(GAME_WINDOWS);
        if !(1..=PlayedGame::MAX_WINDOWS).contains(&windows) {
            return Err(format!(
                "windows: expected 1 to {}, got {windows}",
                PlayedGame::MAX_WINDOWS
            ));
        }
        // Nothing can happen more often than once per control step.
        let most = windows * WINDOW_STEPS;
        let counts = [
            ("goals", Some(self.goals)),
            ("fouls", self.fouls),
            ("score", self.score),
        ];
        for (field, pair) in counts {
            if let Some(count) = pair.into_iter().flatten().find(|count| *count > most) {
                return Err(format!(
                    "{field}: expected at most {most}, one per control step of the game, got {count}"
                ));
            }
        }
        let most = MAX_EPISODE_PENALTY * f64::from(windows);
        if let Some(points) = self
            .penalty_points
            .into_iter()
            .find(|points| !(0.0..=most).contains(points))
        {
            return Err(format!(
                "penalty_points: expected 0 to {most} ({MAX_EPISODE_PENALTY} for each of {windows} \
                 windows), got {points}"
            ));
        }
        self.final_score()
    }

    fn final_score(&self) -> Result<[u32; 2], String> {
        match (self.fouls, self.score) {
            (None, None) => Err("expected fouls or score, got neither".to_owned()),
            (Some(fouls), None) => Ok(final_score(self.goals, fouls)),
            (Some(fouls), Some(score)) => {
                let expected = final_score(self.goals, fouls);
                if score == expected {
                    Ok(score)
                } else {
                    Err(format!(
                        "score: expected {expected:?} (goals, and a point for every \
                         {FOULS_PER_POINT} fouls of the opponent), got {score:?}"
                    ))
                }
            }
            (None, Some(score)) => {
                if score[0] < self.goals[0] || score[1] < self.goals[1] {
                    return Err(format!(
                        "score: expected at least the goals {:?}, got {score:?}",
                        self.goals
                    ));
                }
                Ok(score)
            }
        }
    }
}
