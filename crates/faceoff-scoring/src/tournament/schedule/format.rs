//! The schedule of each tournament format: round robin, Swiss, and groups followed by a final.

use super::{
    error::ScheduleError,
    groups::{draw_groups, finalists, group_matchdays},
    progress::Progress,
    round::Round,
    round_robin::round_robin,
    swiss::{byes, swiss},
    tables::{self, Table},
};
use crate::{random_numbers::RandomNumbers, tournament::bye::Bye};
use faceoff_types::{Seed, TeamName, TournamentFormat};

/// The schedule of a tournament format.
pub trait Schedule {
    /// The next round; `None` after the last one.
    ///
    /// Random draws depend only on `seed` and the round's number, not on earlier draws.
    ///
    /// # Errors
    /// If fewer than two teams are left, the number of groups does not fit the teams, a game of an earlier round has no
    /// result, or rounds and games do not match.
    fn next_round(
        &self,
        seed: &Seed,
        progress: &Progress<'_>,
    ) -> Result<Option<Round>, ScheduleError>;

    /// The byes that give points, which only Swiss tournaments have.
    #[must_use]
    fn byes(&self, rounds: &[Round]) -> Vec<Bye>;

    /// The standings, the decisive table first: one table, or those of the final and of each group.
    #[must_use]
    fn tables(&self, progress: &Progress<'_>) -> Vec<Table>;
}

impl Schedule for TournamentFormat {
    fn next_round(
        &self,
        seed: &Seed,
        progress: &Progress<'_>,
    ) -> Result<Option<Round>, ScheduleError> {
        progress.check()?;
        let Some(number) = progress
            .next_round_number()
            .filter(|number| *number <= self.last_round())
        else {
            return Ok(None);
        };
        let active: Vec<&TeamName> = progress.active_teams().collect();
        if active.len() < 2 {
            return Err(ScheduleError::TooFew(active.len()));
        }
        let mut random_numbers =
            RandomNumbers::from_seed(&seed.derive("schedule", &number.get().to_le_bytes()));
        let pairing_counts = progress.pairing_counts();
        let mut groups = Vec::new();
        let matchdays = match self {
            Self::RoundRobin { .. } => {
                let mut teams = active;
                random_numbers.shuffle(&mut teams);
                round_robin(&teams, &pairing_counts)
            }
            Self::Swiss { .. } => vec![swiss(progress, &mut random_numbers)],
            Self::Groups {
                groups: count,
                advance,
            } => match progress.rounds.first() {
                None => {
                    let count = check_groups(active.len(), *count, *advance)?;
                    groups = draw_groups(active, count, &mut random_numbers);
                    group_matchdays(&groups, &pairing_counts)
                }
                Some(first) => {
                    let finalists = finalists(progress, first, *advance as usize);
                    if finalists.len() < 2 {
                        return Err(ScheduleError::TooFewFinalists(finalists.len()));
                    }
                    let mut teams = active;
                    teams.retain(|team| finalists.contains(team));
                    random_numbers.shuffle(&mut teams);
                    round_robin(&teams, &pairing_counts)
                }
            },
        };
        Ok(Some(Round {
            number,
            groups,
            matchdays,
        }))
    }

    fn byes(&self, rounds: &[Round]) -> Vec<Bye> {
        match self {
            Self::Swiss { .. } => byes(rounds),
            Self::RoundRobin { .. } | Self::Groups { .. } => Vec::new(),
        }
    }

    fn tables(&self, progress: &Progress<'_>) -> Vec<Table> {
        match self {
            Self::Groups { .. } => tables::group_tables(progress),
            Self::RoundRobin { .. } | Self::Swiss { .. } => {
                vec![tables::overall_table(progress, &self.byes(progress.rounds))]
            }
        }
    }
}

/// Checks the numbers of groups and finalists against the number of teams; `advance` is the number of teams of each group that
/// reach the final.
fn check_groups(teams: usize, groups: u32, advance: u32) -> Result<usize, ScheduleError> {
    let count = groups as usize;
    if count < 1 || teams / count.max(1) < 2 {
        return Err(ScheduleError::Format(format!(
            "groups: expected 1 to {}, so that each of the {teams} teams has an opponent in its group, got {groups}",
            teams / 2
        )));
    }
    let smallest = teams / count;
    if advance < 1 || advance as usize > smallest || count * (advance as usize) < 2 {
        let min_advance = if count == 1 { 2 } else { 1 };
        return Err(ScheduleError::Format(format!(
            "advance: expected {min_advance} to {smallest}, the size of the smallest group, got {advance}"
        )));
    }
    Ok(count)
}
