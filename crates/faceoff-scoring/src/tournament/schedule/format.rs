use super::{
    error::ScheduleError,
    groups::{draw_groups, finalists, group_matchdays},
    progress::Progress,
    round::Round,
    round_robin::round_robin,
    swiss::{byes, swiss},
    tables::{self, Table},
};
use crate::{draws::Draws, tournament::bye::Bye};
use faceoff_types::{Seed, TeamName, TournamentFormat};

/// What follows from a format.
pub trait Schedule {
    /// The next round; `None` after the last one.
    ///
    /// All that is drawn follows from `seed` and the round's number, whatever was drawn before.
    ///
    /// # Errors
    /// If fewer than two teams are left, the groups do not fit the teams, a game of an earlier round has
    /// no result, or rounds and games do not belong together.
    fn next_round(
        &self,
        seed: &Seed,
        progress: &Progress<'_>,
    ) -> Result<Option<Round>, ScheduleError>;

    /// The byes that give points: those of a Swiss tournament.
    #[must_use]
    fn byes(&self, rounds: &[Round]) -> Vec<Bye>;

    /// The standings, the deciding ones first: one table, or the final's and each group's.
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
            .next_number()
            .filter(|number| *number <= self.last_round())
        else {
            return Ok(None);
        };
        let playing: Vec<&TeamName> = progress.playing().collect();
        if playing.len() < 2 {
            return Err(ScheduleError::TooFew(playing.len()));
        }
        let mut draws = Draws::from_seed(&seed.derive("schedule", &number.get().to_le_bytes()));
        let meetings = progress.meetings();
        let mut groups = Vec::new();
        let matchdays = match self {
            Self::RoundRobin { .. } => {
                let mut teams = playing;
                draws.shuffle(&mut teams);
                round_robin(&teams, &meetings)
            }
            Self::Swiss { .. } => vec![swiss(progress, &mut draws)],
            Self::Groups {
                groups: count,
                advance,
            } => match progress.rounds.first() {
                None => {
                    let count = check_groups(playing.len(), *count, *advance)?;
                    groups = draw_groups(playing, count, &mut draws);
                    group_matchdays(&groups, &meetings)
                }
                Some(first) => {
                    let through = finalists(progress, first, *advance as usize);
                    if through.len() < 2 {
                        return Err(ScheduleError::TooFewFinalists(through.len()));
                    }
                    let mut teams = playing;
                    teams.retain(|team| through.contains(team));
                    draws.shuffle(&mut teams);
                    round_robin(&teams, &meetings)
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
            Self::Groups { .. } => tables::of_groups(progress),
            Self::RoundRobin { .. } | Self::Swiss { .. } => {
                vec![tables::of_all(progress, &self.byes(progress.rounds))]
            }
        }
    }
}

/// The number of groups, if it fits.
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
        let least = if count == 1 { 2 } else { 1 };
        return Err(ScheduleError::Format(format!(
            "advance: expected {least} to {smallest}, the size of the smallest group, got {advance}"
        )));
    }
    Ok(count)
}
