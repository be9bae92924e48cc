//! Two synchronised replays beside each other, of two teams or with two sets of perturbations. A *clip* is a file from
//! which the browser draws an episode.

use super::{episode_text::describe_violation, replay_section::ReplaySection};
use faceoff_service::views::clip_file::Episode;
use faceoff_types::Competition;

/// One of the two replays in `side_by_side.html`.
pub(super) struct Side {
    /// The team or the profile.
    pub(super) name: String,
    /// Path of the page of this replay alone, if it has one.
    pub(super) path: Option<String>,
    pub(super) success: bool,
    pub(super) duration_s: String,
    pub(super) violations: Vec<String>,
    pub(super) replay: ReplaySection,
}

/// The nearest of these episodes before and after this one.
pub(super) fn neighbours(
    episodes: impl Iterator<Item = u32> + Clone,
    episode: u32,
) -> [Option<u32>; 2] {
    [
        episodes.clone().filter(|other| *other < episode).max(),
        episodes.filter(|other| *other > episode).min(),
    ]
}

impl Side {
    /// `api`: address of the clips. `element_id`: id of the HTML element.
    pub(super) fn new(
        competition: &Competition,
        element_id: &'static str,
        episode: &Episode,
        api: &str,
        name: String,
    ) -> Self {
        let outcome = &episode.summary;
        let label = format!("{}, episode {}, {name}", outcome.task, outcome.episode);
        let title = format!("{name}, {} {}", outcome.task, outcome.episode);
        Self {
            name,
            path: None,
            success: outcome.success,
            duration_s: format!("{:.2}", competition.duration_s(outcome.task, outcome.steps)),
            violations: outcome
                .violations
                .iter()
                .map(|violation| describe_violation(competition, violation))
                .collect(),
            replay: ReplaySection {
                id: element_id,
                sync_group: Some("both"),
                ..ReplaySection::new(episode, api, label, title)
            },
        }
    }
}
