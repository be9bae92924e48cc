//! A replay on a page: a still picture, and the addresses from which the script loads the *clips*, the recorded motion and observations
//! of an episode.

use super::{
    episode_text::plain_end,
    table_drawing::{self, Dot, Position, TableOutline},
};
use faceoff_replay::{
    Clip,
    model::{PUCK, TOOL},
};
use faceoff_service::views::clip_file::Episode;

/// A replay of an episode in `replay_section.html`.
pub(super) struct ReplaySection {
    /// Id of the HTML element; a page may have several replays.
    pub(super) id: &'static str,
    /// Accessible name.
    pub(super) name: String,
    /// Base name of saved pictures and files.
    pub(super) title: String,
    /// Why the episode ended, as a plain sentence.
    pub(super) outcome: String,
    /// Why the episode ended, with the numbers behind it.
    pub(super) end_reason: String,
    /// Control steps of the episode.
    pub(super) steps: u32,
    pub(super) still: Still,
    /// Address of the clip of the motion.
    pub(super) motion_url: String,
    /// Address of the clip of observations and commands, if the viewer may see it.
    pub(super) observed_url: Option<String>,
    /// Is the replay embedded in another site?
    pub(super) is_embedded: bool,
    /// Replays of a page in the same group are synchronised.
    pub(super) sync_group: Option<&'static str>,
}

impl ReplaySection {
    /// `api`: address of the clips of the episode.
    pub(super) fn new(episode: &Episode, api: &str, name: String, title: String) -> Self {
        Self {
            id: "replay",
            name,
            title,
            outcome: plain_end(&episode.summary, &episode.motion.header.contacts),
            end_reason: episode.summary.end_description.clone(),
            steps: episode.summary.steps,
            still: Still::new(&episode.motion, episode.observations.as_ref()),
            motion_url: format!("{api}/motion"),
            observed_url: episode
                .observations
                .as_ref()
                .map(|_| format!("{api}/observed")),
            is_embedded: false,
            sync_group: None,
        }
    }
}

/// The episode as a still picture.
pub(super) struct Still {
    pub(super) table: TableOutline,
    pub(super) puck_path: String,
    pub(super) mallet_path: String,
    pub(super) opponent_path: String,
    /// Observed positions of the puck.
    pub(super) observed_puck_dots: String,
    pub(super) contact_squares: String,
    pub(super) start: Dot,
    pub(super) puck: Dot,
    pub(super) mallet: Dot,
    pub(super) puck_radius: f64,
    pub(super) mallet_radius: f64,
}

/// Least distance between two points of a path in a small picture, m: about half a pixel.
const SMALL_PICTURE_STEP_M: f64 = 0.008;

impl Still {
    /// The motion in a picture of about a hundred pixels, with fewer points.
    pub(super) fn small(motion: &Clip) -> Self {
        let thin = |positions: &[Position]| {
            table_drawing::path(&table_drawing::thinned(positions, SMALL_PICTURE_STEP_M))
        };
        Self {
            puck_path: thin(&motion.puck_positions()),
            mallet_path: thin(&motion.mallet_positions(0)),
            opponent_path: thin(&motion.mallet_positions(1)),
            ..Self::new(motion, None)
        }
    }

    pub(super) fn new(motion: &Clip, observed: Option<&Clip>) -> Self {
        let [puck, mallet] = [motion.puck_positions(), motion.mallet_positions(0)];
        let contacts = motion.header.contacts.iter();
        let contacts: Vec<[f64; 2]> = contacts.map(|contact| [contact.x, contact.y]).collect();
        // To a tenth of a millimetre.
        let millimetres = |metres: f64| (metres * 1e4).round() / 10.0;
        let dot = |position: Option<&[f64; 2]>| Dot::at(position.copied().unwrap_or_default());
        Self {
            table: TableOutline::new(),
            start: dot(puck.first()),
            puck: dot(puck.last()),
            mallet: dot(mallet.last()),
            puck_path: table_drawing::path(&puck),
            mallet_path: table_drawing::path(&mallet),
            opponent_path: table_drawing::path(&motion.mallet_positions(1)),
            observed_puck_dots: observed.map_or_else(String::new, |clip| {
                table_drawing::dots(&clip.observed_puck_positions())
            }),
            contact_squares: table_drawing::squares(&contacts),
            puck_radius: millimetres(PUCK.radius_m),
            mallet_radius: millimetres(TOOL.cylinder_radius_m),
        }
    }
}
