//! The cross table: a row and a column for each team; each cell has the games of two teams.

use crate::game_row::{GameRow, GameState};
use faceoff_types::{GameId, TeamId, TeamName};

/// A cross table of all teams or of a group.
pub(super) struct CrossTable {
    pub(super) title: String,
    pub(super) id: String,
    pub(super) rows: Vec<Row>,
}

pub(super) struct Row {
    pub(super) number: usize,
    pub(super) team: TeamName,
    pub(super) team_id: TeamId,
    /// In the order of the rows; empty without a game, `None` on the diagonal.
    pub(super) cells: Vec<Option<Vec<Cell>>>,
}

/// A game from the perspective of the team in the row.
pub(super) struct Cell {
    pub(super) game: GameId,
    pub(super) label: String,
    /// Symbol for won, lost or drawn.
    pub(super) symbol: &'static str,
    pub(super) class: &'static str,
    /// The text that follows the label in the accessible name: won or lost, opponent, round.
    pub(super) description: String,
}

impl CrossTable {
    /// `games`: may include games of other teams.
    pub(super) fn new(title: String, teams: &[(TeamId, TeamName)], games: &[&GameRow]) -> Self {
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

/// The games of two teams, from the perspective of the first one.
fn cells(own: TeamId, other: TeamId, games: &[&GameRow]) -> Vec<Cell> {
    let common = games.iter().filter_map(|game| match game.team_ids {
        [home, away] if home == own && away == other => Some((*game, 0)),
        [home, away] if home == other && away == own => Some((*game, 1)),
        _ => None,
    });
    common.map(|(game, side)| Cell::new(game, side)).collect()
}

impl Cell {
    fn new(game: &GameRow, side: usize) -> Self {
        let (label, symbol, class, result) = match game.state {
            GameState::Played { score, winner } => {
                let label = format!("{}:{}", score[side], score[1 - side]);
                match winner {
                    Some(winner) if winner == side => (label, "✓", "won", "won"),
                    Some(_) => (label, "✕", "lost", "lost"),
                    None => (label, "=", "drawn", "drawn"),
                }
            }
            _ => (game.score(), "", "open", ""),
        };
        let mut description = String::new();
        if !result.is_empty() {
            description.push_str(&format!(" {result}"));
        }
        description.push_str(&format!(
            " against {}, round {}",
            game.teams[1 - side],
            game.round
        ));
        if game.departed_team.is_some() {
            description.push_str(", does not count");
        }
        Self {
            game: game.id,
            label,
            symbol,
            class: if game.departed_team.is_some() {
                "excluded"
            } else {
                class
            },
            description,
        }
    }
}
