use crate::{GameId, RoundNumber, Seed};
use std::{fmt, str::FromStr};

/// What the seed of a server's game follows from, beside the season's secret: the place of the game in its
/// tournament, whoever plays it and however often it is played again. Its text is as in
/// `tournament/1/round/2/meeting/5`, `tournament/1/replay/3/round/2/meeting/5` or `game/ID`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum GameSeed {
    /// One of a round; both games of a mirrored pair have the same.
    Meeting {
        /// The number of the tournament in its season, from 1.
        tournament: u32,
        round: RoundNumber,
        /// From 1, in the order in which the round was drawn.
        meeting: u32,
    },
    /// The same meeting in one of the times that the whole schedule is played again.
    Replay {
        /// The number of the tournament in its season, from 1.
        tournament: u32,
        /// Which time, from 1.
        replay: u32,
        round: RoundNumber,
        /// From 1.
        meeting: u32,
    },
    /// One that does not count: its own.
    Free(GameId),
}

impl GameSeed {
    /// The seed that follows from the season's secret.
    #[must_use]
    pub fn seed(self, season_secret: &Seed) -> Seed {
        match self {
            Self::Meeting {
                tournament,
                round,
                meeting,
            } => season_secret.tournament(tournament).meeting(round, meeting),
            Self::Replay {
                tournament,
                replay,
                round,
                meeting,
            } => season_secret
                .tournament(tournament)
                .derive("replay", &replay.to_le_bytes())
                .meeting(round, meeting),
            Self::Free(game) => season_secret.derive("game", game.as_uuid().as_bytes()),
        }
    }
}

impl Seed {
    /// Season secret → the seed from which a tournament's schedule is drawn, and its games' seeds follow. It
    /// follows from the tournament's number in the season, so that the same season played again has the same one.
    #[must_use]
    pub fn tournament(&self, number: u32) -> Self {
        self.derive("tournament", &number.to_le_bytes())
    }

    fn meeting(&self, round: RoundNumber, meeting: u32) -> Self {
        self.derive("round", &round.get().to_le_bytes())
            .derive("meeting", &meeting.to_le_bytes())
    }
}

impl fmt::Display for GameSeed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Meeting {
                tournament,
                round,
                meeting,
            } => write!(f, "tournament/{tournament}/round/{round}/meeting/{meeting}"),
            Self::Replay {
                tournament,
                replay,
                round,
                meeting,
            } => write!(
                f,
                "tournament/{tournament}/replay/{replay}/round/{round}/meeting/{meeting}"
            ),
            Self::Free(game) => write!(f, "game/{game}"),
        }
    }
}

/// Text that is no label of a game's seed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("not the label of a game's seed")]
pub struct ParseGameSeedError;

impl FromStr for GameSeed {
    type Err = ParseGameSeedError;
    fn from_str(s: &str) -> Result<Self, Self::Err> {
        fn number(text: &str) -> Result<u32, ParseGameSeedError> {
            text.parse().map_err(|_| ParseGameSeedError)
        }
        let round = |text| RoundNumber::try_from(number(text)?).map_err(|_| ParseGameSeedError);
        let parts: Vec<&str> = s.split('/').collect();
        Ok(match parts[..] {
            ["tournament", tournament, "round", at, "meeting", meeting] => Self::Meeting {
                tournament: number(tournament)?,
                round: round(at)?,
                meeting: number(meeting)?,
            },
            [
                "tournament",
                tournament,
                "replay",
                replay,
                "round",
                at,
                "meeting",
                meeting,
            ] => Self::Replay {
                tournament: number(tournament)?,
                replay: number(replay)?,
                round: round(at)?,
                meeting: number(meeting)?,
            },
            ["game", id] => Self::Free(id.parse().map_err(|_| ParseGameSeedError)?),
            _ => return Err(ParseGameSeedError),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_place_has_a_seed_of_its_own_and_a_text_that_reads_back() {
        let secret = Seed::from_number(3);
        let [first, second] = [RoundNumber::FIRST, RoundNumber::SECOND];
        let meeting = |tournament, round, meeting| GameSeed::Meeting {
            tournament,
            round,
            meeting,
        };
        let replay = |replay| GameSeed::Replay {
            tournament: 1,
            replay,
            round: first,
            meeting: 1,
        };
        let all = [
            meeting(1, first, 1),
            meeting(1, first, 2),
            meeting(1, second, 1),
            meeting(2, first, 1),
            replay(1),
            replay(2),
            GameSeed::Free(GameId::new()),
            GameSeed::Free(GameId::new()),
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
            assert!(wrong.parse::<GameSeed>().is_err(), "{wrong}");
        }
    }
}
