use super::{groups::group_standings, progress::Progress};
use crate::tournament::{
    bye::Bye,
    game::PlayedGame,
    standings::{Standing, score_tournament_with},
};
use serde::{Deserialize, Serialize};

/// Standings of a tournament, or of a part of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct Table {
    /// Of what.
    pub of: TableOf,
    /// Best first.
    pub standings: Vec<Standing>,
}

/// What standings are of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum TableOf {
    /// All rounds.
    Tournament,
    /// A group, from 1.
    Group(u32),
    /// The final, whose first is the champion.
    Final,
}

/// Of all rounds, with the byes that give points.
pub(super) fn of_all(progress: &Progress<'_>, byes: &[Bye]) -> Table {
    let all = score_tournament_with(progress.games, progress.departures, byes);
    Table {
        of: TableOf::Tournament,
        standings: all.standings,
    }
}

/// Of the final and each group.
pub(super) fn of_groups(progress: &Progress<'_>) -> Vec<Table> {
    let mut tables = Vec::new();
    if let Some(last) = progress.rounds.get(1) {
        let of_final: Vec<PlayedGame> = progress
            .games
            .iter()
            .filter(|game| game.round() == last.number.get())
            .cloned()
            .collect();
        tables.push(Table {
            of: TableOf::Final,
            standings: score_tournament_with(&of_final, progress.departures, &[]).standings,
        });
    }
    let Some(first) = progress.rounds.first() else {
        return tables;
    };
    for (number, group) in (1..).zip(&first.groups) {
        tables.push(Table {
            of: TableOf::Group(number),
            standings: group_standings(group, first, progress.games, progress.departures),
        });
    }
    tables
}
