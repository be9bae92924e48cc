//! Names that people choose for teams, stages, divisions and users, in any script and with the same rules for all.

use crate::{is_printable, look_alikes::skeleton};
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};
use unicode_normalization::{UnicodeNormalization, char::is_combining_mark};

/// Longest name, in characters without accents and other marks.
const MAX_CHARS: usize = 40;

/// Most marks on one character. More of them would cover the lines above and below it, and no language writes so many.
const MAX_MARKS: usize = 4;

/// Signs that are part of names, beside letters and digits.
const SIGNS: &str = " ._-'’&+·・";

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
    #[error("has letters and digits of any script, spaces and . _ - ' & + · only, not {0:?}")]
    Character(char),
    #[error("has at most {MAX_MARKS} accents or other marks on a character")]
    Marks,
    /// A leading or trailing space.
    #[error("neither starts nor ends with a space")]
    Space,
}

fn check(text: &str) -> Result<(), NameProblem> {
    let chars = text.chars().filter(|c| !is_combining_mark(*c)).count();
    if !(1..=MAX_CHARS).contains(&chars) {
        return Err(NameProblem::Length(chars));
    }
    let mut marks = 0;
    let mut previous = ' ';
    let mut rest = text.chars().peekable();
    while let Some(c) = rest.next() {
        // Marks that count as letters, such as vowel signs, are letters here, too.
        let is_allowed = if is_combining_mark(c) && !c.is_alphabetic() {
            marks += 1;
            previous != ' ' && is_printable(c)
        } else if is_joiner(c) {
            can_join(previous) && rest.peek().is_some_and(|next| can_join(*next))
        } else {
            marks = 0;
            SIGNS.contains(c) || (c.is_alphanumeric() && is_printable(c))
        };
        if !is_allowed {
            return Err(NameProblem::Character(c));
        }
        if marks > MAX_MARKS {
            return Err(NameProblem::Marks);
        }
        previous = c;
    }
    if text.starts_with(' ') || text.ends_with(' ') {
        return Err(NameProblem::Space);
    }
    Ok(())
}

/// Invisible characters that decide how letters are joined: Persian and some Indian scripts need them.
const fn is_joiner(c: char) -> bool {
    matches!(c, '\u{200c}' | '\u{200d}')
}

/// Whether letters of this character's script can be joined. Only between two such letters may a name contain a joiner.
fn can_join(c: char) -> bool {
    // Arabic and Syriac; the scripts of India and its neighbours.
    matches!(c, '\u{600}'..='\u{7ff}' | '\u{8a0}'..='\u{dff}') && is_printable(c)
}

/// One form for texts that look the same: macOS, for example, splits “é” into a letter and an accent, and some keyboards type unusual
/// spaces. The result has “é” as one character, and ordinary spaces.
fn normalised(text: &str) -> String {
    let is_space = |c| {
        matches!(
            c,
            '\u{a0}' | '\u{2000}'..='\u{200a}' | '\u{202f}' | '\u{3000}'
        )
    };
    let with_spaces = text.chars().map(|c| if is_space(c) { ' ' } else { c });
    with_spaces.nfc().collect()
}

/// A text that is the same for names that look alike, as Unicode's list of confusable characters (UTS #39) knows them: letters of other
/// scripts, upper case, 0 and O. It is not for display.
#[must_use]
pub fn name_skeleton(name: &str) -> String {
    let without_joiners: String = name.trim().nfkc().filter(|c| !is_joiner(*c)).collect();
    // Upper and lower case of a letter may resemble different letters.
    let lower = without_joiners.to_lowercase();
    skeleton(&lower).to_lowercase()
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
                let name = normalised(s);
                check(&name).map_err(|problem| InvalidName { kind: $kind, problem })?;
                Ok(Self(name))
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
    /// A team's name as the board shows it: 1 to 40 characters, letters and digits of any script, spaces and `. _ - ' & + ·`,
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
    fn names_of_any_script_are_valid() {
        for name in [
            "AiRLIHockey",
            "Air-HocKIT",
            "RL3_polimi",
            "Kalash Jain",
            "Zoë",
            "Håkon O'Brien & Søn",
            "C++ Robots",
            "हिन्दी रोबोट",
            "می‌خواهم",
            "チーム・ロボ",
            "한국어 팀",
            "ทีมหุ่นยนต์",
        ] {
            assert_eq!(name.parse::<TeamName>().map(String::from), Ok(name.into()));
        }
    }

    #[test]
    fn names_are_stored_in_one_form() {
        let parsed = |text: &str| text.parse::<UserName>().unwrap().0;
        assert_eq!(parsed("Zoe\u{308}"), "Zoë", "as macOS writes it");
        assert_eq!(parsed("Kalash\u{a0}Jain"), "Kalash Jain");
        // A letter that is stored as two characters: the stored name is valid, too.
        let longest = "\u{958}".repeat(MAX_CHARS);
        let stored = parsed(&longest);
        assert_eq!(parsed(&stored), stored);
    }

    #[test]
    fn names_that_look_alike_have_the_same_skeleton() {
        for (name, other) in [
            ("AiRLIHockey", "airlihockey"),
            ("Alpha", "Αlphа"),
            ("Team 0", "Team O"),
            ("ＡＢＣ", "abc"),
            ("Zoë", "ZOE\u{308}"),
            ("می‌خواهم", "میخواهم"),
        ] {
            assert_eq!(name_skeleton(name), name_skeleton(other), "{name} {other}");
        }
        for (name, other) in [("Alpha", "Alpha 2"), ("Zoë", "Zoe"), ("Team 1", "Team 2")] {
            assert_ne!(name_skeleton(name), name_skeleton(other), "{name} {other}");
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
        assert_eq!(
            check("a\u{200d}b"),
            Err(NameProblem::Character('\u{200d}')),
            "an invisible character between Latin letters"
        );
        assert_eq!(
            check(&format!("a{}", "\u{301}".repeat(MAX_MARKS + 1))),
            Err(NameProblem::Marks)
        );
        assert_eq!(
            check("\u{301}a"),
            Err(NameProblem::Character('\u{301}')),
            "a mark without a letter"
        );
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
