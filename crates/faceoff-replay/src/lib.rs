//! What replays are drawn from: clips of episodes and games, a tenth of a dataset in size.
//!
//! A [`Clip`] holds the samples of an episode, or of 500 control steps of a game, as columns of small integers, and tells of
//! contacts between the samples, violations and the end. The public motion, and what was observed, commanded and timed, are
//! clips apart. A [`Pack`] is a file of clips with an index, made while a shard or a game is played; its
//! [`Sheet`] has a line for each episode: where it began and ended, why, and what it broke. `docs/replay.md` describes the bytes.

mod analysis;
mod clip;
mod column;
mod episode;
mod error;
mod game;
mod group;
mod gzip;
mod header;
mod motion;
mod observed;
mod pack;
mod places;
mod recorder;
mod sheet;
#[cfg(test)]
mod viewer_model;
mod violations;

pub use analysis::{Breach, GOAL_WAY_STEPS, GameAnalysis, GoalWay, Shot};
pub use clip::Clip;
pub use column::Column;
pub use error::ReplayError;
pub use game::{CHUNK_STEPS, GameClipRecorder};
pub use group::Group;
pub use header::{
    Break, BreakKind, ClipKind, ColumnHeader, Contact, ContactWith, EndTold, Header, Lost,
    ViolationTold,
};
pub use pack::{Key, Pack, PackWriter, join, select, sheet_of};
pub use recorder::ClipRecorder;
pub use sheet::{Broken, EpisodeLine, Sheet, TimeBins};

/// The numbers of the model that a drawing of a clip needs.
pub mod model {
    pub use faceoff_sim::{
        episode::task::{PLAYABLE_Y_M, TASK_RULES},
        model::{CONTROL_STEP_S, TOOL},
        table::geometry::{PUCK, TABLE},
    };
}
