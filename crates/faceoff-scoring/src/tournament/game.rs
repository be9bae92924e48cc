use super::{
    result::{Forfeit, GameResult, Why},
    rules::{GameFacts, final_score, forfeit_score, judge},
    side::Side,
    submission_label::SubmissionLabel,
};
use crate::episode::MAX_EPISODE_PENALTY;
use faceoff_types::{FOULS_PER_POINT, GAME_WINDOWS, RoundNumber, TeamName, WINDOW_STEPS};
use serde::{Deserialize, Serialize};

/// A played game, one entry of `games.json`. Pairs are `[home, away]`.
///
/// Reading it refuses a team that plays itself, numbers that the rules cannot give, a game with neither
/// `fouls` nor `score`, and a `score` that contradicts goals and fouls.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "GameEntry")]
pub struct PlayedGame {
    raw: GameEntry,
    /// The final score that counts.
    score: [u32; 2],
    result: GameResult,
}

/// A game as it is written down, before anybody has checked it: fields of [`PlayedGame`]'s JSON.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct GameEntry {
    /// The round, from 1.
    pub round: u32,
    /// The team of the first robot.
    pub home: TeamName,
    /// The team of the second robot.
    pub away: TeamName,
    /// Goals as played, without points for fouls.
    pub goals: [u32; 2],
    /// Fouls of each team; needed unless `score` is there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fouls: Option<[u32; 2]>,
    /// The final score.
    #[serde(skip_serializing)] // `ScoredGame` writes the one that was worked out
    pub score: Option<[u32; 2]>,
    /// Penalty points of each team over the game.
    pub penalty_points: [f64; 2],
    /// Length of the game in windows of 500 steps, where it is not the usual one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub windows: Option<u32>,
    /// Who used up its faults or its time.
    #[serde(default, skip_serializing_if = "nobody")]
    pub forfeit: [Option<Forfeit>; 2],
    /// Which of their submissions the teams played, where ratings shall tell them apart.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub submissions: Option<[SubmissionLabel; 2]>,
    /// The mirrored pair that the game is one half of: two games with the same seeds, sides swapped.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pair: Option<u32>,
}

fn nobody(forfeit: &[Option<Forfeit>; 2]) -> bool {
    *forfeit == [None, None]
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

/// A game with its result; adds the final score, the winner and why to the fields of the entry.
///
/// As JSON `won_by` is `score`, `tier` (the other side is non-deployable) or `forfeit`, with `winner_led`
/// beside it: whether the winner had the higher final score as played. A draw has `drawn_by` in their
/// place: `equal_score`, `both_non_deployable` or `both_forfeit`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScoredGame {
    #[serde(flatten)]
    raw: GameEntry,
    /// Final score that counts: points for the opponent's fouls included, 10 : 0 after a forfeit.
    pub score: [u32; 2],
    /// The winner; `None` is a draw.
    pub winner: Option<TeamName>,
    #[serde(flatten)]
    why: Why,
    /// The team by whose leaving the game does not count for the standings.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub taken_out_by: Option<TeamName>,
    /// How it ended.
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

    /// Goals as played, without points for fouls.
    #[must_use]
    pub const fn goals(&self) -> [u32; 2] {
        self.raw.goals
    }

    /// Fouls of both teams, where the entry has them and not the score alone.
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

    /// Goals as played, without points for fouls.
    #[must_use]
    pub const fn goals(&self) -> [u32; 2] {
        self.raw.goals
    }

    /// Goals as the standings count them: 10 : 0 after a forfeit, else as played.
    #[must_use]
    pub fn counted_goals(&self) -> [u32; 2] {
        forfeit_score(self.raw.forfeit).unwrap_or(self.raw.goals)
    }

    /// Who forfeited.
    #[must_use]
    pub const fn forfeits(&self) -> [Option<Forfeit>; 2] {
        self.raw.forfeit
    }

    /// Which submissions played, where the entry says so.
    #[must_use]
    pub const fn submissions(&self) -> [Option<&SubmissionLabel>; 2] {
        match &self.raw.submissions {
            Some([home, away]) => [Some(home), Some(away)],
            None => [None, None],
        }
    }

    /// The mirrored pair that the game is one half of.
    #[must_use]
    pub const fn pair(&self) -> Option<u32> {
        self.raw.pair
    }

    /// Final score that counts.
    #[must_use]
    pub const fn score(&self) -> [u32; 2] {
        self.score
    }

    /// Penalty points of both teams over the game.
    #[must_use]
    pub const fn penalty_points(&self) -> [f64; 2] {
        self.raw.penalty_points
    }

    /// How it ended, and why.
    #[must_use]
    pub const fn result(&self) -> GameResult {
        self.result
    }

    /// The winner; `None` is a draw.
    #[must_use]
    pub const fn winner(&self) -> Option<Side> {
        self.result.winner()
    }

    /// The game with its result, and the team by whose leaving it does not count, if one did.
    #[must_use]
    pub fn scored(&self, taken_out_by: Option<&TeamName>) -> ScoredGame {
        ScoredGame {
            raw: self.raw.clone(),
            score: self.score,
            winner: self
                .winner()
                .map(|side| self.teams()[side as usize].clone()),
            why: self.result.into(),
            taken_out_by: taken_out_by.cloned(),
            result: self.result,
        }
    }
}

impl TryFrom<GameEntry> for PlayedGame {
    type Error = InvalidGame;

    fn try_from(mut raw: GameEntry) -> Result<Self, InvalidGame> {
        match raw.check() {
            Ok(played) => {
                // −0 is a valid 0, but would be written with its sign.
                raw.penalty_points = raw.penalty_points.map(|points| points + 0.0);
                let result = judge(&GameFacts {
                    score: played,
                    penalty_points: raw.penalty_points,
                    windows: raw.windows.unwrap_or(GAME_WINDOWS),
                    forfeits: raw.forfeit,
                });
                let score = forfeit_score(raw.forfeit).unwrap_or(played);
                Ok(Self { raw, score, result })
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

impl GameEntry {
    /// The final score as played, or what is wrong with the entry.
    fn check(&self) -> Result<[u32; 2], String> {
        if let Err(why) = RoundNumber::try_from(self.round) {
            return Err(format!("round: {why}"));
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
        if let Some(counts) = forfeit_score(self.forfeit) {
            let fouls = self.fouls.ok_or(
                "a forfeited game needs its fouls: what its score was is not what it counts",
            )?;
            return match self.score {
                Some(score) if score != counts => Err(format!(
                    "score: a game with this forfeit counts {counts:?}, got {score:?}"
                )),
                _ => Ok(final_score(self.goals, fouls)),
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
