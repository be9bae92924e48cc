use faceoff_scoring::tournament::{HeadToHead, Tournament, rating::Ratings};
use serde::Serialize;

/// All that is said of a tournament.
#[derive(Debug, Serialize)]
pub struct ScoredTournament {
    #[serde(flatten)]
    pub tournament: Tournament,
    pub head_to_head: Vec<HeadToHead>,
    /// Missing where there are too many to rate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ratings: Option<Ratings>,
}
