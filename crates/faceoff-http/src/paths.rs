//! Where the API's resources are, for answers that lead to them.

use faceoff_types::{EvaluationId, SubmissionId};

/// Where the API lives.
pub const API_BASE: &str = "/api/v1";

pub(crate) fn submission(id: SubmissionId) -> String {
    format!("{API_BASE}/submissions/{id}")
}

pub(crate) fn evaluation(id: EvaluationId) -> String {
    format!("{API_BASE}/evaluations/{id}")
}
