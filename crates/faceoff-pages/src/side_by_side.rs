//! Two replays that run in step.

use super::{episode_words::in_words, replay_section::ReplaySection};
use faceoff_replay::model::CONTROL_STEP_S;
use faceoff_service::views::clip_file::Episode;

/// One of the two, as `side_by_side.html` has it.
pub(super) struct Side {
    /// What differs between them.
    pub(super) name: String,
    /// Where it is shown alone.
    pub(super) path: Option<String>,
    pub(super) success: bool,
    pub(super) duration_s: String,
    pub(super) broken: Vec<String>,
    pub(super) replay: ReplaySection,
}

impl Side {
    /// Of an episode whose clips are below the address `api`; `id` is its element's.
    pub(super) fn of(id: &'static str, episode: &Episode, api: &str, name: String) -> Self {
        let line = &episode.line;
        let of = format!("{}, episode {}, {name}", line.task, line.episode);
        let title = format!("{name}, {} {}", line.task, line.episode);
        Self {
            name,
            path: None,
            success: line.success,
            duration_s: format!("{:.2}", f64::from(line.steps) * CONTROL_STEP_S),
            broken: line.broken.iter().map(in_words).collect(),
            replay: ReplaySection {
                id,
                together: Some("both"),
                ..ReplaySection::of(episode, api, of, title)
            },
        }
    }
}
