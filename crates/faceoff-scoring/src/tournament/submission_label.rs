//! The label of a submission: a text that identifies one of a team's submissions in games and ratings.

use faceoff_types::is_printable;
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// Maximum length of a label in characters; the id of a submission has 36.
const MAX_CHARS: usize = 40;

/// Identifies one of a team's submissions, for example an id, a version or a tag: 1 to 40 letters, digits and `. _ -`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct SubmissionLabel(String);

/// An invalid submission label.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("a submission's label has 1 to {MAX_CHARS} letters, digits and . _ -; this one is {0:?}")]
pub struct InvalidSubmissionLabel(String);

impl SubmissionLabel {
    /// The label as text.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl FromStr for SubmissionLabel {
    type Err = InvalidSubmissionLabel;
    fn from_str(s: &str) -> Result<Self, Self::Err> {
        let allowed = |c: char| "._-".contains(c) || (c.is_alphanumeric() && is_printable(c));
        // One more than allowed is enough to reject a long label and to show it in the error.
        let shown: String = s.chars().take(MAX_CHARS + 1).collect();
        if (1..=MAX_CHARS).contains(&shown.chars().count()) && shown.chars().all(allowed) {
            Ok(Self(shown))
        } else {
            Err(InvalidSubmissionLabel(shown))
        }
    }
}

impl TryFrom<String> for SubmissionLabel {
    type Error = InvalidSubmissionLabel;
    fn try_from(s: String) -> Result<Self, Self::Error> {
        s.parse()
    }
}

impl From<SubmissionLabel> for String {
    fn from(label: SubmissionLabel) -> Self {
        label.0
    }
}

impl fmt::Display for SubmissionLabel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn label_accepts_ids_and_refuses_unprintable_text() {
        for label in ["v2", "018f3f1e-0d0a-7c3e-9b1a-2f6f6a6f6a6f", "1.0_final"] {
            assert_eq!(
                label.parse::<SubmissionLabel>().map(String::from),
                Ok(label.into())
            );
        }
        for wrong in ["", "a b", "<b>", "\u{202e}", &"a".repeat(41)] {
            assert!(wrong.parse::<SubmissionLabel>().is_err(), "{wrong:?}");
        }
    }
}
