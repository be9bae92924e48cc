//! Data for replays: clips of episodes and games, with a tenth of the size of a dataset.
//!
//! A [`Clip`] holds the samples of an episode, or of 500 control steps of a game, as columns of small integers. It also has
//! contacts between samples, violations and the end. The public motion is one clip; observations, commands and times are
//! another. A [`Pack`] is a file of clips with an index, written while a shard or a game is played. Its [`ClipIndex`] has a
//! summary of each episode: how it started and ended, and its violations. `docs/replay.md` describes the format.

mod agent_view;
mod analysis;
mod clip;
mod clip_index;
mod column;
mod constraint;
mod end_reasons;
mod episode;
mod error;
mod game;
mod gzip;
mod header;
pub mod model;
mod motion;
mod pack;
mod positions;
mod recorder;
mod summary_recording;
#[cfg(test)]
mod viewer_model;
mod violations;

pub use analysis::*;
pub use clip::Clip;
pub use clip_index::{ClipIndex, EpisodeIndexEntry, TimeBins, ViolationSummary};
pub use column::Column;
pub use constraint::Constraint;
pub use end_reasons::*;
pub use error::ReplayError;
pub use game::{CHUNK_STEPS, GameClipRecorder};
pub use header::{
    ClipKind, ColumnHeader, Contact, ContactWith, EpisodeEndSummary, Header, RallyEndEvent,
    RallyEndKind, TrackingGap, ViolationSpan,
};
pub use pack::{ClipKey, Pack, PackWriter, join_packs, merged_index, select_episodes};
pub use recorder::ClipRecorder;
