//! Where on the table limits were broken, each group with a mark of its own.

use super::{
    episode_words::group_word,
    table_drawing::{self, Place},
};
use faceoff_replay::Group;

/// The places of a group.
pub(super) struct Places {
    pub(super) word: &'static str,
    pub(super) class: &'static str,
    pub(super) marks: String,
    /// One of them, for the key.
    pub(super) sign: String,
    pub(super) count: usize,
}

impl Places {
    /// Of each group that was broken anywhere.
    pub(super) fn by_group(places: impl Fn(Group) -> Vec<Place>) -> Vec<Self> {
        let groups = Group::ALL.into_iter().filter_map(|group| {
            let at = places(group);
            let (class, draw): (_, fn(&[Place]) -> String) = match group {
                Group::Ee => ("ee", table_drawing::crosses),
                Group::Link => ("link", table_drawing::squares),
                Group::JointPos => ("joint-pos", table_drawing::dots),
                Group::JointVel => ("joint-vel", table_drawing::triangles),
            };
            (!at.is_empty()).then(|| Self {
                word: group_word(group),
                class,
                marks: draw(&at),
                sign: draw(&[[0.0; 2]]),
                count: at.len(),
            })
        });
        groups.collect()
    }
}
