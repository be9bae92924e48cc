//! The entrants of a tournament: all teams that have ever entered it.

use super::error::ScheduleError;
use faceoff_types::TeamName;

/// Maximum number of teams in a tournament; a round robin with so many has 32,640 games.
pub const MAX_ENTRANTS: usize = 256;

/// All teams that have ever entered a tournament, including those that left.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entrants(Vec<TeamName>);

impl Entrants {
    /// Collects a list in any order.
    ///
    /// # Errors
    /// If there are fewer than two teams, more than [`MAX_ENTRANTS`], or a team is listed twice.
    pub fn new(teams: impl IntoIterator<Item = TeamName>) -> Result<Self, ScheduleError> {
        let mut teams: Vec<TeamName> = teams.into_iter().collect();
        // Sorted by name, so that the draw does not depend on the order of registration.
        teams.sort();
        if let Some(duplicate) = teams.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(ScheduleError::Duplicate(duplicate[0].clone()));
        }
        match teams.len() {
            0 | 1 => Err(ScheduleError::TooFew(teams.len())),
            got if got > MAX_ENTRANTS => Err(ScheduleError::TooMany {
                max: MAX_ENTRANTS,
                got,
            }),
            _ => Ok(Self(teams)),
        }
    }

    /// All entrants, sorted by name.
    pub fn iter(&self) -> impl Iterator<Item = &TeamName> {
        self.0.iter()
    }

    /// Whether a team is an entrant.
    #[must_use]
    pub fn contains(&self, team: &TeamName) -> bool {
        self.0.binary_search(team).is_ok()
    }
}
