//! A played game as in the file `games.json`: validation of the entry, and the game with its result.

use super::penalty_points::MAX_EPISODE_PENALTY;
use super::{
    game_result::{ForfeitKind, GameResult, ResultReason},
    rules::{GameTally, final_score, forfeit_score, judge},
    side::Side,
    submission_label::SubmissionLabel,
};
use faceoff_types::{
    FOULS_PER_POINT, ForfeitScore, GAME_WINDOWS, RoundNumber, TeamName, WINDOW_STEPS,
};
use serde::{Deserialize, Serialize};

/// A played game, one entry of `games.json`. Pairs are `[home, away]`.
///
/// Deserialisation rejects a team that plays itself, numbers that are impossible under the rules, a game with neither
/// `fouls` nor `score`, and a `score` that contradicts goals and fouls.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "GameEntry")]
pub struct PlayedGame {
    raw: GameEntry,
    /// Final score `[home, away]` that counts: as played, or after a forfeit by [`GameEntry::forfeit_score`].
    score: [u32; 2],
    result: GameResult,
}

/// The JSON fields of a [`PlayedGame`], not validated.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct GameEntry {
    /// The round, from 1.
    pub round: u32,
    /// The team of the first robot.
    pub home: TeamName,
    /// The team of the second robot.
    pub away: TeamName,
    /// Goals scored, without points for fouls.
    pub goals: [u32; 2],
    /// Fouls of each team; required without `score`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fouls: Option<[u32; 2]>,
    /// Final score; derived from goals and fouls if absent.
    #[serde(skip_serializing)] // `ScoredGame` has the computed one
    pub score: Option<[u32; 2]>,
    /// Penalty points of each team over the game.
    pub penalty_points: [f64; 2],
    /// Length of the game in windows of 500 control steps; absent: 90, a normal game.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub windows: Option<u32>,
    /// The limit that each side exceeded, if it forfeited.
    #[serde(default, skip_serializing_if = "has_no_forfeit")]
    pub forfeit: [Option<ForfeitKind>; 2],
    /// What the game counts after a forfeit; absent: 10 : 0.
    #[serde(default, skip_serializing_if = "ForfeitScore::is_legacy")]
    pub forfeit_score: ForfeitScore,
    /// Submissions of the two teams, if each is to have its own rating.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub submissions: Option<[SubmissionLabel; 2]>,
    /// Number of the mirrored pair that the game belongs to: two games with the same seed and swapped sides.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pair: Option<u32>,
}

fn has_no_forfeit(forfeit: &[Option<ForfeitKind>; 2]) -> bool {
    *forfeit == [None, None]
}

/// An entry that is impossible under the rules.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("round {round}, {home} against {away}: {reason}")]
pub struct InvalidGame {
    round: u32,
    home: TeamName,
    away: TeamName,
    reason: String,
}

/// A game with its result: final score, winner and reason in addition to the fields of the entry.
///
/// In JSON, `won_by` is `score`, `tier` (the other side is non-deployable) or `forfeit`, and `winner_led` says whether the
/// winner had the higher final score before forfeits. A draw has `drawn_by` instead: `equal_score`,
/// `both_non_deployable` or `both_forfeit`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScoredGame {
    #[serde(flatten)]
    raw: GameEntry,
    /// Final score that counts, including points for the opponent's fouls; after a forfeit 10 : 0, or a larger lead.
    pub score: [u32; 2],
    /// The winner; `None` is a draw.
    pub winner: Option<TeamName>,
    #[serde(flatten)]
    reason: ResultReason,
    /// The team whose departure excludes the game from the standings.
    #[serde(rename = "taken_out_by", skip_serializing_if = "Option::is_none")]
    pub excluded_by: Option<TeamName>,
    /// Winner and reason, as in the JSON fields.
    #[serde(skip)]
    pub result: GameResult,
}

impl ScoredGame {
    /// The two teams, home first.
    #[must_use]
    pub const fn teams(&self) -> [&TeamName; 2] {
        [&self.raw.home, &self.raw.away]
    }

    /// The round, from 1.
    #[must_use]
    pub const fn round(&self) -> u32 {
        self.raw.round
    }

    /// Goals scored, without points for fouls.
    #[must_use]
    pub const fn goals(&self) -> [u32; 2] {
        self.raw.goals
    }

    /// Fouls of both teams; `None` if the entry has only the score.
    #[must_use]
    pub const fn fouls(&self) -> Option<[u32; 2]> {
        self.raw.fouls
    }

    /// Penalty points of both teams over the game.
    #[must_use]
    pub const fn penalty_points(&self) -> [f64; 2] {
        self.raw.penalty_points
    }
}

impl PlayedGame {
    /// Maximum length of a game, in windows.
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

    /// Goals for the standings: those scored, but after a forfeit 10 : 0 or a larger lead.
    #[must_use]
    pub fn counted_goals(&self) -> [u32; 2] {
        self.raw.counted(self.raw.goals)
    }

    /// The limit that each side exceeded; `None` if it did not forfeit.
    #[must_use]
    pub const fn forfeits(&self) -> [Option<ForfeitKind>; 2] {
        self.raw.forfeit
    }

    /// Submissions of the two teams, if the entry has them.
    #[must_use]
    pub const fn submissions(&self) -> [Option<&SubmissionLabel>; 2] {
        match &self.raw.submissions {
            Some([home, away]) => [Some(home), Some(away)],
            None => [None, None],
        }
    }

    /// Number of the mirrored pair that the game belongs to.
    #[must_use]
    pub const fn pair(&self) -> Option<u32> {
        self.raw.pair
    }

    /// Final score that counts, also after a forfeit.
    #[must_use]
    pub const fn score(&self) -> [u32; 2] {
        self.score
    }

    /// Penalty points of both teams over the game.
    #[must_use]
    pub const fn penalty_points(&self) -> [f64; 2] {
        self.raw.penalty_points
    }

    /// Winner and reason.
    #[must_use]
    pub const fn result(&self) -> GameResult {
        self.result
    }

    /// The winner; `None` is a draw.
    #[must_use]
    pub const fn winner(&self) -> Option<Side> {
        self.result.winner()
    }

    /// The game with its result; `excluded_by` is the team whose departure excludes it.
    #[must_use]
    pub fn scored(&self, excluded_by: Option<&TeamName>) -> ScoredGame {
        ScoredGame {
            raw: self.raw.clone(),
            score: self.score,
            winner: self
                .winner()
                .map(|side| self.teams()[side as usize].clone()),
            reason: self.result.into(),
            excluded_by: excluded_by.cloned(),
            result: self.result,
        }
    }
}

impl TryFrom<GameEntry> for PlayedGame {
    type Error = InvalidGame;

    fn try_from(mut raw: GameEntry) -> Result<Self, InvalidGame> {
        match raw.check() {
            Ok(played_score) => {
                // −0 is valid, but would be serialised with its sign.
                raw.penalty_points = raw.penalty_points.map(|points| points + 0.0);
                let result = judge(&GameTally {
                    score: played_score,
                    penalty_points: raw.penalty_points,
                    windows: raw.windows.unwrap_or(GAME_WINDOWS),
                    forfeits: raw.forfeit,
                });
                let score = raw.counted(played_score);
                Ok(Self { raw, score, result })
            }
            Err(reason) => Err(InvalidGame {
                round: raw.round,
                home: raw.home,
                away: raw.away,
                reason,
            }),
        }
    }
}

impl GameEntry {
    /// The score, or the goals, that count if the game stood at `played`: other numbers only after a forfeit.
    fn counted(&self, played: [u32; 2]) -> [u32; 2] {
        forfeit_score(self.forfeit_score, self.forfeit, played).unwrap_or(played)
    }

    /// Checks the entry. Returns the final score as played, without the rule for forfeits, or the reason why the entry is invalid.
    fn check(&self) -> Result<[u32; 2], String> {
        if let Err(error) = RoundNumber::try_from(self.round) {
            return Err(format!("round: {error}"));
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
        // At most one goal and one foul per control step.
        let max_count = windows * WINDOW_STEPS;
        let counts = [
            ("goals", Some(self.goals)),
            ("fouls", self.fouls),
            ("score", self.score),
        ];
        for (field, pair) in counts {
            if let Some(count) = pair.into_iter().flatten().find(|count| *count > max_count) {
                return Err(format!(
                    "{field}: expected at most {max_count}, one per control step of the game, got {count}"
                ));
            }
        }
        let max_points = MAX_EPISODE_PENALTY * f64::from(windows);
        if let Some(points) = self
            .penalty_points
            .into_iter()
            .find(|points| !(0.0..=max_points).contains(points))
        {
            return Err(format!(
                "penalty_points: expected 0 to {max_points} ({MAX_EPISODE_PENALTY} for each of {windows} \
                 windows), got {points}"
            ));
        }
        self.final_score()
    }

    /// The final score as played, without the rule for forfeits, from goals and fouls or from `score`.
    fn final_score(&self) -> Result<[u32; 2], String> {
        if !has_no_forfeit(&self.forfeit) {
            let fouls = self.fouls.ok_or(
                "a forfeited game needs its fouls: the score before the forfeit does not count",
            )?;
            let played = final_score(self.goals, fouls);
            let counted = self.counted(played);
            return match self.score {
                Some(score) if score != counted => Err(format!(
                    "score: a game with this forfeit counts {counted:?}, got {score:?}"
                )),
                _ => Ok(played),
            };
        }
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
