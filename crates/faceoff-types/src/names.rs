use crate::is_harmless;
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// The longest name, in characters.
const MAX_CHARS: usize = 40;

/// Why a text is no name of a team, a stage, a person or a division.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("a {kind} name {why}")]
pub struct InvalidName {
    kind: &'static str,
    why: Why,
}

#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
enum Why {
    /// Too short or too long.
    #[error("has 1 to {MAX_CHARS} characters, this one has {0}")]
    Length(usize),
    /// A character that a board would not show well.
    #[error("has letters, digits, spaces and . _ - only, not {0:?}")]
    Character(char),
    /// A space at an end.
    #[error("neither starts nor ends with a space")]
    Space,
}

fn check(s: &str) -> Result<(), Why> {
    let chars = s.chars().count();
    if !(1..=MAX_CHARS).contains(&chars) {
        return Err(Why::Length(chars));
    }
    let allowed = |c: &char| " ._-".contains(*c) || (c.is_alphanumeric() && is_harmless(*c));
    if let Some(bad) = s.chars().find(|c| !allowed(c)) {
        return Err(Why::Character(bad));
    }
    if s.starts_with(' ') || s.ends_with(' ') {
        return Err(Why::Space);
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
                check(s).map_err(|why| InvalidName { kind: $kind, why })?;
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
    /// A stage's name, of the same characters as a team's.
    StageName,
    "stage"
);
name!(
    /// A person's name, by which they sign in, of the same characters as a team's.
    PersonName,
    "person's"
);
name!(
    /// A division's name, of the same characters as a team's.
    DivisionName,
    "division"
);

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
        assert_eq!(check(""), Err(Why::Length(0)));
        assert_eq!(check(&"a".repeat(41)), Err(Why::Length(41)));
        assert_eq!(check("<b>"), Err(Why::Character('<')));
        for invisible in ['\u{202e}', '\u{200f}', '\u{3164}', '\u{1b}', '\u{9b}'] {
            assert_eq!(
                check(&format!("a{invisible}b")),
                Err(Why::Character(invisible))
            );
        }
        assert_eq!(check(" a"), Err(Why::Space));
        let refused = "".parse::<StageName>().unwrap_err().to_string();
        assert_eq!(
            refused,
            "a stage name has 1 to 40 characters, this one has 0"
        );
    }
}
