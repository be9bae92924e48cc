//! Seed labels of games. A *meeting* is the pairing of two teams in a round of a tournament; a *replay* repeats the whole
//! schedule with other seeds.

use crate::{GameId, RoundNumber, Seed};
use std::{fmt, str::FromStr};

/// What the seed of a game is derived from, together with the season secret: the position of the game in its
/// tournament, independent of the teams and of reruns. Examples of its text are
/// `tournament/1/round/2/meeting/5`, `tournament/1/replay/3/round/2/meeting/5` and `game/ID`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum GameSeedLabel {
    /// A meeting of a round; both games of a mirrored pairing have the same seed.
    Fixture {
        /// The number of the tournament in its season, from 1.
        tournament: u32,
        round: RoundNumber,
        /// Number of the meeting in the round, from 1, in the order of the draw.
        meeting: u32,
    },
    /// The same meeting in a *replay*: a repetition of the tournament's schedule with other seeds.
    ScheduleReplay {
        /// The number of the tournament in its season, from 1.
        tournament: u32,
        /// Number of the replay, from 1.
        replay: u32,
        round: RoundNumber,
        /// Number of the meeting in the round, from 1.
        meeting: u32,
    },
    /// A test game or friendly game outside of the schedule; each has its own seed.
    Standalone(GameId),
}

impl GameSeedLabel {
    /// Derives the seed from the season secret.
    #[must_use]
    pub fn seed(self, season_secret: &Seed) -> Seed {
        match self {
            Self::Fixture {
                tournament,
                round,
                meeting,
            } => season_secret.tournament(tournament).meeting(round, meeting),
            Self::ScheduleReplay {
                tournament,
                replay,
                round,
                meeting,
            } => season_secret
                .tournament(tournament)
                .derive("replay", &replay.to_le_bytes())
                .meeting(round, meeting),
            Self::Standalone(game) => season_secret.derive("game", game.as_uuid().as_bytes()),
        }
    }
}

impl Seed {
    /// The seed for the draw and the games of a tournament, derived from the season secret (`self`). It depends only on the
    /// tournament's number in the season, so a repeated season has the same seeds.
    #[must_use]
    pub fn tournament(&self, number: u32) -> Self {
        self.derive("tournament", &number.to_le_bytes())
    }

    fn meeting(&self, round: RoundNumber, meeting: u32) -> Self {
        self.derive("round", &round.get().to_le_bytes())
            .derive("meeting", &meeting.to_le_bytes())
    }
}

impl fmt::Display for GameSeedLabel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fixture {
                tournament,
                round,
                meeting,
            } => write!(f, "tournament/{tournament}/round/{round}/meeting/{meeting}"),
            Self::ScheduleReplay {
                tournament,
                replay,
                round,
                meeting,
            } => write!(
                f,
                "tournament/{tournament}/replay/{replay}/round/{round}/meeting/{meeting}"
            ),
            Self::Standalone(game) => write!(f, "game/{game}"),
        }
    }
}

/// Text that is not the label of a game's seed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("not the label of a game's seed")]
pub struct ParseGameSeedLabelError;

impl FromStr for GameSeedLabel {
    type Err = ParseGameSeedLabelError;
    fn from_str(s: &str) -> Result<Self, Self::Err> {
        fn parse_number(text: &str) -> Result<u32, ParseGameSeedLabelError> {
            text.parse().map_err(|_| ParseGameSeedLabelError)
        }
        let parse_round =
            |text| RoundNumber::try_from(parse_number(text)?).map_err(|_| ParseGameSeedLabelError);
        let parts: Vec<&str> = s.split('/').collect();
        Ok(match parts[..] {
            ["tournament", tournament, "round", round, "meeting", meeting] => Self::Fixture {
                tournament: parse_number(tournament)?,
                round: parse_round(round)?,
                meeting: parse_number(meeting)?,
            },
            [
                "tournament",
                tournament,
                "replay",
                replay,
                "round",
                round,
                "meeting",
                meeting,
            ] => Self::ScheduleReplay {
                tournament: parse_number(tournament)?,
                replay: parse_number(replay)?,
                round: parse_round(round)?,
                meeting: parse_number(meeting)?,
            },
            ["game", id] => Self::Standalone(id.parse().map_err(|_| ParseGameSeedLabelError)?),
            _ => return Err(ParseGameSeedLabelError),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn game_seed_labels_are_distinct_and_round_trip() {
        let secret = Seed::from_number(3);
        let [first, second] = [RoundNumber::FIRST, RoundNumber::SECOND];
        let fixture = |tournament, round, meeting| GameSeedLabel::Fixture {
            tournament,
            round,
            meeting,
        };
        let replay = |replay| GameSeedLabel::ScheduleReplay {
            tournament: 1,
            replay,
            round: first,
            meeting: 1,
        };
        let all = [
            fixture(1, first, 1),
            fixture(1, first, 2),
            fixture(1, second, 1),
            fixture(2, first, 1),
            replay(1),
            replay(2),
            GameSeedLabel::Standalone(GameId::new()),
            GameSeedLabel::Standalone(GameId::new()),
        ];
        for (i, label) in all.iter().enumerate() {
            assert_eq!(label.to_string().parse(), Ok(*label));
            for other in &all[..i] {
                assert_ne!(label.seed(&secret), other.seed(&secret), "{label} {other}");
            }
        }
        for wrong in [
            "",
            "game/1",
            "tournament/1/round/0/meeting/1",
            "tournament/1/round/1/meeting/",
            "tournament/1",
        ] {
            assert!(wrong.parse::<GameSeedLabel>().is_err(), "{wrong}");
        }
    }
}
