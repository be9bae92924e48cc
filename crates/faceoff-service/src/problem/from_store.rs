//! Problems for the errors of the store, which is the database with its files.

use super::{details::Problem, kind::ProblemKind};
use faceoff_store::StoreError;
use jiff::Timestamp;

impl From<StoreError> for Problem {
    fn from(error: StoreError) -> Self {
        match error {
            StoreError::NotFound(resource_kind) => Self::new(
                ProblemKind::NotFound,
                format!("there is no such {resource_kind}; check the id"),
            ),
            StoreError::TeamNameTaken(name) => Self::new(
                ProblemKind::TeamNameTaken,
                format!(
                    "a team named {name:?} exists already, and names that look alike count as the same; choose another name, or create a new token \
                     for the team with POST /api/v1/teams/ID/token"
                ),
            ),
            StoreError::StageNameTaken(name) => Self::new(
                ProblemKind::StageNameTaken,
                format!("a stage named {name:?} exists already; choose another name"),
            ),
            StoreError::TournamentNameTaken(name) => Self::new(
                ProblemKind::TournamentNameTaken,
                format!("a tournament named {name:?} exists already; choose another name"),
            ),
            StoreError::GameQuotaExceeded { limit, used } => Self::new(
                ProblemKind::DailyGameQuotaExceeded,
                format!(
                    "a team can request at most {limit} test and friendly games per UTC day; yours has requested {used} \
                     today. Try again after midnight UTC"
                ),
            )
            .with("limit", limit)
            .with("used", used),
            StoreError::StageNotOpen {
                name,
                opens_at,
                closed_at,
            } => {
                let format_time = |at: Timestamp| at.strftime("%Y-%m-%d %H:%M:%S UTC").to_string();
                let period = match closed_at {
                    Some(at) => format!("closed at {}; no further day of it starts", format_time(at)),
                    None => format!("opens at {}; no day of it starts before", format_time(opens_at)),
                };
                Self::new(ProblemKind::StageNotOpen, format!("the stage {name:?} {period}"))
                    .with("opens_at", opens_at.to_string())
                    .with("closed_at", closed_at.map(|at| at.to_string()))
            }
            StoreError::Disqualified { at, reason } => Self::new(
                ProblemKind::Disqualified,
                format!(
                    "the team was disqualified on {}: {reason}. It can neither upload nor be evaluated; an organiser can \
                     reinstate it",
                    at.strftime("%Y-%m-%d at %H:%M UTC")
                ),
            ),
            StoreError::TeamRetired { at } => Self::new(
                ProblemKind::Retired,
                format!(
                    "the team retired on {} and can neither upload nor be evaluated; POST /api/v1/teams/ID/return undoes \
                     this",
                    at.strftime("%Y-%m-%d at %H:%M UTC")
                ),
            ),
            StoreError::TermsNotAccepted { version } => Self::new(
                ProblemKind::TermsNotAccepted,
                format!(
                    "no member of the team has accepted version {version} of the terms (GET /api/v1/terms); a member accepts \
                     it with POST /api/v1/terms/{version}/accept"
                ),
            )
            .with("version", version),
            error @ StoreError::OutcomesRemoved { .. } => Self::new(ProblemKind::Gone, error.to_string()),
            StoreError::UserNameTaken(name) => Self::new(
                ProblemKind::UserNameTaken,
                format!("a user named {name:?} exists already, and names that look alike count as the same; choose another name"),
            ),
            error @ StoreError::TokenInvalid => {
                Self::new(ProblemKind::Unauthenticated, error.to_string())
            }
            error @ StoreError::InvitationInvalid(_) => {
                Self::new(ProblemKind::InvitationInvalid, error.to_string())
            }
            StoreError::IdempotencyKeyUsed { submission } => Self::new(
                ProblemKind::InvalidContent,
                format!(
                    "the header Idempotency-Key has the key of the submission {submission}, whose bundle is another one; use a new \
                     key for each bundle"
                ),
            )
            .with("field", "Idempotency-Key"),
            error @ StoreError::CutoffPassed { .. } => {
                Self::new(ProblemKind::CutoffPassed, error.to_string())
            }
            StoreError::SeasonClosed { closed_at } => Self::new(
                ProblemKind::SeasonClosed,
                format!(
                    "the season was closed on {} and its secret is public, so nothing can be uploaded or evaluated any \
                     more; results and datasets stay",
                    closed_at.strftime("%Y-%m-%d at %H:%M UTC")
                ),
            )
            .with("closed_at", closed_at.to_string()),
            error @ StoreError::DiskFull(_) => {
                tracing::warn!(%error, "the disk is full");
                Self::new(
                    ProblemKind::StorageFull,
                    "the server's disk is full, so this could not be stored; your request is fine. Check whether it took \
                     effect, and try again later",
                )
            }
            StoreError::DailyQuotaExceeded {
                limit_bytes,
                used_bytes,
                bundle_bytes,
            } => Self::new(
                ProblemKind::DailyUploadQuotaExceeded,
                format!(
                    "a team can upload at most {limit_bytes} bytes per UTC day; yours has uploaded {used_bytes} today, and \
                     this bundle has {bundle_bytes} or more. Upload it after midnight UTC, or leave out what the agent does \
                     not need to run"
                ),
            )
            .with("limit_bytes", limit_bytes)
            .with("used_bytes", used_bytes),
            StoreError::StorageQuotaExceeded {
                limit_bytes,
                used_bytes,
                bundle_bytes,
            } => Self::new(
                ProblemKind::StorageQuotaExceeded,
                format!(
                    "a team can store at most {limit_bytes} bytes of bundles; yours has stored {used_bytes}, and this bundle \
                     has {bundle_bytes} or more. Delete old submissions, or ask an organiser for a higher quota \
                     (uploads.stored_bytes in the server's configuration)"
                ),
            )
            .with("limit_bytes", limit_bytes)
            .with("used_bytes", used_bytes),
            StoreError::Archived {
                made_at,
                imported_at,
            } => Self::archived(made_at, imported_at),
            StoreError::Conflict(detail) => Self::new(ProblemKind::Conflict, detail),
            error @ (StoreError::Database(_)
            | StoreError::Artifacts(_)
            | StoreError::Damaged(_)
            | StoreError::NewerDatabase { .. }) => Self::internal(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn internal_cause_is_not_disclosed() {
        let problem = Problem::from(StoreError::Artifacts("disk /dev/secret is full".into()));
        assert_eq!(problem.kind(), ProblemKind::Internal);
        assert!(!problem.detail().contains("secret"));
    }
}
