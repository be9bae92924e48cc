//! Names that people choose for teams, stages, divisions and users, with the same rules for all.

use crate::is_printable;
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

const MAX_CHARS: usize = 40;

/// A text that cannot be the name of a team, stage, user or division.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("a {kind} name {problem}")]
pub struct InvalidName {
    kind: &'static str,
    problem: NameProblem,
}

#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
enum NameProblem {
    /// Too short or too long.
    #[error("has 1 to {MAX_CHARS} characters, this one has {0}")]
    Length(usize),
    /// A character that pages could not show safely.
    #[error("has letters, digits, spaces and . _ - only, not {0:?}")]
    Character(char),
    /// A leading or trailing space.
    #[error("neither starts nor ends with a space")]
    Space,
}

fn check(text: &str) -> Result<(), NameProblem> {
    let chars = text.chars().count();
    if !(1..=MAX_CHARS).contains(&chars) {
        return Err(NameProblem::Length(chars));
    }
    let allowed = |c: &char| " ._-".contains(*c) || (c.is_alphanumeric() && is_printable(*c));
    if let Some(character) = text.chars().find(|c| !allowed(c)) {
        return Err(NameProblem::Character(character));
    }
    if text.starts_with(' ') || text.ends_with(' ') {
        return Err(NameProblem::Space);
    }
    Ok(())
}

macro_rules! name {
    ($(#[$doc:meta])* $name:ident, $kind:literal) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
        #[serde(try_from = "String", into = "String")]
        pub struct $name(String);

        impl $name {
            #[must_use]
            pub fn as_str(&self) -> &str {
                &self.0
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.pad(&self.0)
            }
        }

        impl FromStr for $name {
            type Err = InvalidName;
            fn from_str(s: &str) -> Result<Self, InvalidName> {
                check(s).map_err(|problem| InvalidName { kind: $kind, problem })?;
                Ok(Self(s.to_owned()))
            }
        }

        impl TryFrom<String> for $name {
            type Error = InvalidName;
            fn try_from(s: String) -> Result<Self, InvalidName> {
                s.parse()
            }
        }

        impl From<$name> for String {
            fn from(name: $name) -> Self {
                name.0
            }
        }
    };
}

name!(
    /// A team's name as the board shows it: 1 to 40 characters, letters, digits, spaces and `. _ -`,
    /// without leading or trailing space.
    TeamName,
    "team"
);
name!(
    /// A stage's name, with the same rules as a team's.
    StageName,
    "stage"
);
name!(
    /// A user's name for signing in, with the same rules as a team's.
    UserName,
    "person's"
);
name!(
    /// A division's name, with the same rules as a team's.
    DivisionName,
    "division"
);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn team_names_of_the_paper_are_valid() {
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
    fn unprintable_or_padded_names_are_refused() {
        assert_eq!(check(""), Err(NameProblem::Length(0)));
        assert_eq!(
            check(&"a".repeat(MAX_CHARS + 1)),
            Err(NameProblem::Length(41))
        );
        assert_eq!(check("<b>"), Err(NameProblem::Character('<')));
        for invisible in ['\u{202e}', '\u{200f}', '\u{3164}', '\u{1b}', '\u{9b}'] {
            assert_eq!(
                check(&format!("a{invisible}b")),
                Err(NameProblem::Character(invisible))
            );
        }
        assert_eq!(check(" a"), Err(NameProblem::Space));
        let refused = "".parse::<StageName>().unwrap_err().to_string();
        assert_eq!(
            refused,
            "a stage name has 1 to 40 characters, this one has 0"
        );
    }
}
