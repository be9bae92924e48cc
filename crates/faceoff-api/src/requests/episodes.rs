//! About an evaluation's episodes.

use faceoff_replay::{EpisodeLine, Group};
use faceoff_types::{EpisodeEnd, Task};
use serde::{Deserialize, Serialize};

/// Which episodes of an evaluation a page shows. What a form leaves empty does not choose.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EpisodesQuery {
    /// `hit`, `defend` or `prepare`.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub task: String,
    /// `success` or `failure`.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub went: String,
    /// `any`, `ee`, `link`, `joint_pos`, `joint_vel` or `late`.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub broke: String,
    /// How it ended.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub end: String,
    /// The page, from 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub page: Option<u32>,
}

/// What was asked for, understood.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Chosen {
    /// Episodes of this task alone.
    pub task: Option<Task>,
    /// Solved ones, or those that were not.
    pub success: Option<bool>,
    /// Those with this violation.
    pub broke: Option<Broke>,
    /// Those that ended like this.
    pub end: Option<EpisodeEnd>,
}

/// What went wrong in an episode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Broke {
    /// Any constraint.
    Any,
    /// One of them.
    One(Group),
    /// An answer took more than a control step.
    Late,
}

impl EpisodesQuery {
    /// What it chooses.
    ///
    /// # Errors
    /// The field that nobody understands.
    pub fn chosen(&self) -> Result<Chosen, &'static str> {
        fn given<'a, T: Deserialize<'a>>(
            text: &'a str,
            field: &'static str,
        ) -> Result<Option<T>, &'static str> {
            if text.is_empty() {
                return Ok(None);
            }
            let word: serde::de::value::StrDeserializer<'a, serde::de::value::Error> =
                serde::de::IntoDeserializer::into_deserializer(text);
            T::deserialize(word).map(Some).map_err(|_| field)
        }
        Ok(Chosen {
            task: given(&self.task, "task")?,
            success: match self.went.as_str() {
                "" => None,
                "success" => Some(true),
                "failure" => Some(false),
                _ => return Err("went"),
            },
            broke: match self.broke.as_str() {
                "" => None,
                "any" => Some(Broke::Any),
                "late" => Some(Broke::Late),
                one => given(one, "broke")?.map(Broke::One),
            },
            end: given(&self.end, "end")?,
        })
    }
}

impl Chosen {
    /// Is it one of these?
    pub fn takes(self, line: &EpisodeLine) -> bool {
        let broke = |broke| match broke {
            Broke::Any => !line.broken.is_empty(),
            Broke::One(group) => line.broken.iter().any(|broken| broken.group == group),
            Broke::Late => line.late > 0,
        };
        self.task.is_none_or(|task| task == line.task)
            && self.success.is_none_or(|success| success == line.success)
            && self.broke.is_none_or(broke)
            && self.end.is_none_or(|end| end == line.end)
    }
}
