//! The highlight of an evaluation, as the cache in the state of all request handlers holds it.

use faceoff_replay::Clip;
use faceoff_types::Task;

/// An episode that ended in success, with its motion.
#[derive(Debug)]
pub struct Highlight {
    pub task: Task,
    pub episode: u32,
    /// Control steps of the episode.
    pub steps: u32,
    pub motion: Clip,
}
