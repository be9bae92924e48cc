//! The cross table: a row and a column for each team, in each cell the games of the two.

use crate::game_row::{GameRow, Stands};
use faceoff_types::{GameId, TeamId, TeamName};

/// A cross table, of all teams or of a group.
pub(super) struct Cross {
    pub(super) title: String,
    pub(super) id: String,
    pub(super) rows: Vec<Row>,
}

pub(super) struct Row {
    pub(super) number: usize,
    pub(super) team: TeamName,
    pub(super) team_id: TeamId,
    /// In the order of the rows; empty where two have no game, `None` where a team meets itself.
    pub(super) cells: Vec<Option<Vec<Cell>>>,
}

/// A game from the row's side.
pub(super) struct Cell {
    pub(super) game: GameId,
    pub(super) word: String,
    /// The row's team has won, lost, or neither.
    pub(super) sign: &'static str,
    pub(super) class: &'static str,
    /// What a link's name says beside: won or lost, against whom, in which round.
    pub(super) told: String,
}

impl Cross {
    /// Of these teams, in this order, and of the games among them.
    pub(super) fn of(title: String, teams: &[(TeamId, TeamName)], games: &[&GameRow]) -> Self {
        let rows = (1..).zip(teams).map(|(number, (team_id, team))| Row {
            number,
            team: team.clone(),
            team_id: *team_id,
            cells: teams
                .iter()
                .map(|(other, _)| (other != team_id).then(|| cells(*team_id, *other, games)))
                .collect(),
        });
        Self {
            id: format!("cross-{}", title.to_lowercase().replace(' ', "-")),
            rows: rows.collect(),
            title,
        }
    }
}

fn cells(own: TeamId, other: TeamId, games: &[&GameRow]) -> Vec<Cell> {
    let of_both = games.iter().filter_map(|game| match game.team_ids {
        [home, away] if home == own && away == other => Some((*game, 0)),
        [home, away] if home == other && away == own => Some((*game, 1)),
        _ => None,
    });
    of_both.map(|(game, side)| Cell::of(game, side)).collect()
}

impl Cell {
    fn of(game: &GameRow, side: usize) -> Self {
        let (word, sign, class, result) = match game.stands {
            Stands::Played { score, winner } => {
                let word = format!("{}:{}", score[side], score[1 - side]);
                match winner {
                    Some(won) if won == side => (word, "✓", "won", "won"),
                    Some(_) => (word, "✕", "lost", "lost"),
                    None => (word, "=", "drawn", "drawn"),
                }
            }
            _ => (game.score(), "", "open", ""),
        };
        let mut told = String::new();
        if !result.is_empty() {
            told.push_str(&format!(" {result}"));
        }
        told.push_str(&format!(
            " against {}, round {}",
            game.teams[1 - side],
            game.round
        ));
        if game.taken_out_by.is_some() {
            told.push_str(", does not count");
        }
        Self {
            game: game.id,
            word,
            sign,
            class: if game.taken_out_by.is_some() {
                "out"
            } else {
                class
            },
            told,
        }
    }
}
