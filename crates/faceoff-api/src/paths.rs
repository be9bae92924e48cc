//! Paths of API resources, for links in responses, and of the liveness probe.

use faceoff_types::{EvaluationId, GameId, SubmissionId, TournamentId};

/// Prefix of all API paths.
pub const API_BASE: &str = "/api/v1";

/// The path of a submission.
pub fn submission(id: SubmissionId) -> String {
    format!("{API_BASE}/submissions/{id}")
}

/// The path of an evaluation.
pub fn evaluation(id: EvaluationId) -> String {
    format!("{API_BASE}/evaluations/{id}")
}

/// The path of a tournament.
pub fn tournament(id: TournamentId) -> String {
    format!("{API_BASE}/tournaments/{id}")
}

/// The path of a game.
pub fn game(id: GameId) -> String {
    format!("{API_BASE}/games/{id}")
}

/// Path of the liveness probe.
pub const LIVE_PATH: &str = "/livez";

/// Path of the readiness probe.
pub const READY_PATH: &str = "/readyz";
