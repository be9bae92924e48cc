//! Filters of notices of events. A filter item is a topic (a group of events), a subject (the resource that an event changes)
//! or an event kind.

use crate::{notice::Notice, topic::Topic};
use faceoff_store::{Event, Subject};
use std::{fmt, str::FromStr};

/// Maximum number of items in a filter.
pub const MAX_FILTER_ITEMS: usize = 50;

/// Text that is not a valid filter.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ParseNoticeFilterError {
    /// No topic, subject or event kind.
    #[error(
        "expected a topic ({topics}), a subject as stage:ID, team:ID, tournament:ID or evaluation:ID, or the name of an \
         event as day_released; got {0:?}",
        topics = Topic::ALL.map(Topic::name).join(", ")
    )]
    Unknown(String),
    #[error("expected at most {MAX_FILTER_ITEMS} items, got {0}")]
    TooMany(usize),
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum FilterItem {
    Topic(Topic),
    Subject(Subject),
    /// Kind of an event, as `day_released`.
    Kind(String),
}

impl FilterItem {
    fn matches(&self, notice: &Notice) -> bool {
        match self {
            Self::Topic(topic) => topic.includes(notice.subject, &notice.event),
            Self::Subject(subject) => notice.is_about(*subject),
            Self::Kind(kind) => notice.kind == *kind,
        }
    }
}

impl FromStr for FilterItem {
    type Err = ParseNoticeFilterError;

    fn from_str(text: &str) -> Result<Self, ParseNoticeFilterError> {
        if let Ok(topic) = text.parse() {
            return Ok(Self::Topic(topic));
        }
        let unknown = || ParseNoticeFilterError::Unknown(text.chars().take(80).collect());
        if text.contains(':') {
            return text.parse().map(Self::Subject).map_err(|_| unknown());
        }
        Event::check_kind(text).map_err(|_| unknown())?;
        Ok(Self::Kind(text.to_owned()))
    }
}

impl fmt::Display for FilterItem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Topic(topic) => topic.fmt(f),
            Self::Subject(subject) => subject.fmt(f),
            Self::Kind(kind) => f.write_str(kind),
        }
    }
}

/// A filter of notices. A notice matches if it matches any of the items; a filter without items matches all notices.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct NoticeFilter(Vec<FilterItem>);

impl NoticeFilter {
    /// Parses the words of a request or a database row.
    ///
    /// # Errors
    /// If a word is unknown, or there are more than [`MAX_FILTER_ITEMS`].
    pub fn parse(words: &[String]) -> Result<Self, ParseNoticeFilterError> {
        if words.len() > MAX_FILTER_ITEMS {
            return Err(ParseNoticeFilterError::TooMany(words.len()));
        }
        let items = words.iter().map(|word| word.trim().parse());
        items.collect::<Result<_, _>>().map(Self)
    }

    #[must_use]
    pub fn matches(&self, notice: &Notice) -> bool {
        self.0.is_empty() || self.0.iter().any(|item| item.matches(notice))
    }

    /// The words that [`parse`](Self::parse) accepts.
    #[must_use]
    pub fn to_words(&self) -> Vec<String> {
        self.0.iter().map(FilterItem::to_string).collect()
    }
}

impl FromStr for NoticeFilter {
    type Err = ParseNoticeFilterError;

    fn from_str(text: &str) -> Result<Self, ParseNoticeFilterError> {
        let words = text.split(',').map(str::to_owned);
        Self::parse(&words.collect::<Vec<_>>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_types::StageId;

    #[test]
    fn filter_round_trips_as_words() {
        let subject = format!("stage:{}", StageId::new());
        let text = format!("board, queue,{subject},day_released,season");
        let filter: NoticeFilter = text.parse().unwrap();
        let words = filter.to_words();
        assert_eq!(
            words,
            ["board", "queue", &subject, "day_released", "season"]
        );
        assert_eq!(NoticeFilter::parse(&words), Ok(filter));
    }

    #[test]
    fn unknown_words_are_refused() {
        for wrong in ["boards", "stage:none", "", "board,,queue", "day_release"] {
            let error = wrong.parse::<NoticeFilter>().unwrap_err().to_string();
            assert!(error.contains("board, queue"), "{error}");
        }
        let many = vec!["board".to_owned(); MAX_FILTER_ITEMS + 1];
        assert_eq!(
            NoticeFilter::parse(&many),
            Err(ParseNoticeFilterError::TooMany(MAX_FILTER_ITEMS + 1))
        );
    }
}
