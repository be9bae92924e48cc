//! The tables of a tournament: the standings of all rounds, or those of the final and of each group.

use super::{groups::group_standings, progress::Progress};
use crate::tournament::{
    bye::Bye,
    game::PlayedGame,
    standings::{StandingsRow, score_tournament_with},
};
use serde::{Deserialize, Serialize};

/// The standings of a tournament or a part of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct Table {
    /// The games that the standings are of.
    #[serde(rename = "of")]
    pub scope: TableScope,
    /// Rows of the table, best first.
    pub standings: Vec<StandingsRow>,
}

/// The part of a tournament that a table covers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum TableScope {
    /// All rounds of a tournament without groups.
    Tournament,
    /// The group with this number, from 1.
    Group(u32),
    /// The final; its first team is the champion.
    Final,
}

/// The table of all rounds, with the byes that give points.
pub(super) fn overall_table(progress: &Progress<'_>, byes: &[Bye]) -> Table {
    Table {
        scope: TableScope::Tournament,
        standings: score_tournament_with(progress.games, progress.departures, byes).standings,
    }
}

/// The tables of the final and of each group.
pub(super) fn group_tables(progress: &Progress<'_>) -> Vec<Table> {
    let mut tables = Vec::new();
    // The first round is the group stage, the second the final.
    if let Some(final_round) = progress.rounds.get(1) {
        let final_games: Vec<PlayedGame> = progress
            .games
            .iter()
            .filter(|game| game.round() == final_round.number.get())
            .cloned()
            .collect();
        tables.push(Table {
            scope: TableScope::Final,
            standings: score_tournament_with(&final_games, progress.departures, &[]).standings,
        });
    }
    let Some(first) = progress.rounds.first() else {
        return tables;
    };
    for (number, group) in (1..).zip(&first.groups) {
        tables.push(Table {
            scope: TableScope::Group(number),
            standings: group_standings(group, first, progress.games, progress.departures),
        });
    }
    tables
}
