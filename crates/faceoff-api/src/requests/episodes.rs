//! Filter of an evaluation's episodes, for the page that lists them: by task, outcome, violated limit and end.

use faceoff_replay::EpisodeIndexEntry;
use faceoff_types::{EpisodeEnd, Task, ViolationName};
use serde::{Deserialize, Serialize};

/// Query of the page with an evaluation's episodes. An empty form field selects all episodes.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EpisodesQuery {
    /// A task of the competition.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub task: String,
    /// `success` or `failure`.
    // `went` is its earlier name, in old links.
    #[serde(default, alias = "went", skip_serializing_if = "String::is_empty")]
    pub outcome: String,
    /// The limit that the episode violated: a kind of violation of the competition, `any` of these, or the time of an answer (`late`).
    // `broke` is its earlier name, in old links.
    #[serde(default, alias = "broke", skip_serializing_if = "String::is_empty")]
    pub violated: String,
    /// How the episode ended.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub end: String,
    /// The page, from 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub page: Option<u32>,
}

/// A parsed [`EpisodesQuery`]: an episode must match all conditions that are given.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct EpisodeFilter {
    /// The episode's task.
    pub task: Option<Task>,
    /// Whether the episode succeeded.
    pub success: Option<bool>,
    /// The limit that the episode violated.
    pub violated: Option<ViolatedLimit>,
    /// How the episode ended.
    pub end: Option<EpisodeEnd>,
}

/// A limit that an episode violated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ViolatedLimit {
    /// At least one constraint.
    Any,
    /// This limit of the competition.
    One(ViolationName),
    /// The time limit of an answer, which is one control step.
    Late,
}

impl EpisodesQuery {
    /// The conditions in parsed form.
    ///
    /// # Errors
    /// The name of the first invalid field.
    pub fn filter(&self) -> Result<EpisodeFilter, &'static str> {
        fn parse_field<'a, T: Deserialize<'a>>(
            text: &'a str,
            field: &'static str,
        ) -> Result<Option<T>, &'static str> {
            if text.is_empty() {
                return Ok(None);
            }
            let deserializer: serde::de::value::StrDeserializer<'a, serde::de::value::Error> =
                serde::de::IntoDeserializer::into_deserializer(text);
            T::deserialize(deserializer).map(Some).map_err(|_| field)
        }
        Ok(EpisodeFilter {
            task: parse_field(&self.task, "task")?,
            success: match self.outcome.as_str() {
                "" => None,
                "success" => Some(true),
                "failure" => Some(false),
                _ => return Err("outcome"),
            },
            violated: match self.violated.as_str() {
                "" => None,
                "any" => Some(ViolatedLimit::Any),
                "late" => Some(ViolatedLimit::Late),
                name => parse_field(name, "violated")?.map(ViolatedLimit::One),
            },
            end: parse_field(&self.end, "end")?,
        })
    }
}

impl EpisodeFilter {
    /// Whether the episode matches all conditions.
    pub fn matches(self, episode: &EpisodeIndexEntry) -> bool {
        let violates = |limit| match limit {
            ViolatedLimit::Any => !episode.violations.is_empty(),
            ViolatedLimit::One(name) => episode
                .violations
                .iter()
                .any(|violation| violation.constraint == name),
            ViolatedLimit::Late => episode.late_answers > 0,
        };
        self.task.is_none_or(|task| task == episode.task)
            && self
                .success
                .is_none_or(|success| success == episode.success)
            && self.violated.is_none_or(violates)
            && self.end.is_none_or(|end| end == episode.end)
    }
}
