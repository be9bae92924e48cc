//! The result of a tournament that `faceoff score` computes.

use faceoff_scoring::tournament::{HeadToHead, Tournament, rating::Ratings};
use serde::Serialize;

/// The output of `faceoff score tournament`.
#[derive(Debug, Serialize)]
pub struct ScoredTournament {
    #[serde(flatten)]
    pub tournament: Tournament,
    pub head_to_head: Vec<HeadToHead>,
    /// Absent if there are too many teams to rate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ratings: Option<Ratings>,
}
