use crate::is_harmless;
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// A team's name as the board shows it: 1 to 40 characters, letters, digits, spaces and `. _ -`,
/// without leading or trailing space.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(try_from = "String", into = "String")]
pub struct TeamName(String);

impl TeamName {
    /// The longest name, in characters.
    pub const MAX_CHARS: usize = 40;

    /// The name.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for TeamName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.0)
    }
}

/// Why a text is no team name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum InvalidTeamName {
    /// Too short or too long.
    #[error("a team name has 1 to {max} characters, this one has {0}", max = TeamName::MAX_CHARS)]
    Length(usize),
    /// A character that the board would not show well.
    #[error("a team name has letters, digits, spaces and . _ - only, not {0:?}")]
    Character(char),
    /// A space at an end.
    #[error("a team name neither starts nor ends with a space")]
    Space,
}

impl FromStr for TeamName {
    type Err = InvalidTeamName;
    fn from_str(s: &str) -> Result<Self, Self::Err> {
        let chars = s.chars().count();
        if !(1..=Self::MAX_CHARS).contains(&chars) {
            return Err(InvalidTeamName::Length(chars));
        }
        let allowed = |c: &char| " ._-".contains(*c) || (c.is_alphanumeric() && is_harmless(*c));
        if let Some(bad) = s.chars().find(|c| !allowed(c)) {
            return Err(InvalidTeamName::Character(bad));
        }
        if s.starts_with(' ') || s.ends_with(' ') {
            return Err(InvalidTeamName::Space);
        }
        Ok(Self(s.to_owned()))
    }
}

impl TryFrom<String> for TeamName {
    type Error = InvalidTeamName;
    fn try_from(s: String) -> Result<Self, Self::Error> {
        s.parse()
    }
}

impl From<TeamName> for String {
    fn from(name: TeamName) -> Self {
        name.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_the_paper_are_names() {
        for name in [
            "AiRLIHockey",
            "Air-HocKIT",
            "RL3_polimi",
            "Kalash Jain",
            "Zoë",
        ] {
            assert_eq!(name.parse::<TeamName>().map(String::from), Ok(name.into()));
        }
    }

    #[test]
    fn what_a_page_could_not_show_is_refused() {
        assert_eq!("".parse::<TeamName>(), Err(InvalidTeamName::Length(0)));
        assert_eq!(
            "a".repeat(41).parse::<TeamName>(),
            Err(InvalidTeamName::Length(41))
        );
        assert_eq!(
            "<b>".parse::<TeamName>(),
            Err(InvalidTeamName::Character('<'))
        );
        for invisible in ['\u{202e}', '\u{200f}', '\u{3164}', '\u{1b}', '\u{9b}'] {
            assert_eq!(
                format!("a{invisible}b").parse::<TeamName>(),
                Err(InvalidTeamName::Character(invisible))
            );
        }
        assert_eq!(" a".parse::<TeamName>(), Err(InvalidTeamName::Space));
    }
}
