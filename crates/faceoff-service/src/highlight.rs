//! The highlight of an evaluation: its quickest successful episode in the task with the largest weight, which the board's page plays.
//! Here is its data, which the state of the request handlers caches; `views::highlight` finds it.

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
