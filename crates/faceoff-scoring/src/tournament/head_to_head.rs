//! Head-to-head records: the games of each two teams against each other.

use super::{game::PlayedGame, side::Side};
use faceoff_types::TeamName;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The record of two teams' games against each other. Pairs are in the order of `teams`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct HeadToHead {
    /// The teams, sorted by name.
    pub teams: [TeamName; 2],
    /// Games that each won.
    pub wins: [u32; 2],
    /// Games without a winner.
    pub draws: u32,
    /// Goals of each team, without points for fouls; for a game that the other side forfeited 10, or the goals of a larger lead.
    pub goals: [u64; 2],
}

impl HeadToHead {
    /// Number of games, including draws.
    #[must_use]
    pub const fn games(&self) -> u32 {
        self.wins[0] + self.wins[1] + self.draws
    }
}

/// The records of all pairs of teams that met, sorted by the teams' names.
#[must_use]
pub fn head_to_head<'a>(games: impl IntoIterator<Item = &'a PlayedGame>) -> Vec<HeadToHead> {
    let mut records = BTreeMap::<[&TeamName; 2], HeadToHead>::new();
    for game in games {
        let teams = game.teams();
        // The side of the game for each position in the record.
        let sides = if teams[0] < teams[1] {
            [Side::Home, Side::Away]
        } else {
            [Side::Away, Side::Home]
        };
        let teams = sides.map(|side| teams[side as usize]);
        let record = records.entry(teams).or_insert_with(|| HeadToHead {
            teams: teams.map(TeamName::clone),
            wins: [0; 2],
            draws: 0,
            goals: [0; 2],
        });
        for (index, side) in sides.into_iter().enumerate() {
            record.goals[index] += u64::from(game.counted_goals()[side as usize]);
            if game.winner() == Some(side) {
                record.wins[index] += 1;
            }
        }
        if game.winner().is_none() {
            record.draws += 1;
        }
    }
    records.into_values().collect()
}
