//! A replay on a page: its picture that does not move, and where the script finds what it draws.

use super::table_drawing::{self, Dot, Ground};
use faceoff_replay::{
    Clip,
    model::{PUCK, TOOL},
};
use faceoff_service::views::clip_file::Episode;

/// A replay of an episode, as `replay_section.html` has it.
pub(super) struct ReplaySection {
    /// The element's: a page may hold several.
    pub(super) id: &'static str,
    /// Of what, for whoever does not see it.
    pub(super) name: String,
    /// How pictures and files that are saved are called.
    pub(super) title: String,
    pub(super) why: String,
    pub(super) steps: u32,
    pub(super) still: Still,
    /// Addresses of the clips.
    pub(super) motion: String,
    pub(super) observed: Option<String>,
    /// On somebody else's page?
    pub(super) is_embedded: bool,
    /// Replays of a page that have this name run in step.
    pub(super) together: Option<&'static str>,
}

impl ReplaySection {
    /// Of an episode whose clips are below the address `api`.
    pub(super) fn of(episode: &Episode, api: &str, name: String, title: String) -> Self {
        Self {
            id: "replay",
            name,
            title,
            why: episode.line.why.clone(),
            steps: episode.line.steps,
            still: Still::of(&episode.motion, episode.observed.as_ref()),
            motion: format!("{api}/motion"),
            observed: episode.observed.as_ref().map(|_| format!("{api}/observed")),
            is_embedded: false,
            together: None,
        }
    }
}

/// The episode as a picture that does not move.
pub(super) struct Still {
    pub(super) ground: Ground,
    pub(super) puck_way: String,
    pub(super) mallet_way: String,
    pub(super) opponent_way: String,
    /// Where the agent was told that the puck is.
    pub(super) seen: String,
    pub(super) contacts: String,
    pub(super) start: Dot,
    pub(super) puck: Dot,
    pub(super) mallet: Dot,
    pub(super) puck_radius: f64,
    pub(super) mallet_radius: f64,
}

impl Still {
    fn of(motion: &Clip, observed: Option<&Clip>) -> Self {
        let [puck, mallet] = [motion.puck_places(), motion.mallet_places(0)];
        let contacts = motion.header.contacts.iter();
        let contacts: Vec<[f64; 2]> = contacts.map(|contact| [contact.x, contact.y]).collect();
        let millimetres = |m: f64| (m * 1e4).round() / 10.0;
        let dot = |place: Option<&[f64; 2]>| Dot::at(place.copied().unwrap_or_default());
        Self {
            ground: Ground::new(),
            start: dot(puck.first()),
            puck: dot(puck.last()),
            mallet: dot(mallet.last()),
            puck_way: table_drawing::way(&puck),
            mallet_way: table_drawing::way(&mallet),
            opponent_way: table_drawing::way(&motion.mallet_places(1)),
            seen: observed
                .map_or_else(String::new, |clip| table_drawing::dots(&clip.seen_places())),
            contacts: table_drawing::squares(&contacts),
            puck_radius: millimetres(PUCK.radius_m),
            mallet_radius: millimetres(TOOL.cylinder_radius_m),
        }
    }
}
