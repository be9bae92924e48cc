//! Standings of a tournament for its page.

use crate::{format, tournament_text::departure_label};
use faceoff_scoring::tournament::schedule::{Table, TableScope};
use faceoff_service::{problem::Problem, views::tournament_state::TournamentState};
use faceoff_types::{TeamId, TeamName};

/// Standings of all rounds, of the final or of a group.
pub(super) struct Standings {
    pub(super) title: String,
    pub(super) id: String,
    /// Best first.
    pub(super) rows: Vec<Row>,
    pub(super) has_byes: bool,
    /// Numbers of the rounds that have a column of points; none if there is one round only, and in groups and the final.
    pub(super) rounds: Vec<usize>,
}

pub(super) struct Row {
    pub(super) rank: u32,
    pub(super) team: TeamName,
    pub(super) team_id: TeamId,
    pub(super) points: u32,
    /// Points of each round.
    pub(super) per_round: Vec<u32>,
    pub(super) wins: u32,
    pub(super) draws: u32,
    pub(super) losses: u32,
    /// Matchdays without an opponent.
    pub(super) byes: u32,
    /// Goals scored and conceded.
    pub(super) goals: [u64; 2],
    pub(super) difference: String,
    pub(super) penalty_points: String,
    /// How the team left the tournament, if it did.
    pub(super) departure: Option<&'static str>,
}

/// Title of a table.
pub(super) fn title(scope: TableScope) -> String {
    match scope {
        TableScope::Tournament => "Standings".to_owned(),
        TableScope::Group(number) => format!("Group {number}"),
        TableScope::Final => "Final round".to_owned(),
    }
}

impl Standings {
    pub(super) fn new(state: &TournamentState, table: &Table) -> Result<Self, Problem> {
        let rows: Vec<Row> = table
            .standings
            .iter()
            .map(|standing| {
                Ok(Row {
                    rank: standing.rank,
                    team: standing.team.clone(),
                    team_id: state.team(&standing.team)?,
                    points: standing.points,
                    per_round: standing.points_per_round.clone(),
                    wins: standing.wins,
                    draws: standing.draws,
                    losses: standing.losses,
                    byes: standing.byes,
                    goals: [standing.goals_for, standing.goals_against],
                    difference: difference(standing.goals_for, standing.goals_against),
                    penalty_points: format::one_decimal(standing.penalty_points),
                    departure: standing.departure.map(departure_label),
                })
            })
            .collect::<Result<_, Problem>>()?;
        let rounds = rows.first().map_or(0, |row| row.per_round.len());
        let is_overall = table.scope == TableScope::Tournament;
        let title = title(table.scope);
        Ok(Self {
            id: title.to_lowercase().replace(' ', "-"),
            title,
            has_byes: rows.iter().any(|row| row.byes > 0),
            rounds: if is_overall && rounds > 1 {
                (1..=rounds).collect()
            } else {
                Vec::new()
            },
            rows,
        })
    }
}

fn difference(scored: u64, conceded: u64) -> String {
    match scored.cmp(&conceded) {
        std::cmp::Ordering::Greater => format!("+{}", scored - conceded),
        std::cmp::Ordering::Equal => "0".to_owned(),
        std::cmp::Ordering::Less => format!("−{}", conceded - scored),
    }
}
