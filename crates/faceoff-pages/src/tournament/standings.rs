//! Tables of a tournament as its page has them.

use crate::figures;
use faceoff_scoring::tournament::schedule::{Table, TableOf};
use faceoff_service::{problem::Problem, views::tournament_sheet::TournamentSheet};
use faceoff_types::{LeftAs, TeamId, TeamName};

/// A table: of all rounds, of the final, of a group.
pub(super) struct Standings {
    pub(super) title: String,
    pub(super) id: String,
    /// Best first.
    pub(super) rows: Vec<Row>,
    /// Has a team points by a bye?
    pub(super) has_byes: bool,
    /// The rounds whose points stand apart.
    pub(super) rounds: Vec<usize>,
}

pub(super) struct Row {
    pub(super) rank: u32,
    pub(super) team: TeamName,
    pub(super) team_id: TeamId,
    pub(super) points: u32,
    pub(super) per_round: Vec<u32>,
    pub(super) wins: u32,
    pub(super) draws: u32,
    pub(super) losses: u32,
    pub(super) byes: u32,
    pub(super) goals: [u64; 2],
    pub(super) difference: String,
    pub(super) penalty_points: String,
    pub(super) left: Option<&'static str>,
}

/// As tables are called.
pub(super) fn title(of: TableOf) -> String {
    match of {
        TableOf::Tournament => "Standings".to_owned(),
        TableOf::Group(number) => format!("Group {number}"),
        TableOf::Final => "Final round".to_owned(),
    }
}

impl Standings {
    pub(super) fn of(sheet: &TournamentSheet, table: &Table) -> Result<Self, Problem> {
        let rows: Vec<Row> = table
            .standings
            .iter()
            .map(|standing| {
                Ok(Row {
                    rank: standing.rank,
                    team: standing.team.clone(),
                    team_id: sheet.team(&standing.team)?,
                    points: standing.points,
                    per_round: standing.points_per_round.clone(),
                    wins: standing.wins,
                    draws: standing.draws,
                    losses: standing.losses,
                    byes: standing.byes,
                    goals: [standing.goals_for, standing.goals_against],
                    difference: difference(standing.goals_for, standing.goals_against),
                    penalty_points: figures::one(standing.penalty_points),
                    left: standing.left.map(left),
                })
            })
            .collect::<Result<_, Problem>>()?;
        let rounds = rows.first().map_or(0, |row| row.per_round.len());
        let is_of_all = table.of == TableOf::Tournament;
        let title = title(table.of);
        Ok(Self {
            id: title.to_lowercase().replace(' ', "-"),
            title,
            has_byes: rows.iter().any(|row| row.byes > 0),
            rounds: if is_of_all && rounds > 1 {
                (1..=rounds).collect()
            } else {
                Vec::new()
            },
            rows,
        })
    }
}

pub(super) const fn left(left_as: LeftAs) -> &'static str {
    match left_as {
        LeftAs::Withdrawn => "withdrawn",
        LeftAs::Disqualified => "disqualified",
    }
}

fn difference(scored: u64, conceded: u64) -> String {
    match scored.cmp(&conceded) {
        std::cmp::Ordering::Greater => format!("+{}", scored - conceded),
        std::cmp::Ordering::Equal => "0".to_owned(),
        std::cmp::Ordering::Less => format!("−{}", conceded - scored),
    }
}
