//! Where the API's resources are, for answers that lead to them.

use faceoff_types::{EvaluationId, GameId, SubmissionId, TournamentId};

/// Where the API lives.
pub const API_BASE: &str = "/api/v1";

pub(crate) fn submission(id: SubmissionId) -> String {
    format!("{API_BASE}/submissions/{id}")
}

pub(crate) fn evaluation(id: EvaluationId) -> String {
    format!("{API_BASE}/evaluations/{id}")
}

pub(crate) fn tournament(id: TournamentId) -> String {
    format!("{API_BASE}/tournaments/{id}")
}

pub(crate) fn game(id: GameId) -> String {
    format!("{API_BASE}/games/{id}")
}

/// Where the process says that it lives.
pub(crate) const LIVE_PATH: &str = "/livez";
