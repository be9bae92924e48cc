use super::error::ScheduleError;
use faceoff_types::TeamName;

/// The most teams of a tournament; a round robin of so many has 32,640 games.
pub const MAX_ENTRANTS: usize = 256;

/// The teams of a tournament: everybody that has been in it, those that left included.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entrants(Vec<TeamName>);

impl Entrants {
    /// From a list in any order.
    ///
    /// # Errors
    /// If there are fewer than two, more than [`MAX_ENTRANTS`], or one twice.
    pub fn new(teams: impl IntoIterator<Item = TeamName>) -> Result<Self, ScheduleError> {
        let mut teams: Vec<TeamName> = teams.into_iter().collect();
        // The order of names, so that no order of entering shows in the draw.
        teams.sort();
        if let Some(twice) = teams.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(ScheduleError::Duplicate(twice[0].clone()));
        }
        match teams.len() {
            0 | 1 => Err(ScheduleError::TooFew(teams.len())),
            got if got > MAX_ENTRANTS => Err(ScheduleError::TooMany {
                most: MAX_ENTRANTS,
                got,
            }),
            _ => Ok(Self(teams)),
        }
    }

    /// By name.
    pub fn iter(&self) -> impl Iterator<Item = &TeamName> {
        self.0.iter()
    }

    /// Whether a team is among them.
    #[must_use]
    pub fn contains(&self, team: &TeamName) -> bool {
        self.0.binary_search(team).is_ok()
    }
}
