use super::{game::PlayedGame, side::Side};
use faceoff_types::TeamName;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What two teams' games against each other came to. Pairs are in the order of `teams`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct HeadToHead {
    /// The teams, by name.
    pub teams: [TeamName; 2],
    /// Games that each won.
    pub wins: [u32; 2],
    /// Games that neither won.
    pub draws: u32,
    /// Goals that each scored, without points for fouls; 10 of a game that the other forfeited.
    pub goals: [u64; 2],
}

impl HeadToHead {
    /// How often they met.
    #[must_use]
    pub const fn games(&self) -> u32 {
        self.wins[0] + self.wins[1] + self.draws
    }
}

/// The record of each two teams that met, by the teams' names.
#[must_use]
pub fn head_to_head<'a>(games: impl IntoIterator<Item = &'a PlayedGame>) -> Vec<HeadToHead> {
    let mut records = BTreeMap::<[&TeamName; 2], HeadToHead>::new();
    for game in games {
        let teams = game.teams();
        // Which side of the game stands where in the record.
        let order = if teams[0] < teams[1] {
            [Side::Home, Side::Away]
        } else {
            [Side::Away, Side::Home]
        };
        let teams = order.map(|side| teams[side as usize]);
        let record = records.entry(teams).or_insert_with(|| HeadToHead {
            teams: teams.map(TeamName::clone),
            wins: [0; 2],
            draws: 0,
            goals: [0; 2],
        });
        for (place, side) in order.into_iter().enumerate() {
            record.goals[place] += u64::from(game.counted_goals()[side as usize]);
            if game.winner() == Some(side) {
                record.wins[place] += 1;
            }
        }
        if game.winner().is_none() {
            record.draws += 1;
        }
    }
    records.into_values().collect()
}
