//! Which notices somebody wants.

use crate::{notice::Notice, topic::Topic};
use faceoff_store::{Event, Subject};
use std::{fmt, str::FromStr};

/// As many things may be named.
pub const MAX_ITEMS: usize = 50;

/// Text that names nothing that there is to follow.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ParseAboutError {
    /// It is none of the words.
    #[error(
        "expected a topic ({topics}), a subject as stage:ID, team:ID, tournament:ID or evaluation:ID, or the name of an \
         event as day_released; got {0:?}",
        topics = Topic::ALL.map(Topic::name).join(", ")
    )]
    Unknown(String),
    /// Too many of them.
    #[error("expected at most {MAX_ITEMS} things, got {0}")]
    TooMany(usize),
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum Item {
    Topic(Topic),
    Subject(Subject),
    /// The name of an event.
    Kind(String),
}

impl Item {
    fn takes(&self, notice: &Notice) -> bool {
        match self {
            Self::Topic(topic) => topic.has(notice.subject, &notice.event),
            Self::Subject(subject) => notice.is_about(*subject),
            Self::Kind(kind) => notice.kind == *kind,
        }
    }
}

impl FromStr for Item {
    type Err = ParseAboutError;

    fn from_str(text: &str) -> Result<Self, ParseAboutError> {
        if let Ok(topic) = text.parse() {
            return Ok(Self::Topic(topic));
        }
        let unknown = || ParseAboutError::Unknown(text.chars().take(80).collect());
        if text.contains(':') {
            return text.parse().map(Self::Subject).map_err(|_| unknown());
        }
        Event::check_kind(text).map_err(|_| unknown())?;
        Ok(Self::Kind(text.to_owned()))
    }
}

impl fmt::Display for Item {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Topic(topic) => topic.fmt(f),
            Self::Subject(subject) => subject.fmt(f),
            Self::Kind(kind) => f.write_str(kind),
        }
    }
}

/// What somebody follows: whatever fits one of these; everything, if it names nothing.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct About(Vec<Item>);

impl About {
    /// Of words as a request or a row has them.
    ///
    /// # Errors
    /// If one names nothing, or there are too many.
    pub fn of(words: &[String]) -> Result<Self, ParseAboutError> {
        if words.len() > MAX_ITEMS {
            return Err(ParseAboutError::TooMany(words.len()));
        }
        let items = words.iter().map(|word| word.trim().parse());
        items.collect::<Result<_, _>>().map(Self)
    }

    /// Is a notice of what is followed?
    #[must_use]
    pub fn takes(&self, notice: &Notice) -> bool {
        self.0.is_empty() || self.0.iter().any(|item| item.takes(notice))
    }

    /// As [`of`](Self::of) takes them.
    #[must_use]
    pub fn words(&self) -> Vec<String> {
        self.0.iter().map(Item::to_string).collect()
    }
}

impl FromStr for About {
    type Err = ParseAboutError;

    fn from_str(text: &str) -> Result<Self, ParseAboutError> {
        let words = text.split(',').map(str::to_owned);
        Self::of(&words.collect::<Vec<_>>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_types::StageId;

    #[test]
    fn what_is_followed_reads_back_as_it_is_written() {
        let stage = format!("stage:{}", StageId::new());
        let text = format!("board, queue,{stage},day_released,season");
        let about: About = text.parse().unwrap();
        let words = about.words();
        assert_eq!(words, ["board", "queue", &stage, "day_released", "season"]);
        assert_eq!(About::of(&words), Ok(about));
    }

    #[test]
    fn what_names_nothing_is_refused_in_words() {
        for wrong in ["boards", "stage:none", "", "board,,queue", "day_release"] {
            let error = wrong.parse::<About>().unwrap_err().to_string();
            assert!(error.contains("board, queue"), "{error}");
        }
        let many = vec!["board".to_owned(); MAX_ITEMS + 1];
        assert_eq!(About::of(&many), Err(ParseAboutError::TooMany(51)));
    }
}
