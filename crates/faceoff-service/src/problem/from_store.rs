use super::{details::Problem, kind::ProblemKind};
use faceoff_store::StoreError;
use jiff::Timestamp;

impl From<StoreError> for Problem {
    fn from(error: StoreError) -> Self {
        match error {
            StoreError::NotFound(what) => Self::new(
                ProblemKind::NotFound,
                format!("there is no such {what}; check the id"),
            ),
            StoreError::TeamNameTaken(name) => Self::new(
                ProblemKind::TeamNameTaken,
                format!(
                    "a team named {name:?} exists already; choose another name, or make a new token \
                     for it with POST /api/v1/teams/ID/token"
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
            StoreError::FreeGamesSpent { limit, used } => Self::new(
                ProblemKind::FreeGamesSpent,
                format!(
                    "a team asks for at most {limit} games that do not count on a UTC day; yours has asked for {used} \
                     today. Ask again after midnight UTC"
                ),
            )
            .with("limit", limit)
            .with("used", used),
            StoreError::StageNotOpen {
                name,
                opens_at,
                closed_at,
            } => {
                let shown = |at: Timestamp| at.strftime("%Y-%m-%d %H:%M:%S UTC").to_string();
                let when = match closed_at {
                    Some(at) => format!("closed at {}; no day of it starts any more", shown(at)),
                    None => format!("opens at {}; no day of it starts before", shown(opens_at)),
                };
                Self::new(ProblemKind::StageNotOpen, format!("the stage {name:?} {when}"))
                    .with("opens_at", opens_at.to_string())
                    .with("closed_at", closed_at.map(|at| at.to_string()))
            }
            StoreError::Disqualified { at, reason } => Self::new(
                ProblemKind::Disqualified,
                format!(
                    "the team was disqualified on {}: {reason}. It neither uploads nor plays; the organiser can \
                     reinstate it",
                    at.strftime("%Y-%m-%d at %H:%M UTC")
                ),
            ),
            StoreError::Retired { at } => Self::new(
                ProblemKind::Retired,
                format!(
                    "the team retired on {} and neither uploads nor plays; POST /api/v1/teams/ID/return lets it play \
                     again",
                    at.strftime("%Y-%m-%d at %H:%M UTC")
                ),
            ),
            StoreError::TermsOwed { version } => Self::new(
                ProblemKind::TermsOwed,
                format!(
                    "nobody of the team has accepted version {version} of the terms (GET /api/v1/terms); a member does \
                     so with POST /api/v1/terms/{version}/accept"
                ),
            )
            .with("version", version),
            error @ StoreError::Cleared { .. } => Self::new(ProblemKind::Gone, error.to_string()),
            StoreError::PersonNameTaken(name) => Self::new(
                ProblemKind::PersonNameTaken,
                format!("a person named {name:?} exists already; choose another name"),
            ),
            error @ StoreError::InvitationSpent(_) => {
                Self::new(ProblemKind::InvitationSpent, error.to_string())
            }
            error @ StoreError::DayHasCut { .. } => {
                Self::new(ProblemKind::DayHasCut, error.to_string())
            }
            StoreError::SeasonClosed { closed_at } => Self::new(
                ProblemKind::SeasonClosed,
                format!(
                    "the season was closed on {} and its secret is public, so nothing more is uploaded \
                     or evaluated; results and datasets stay",
                    closed_at.strftime("%Y-%m-%d at %H:%M UTC")
                ),
            )
            .with("closed_at", closed_at.to_string()),
            error @ StoreError::FullDisk(_) => {
                tracing::warn!(%error, "the disk is full");
                Self::new(
                    ProblemKind::StorageFull,
                    "the server's disk is full, so that this could not be stored; nothing is wrong with what \
                     you sent. Look whether it was done after all, and try again later",
                )
            }
            StoreError::DayQuotaSpent {
                limit_bytes,
                used_bytes,
                bundle_bytes,
            } => Self::new(
                ProblemKind::DayQuotaSpent,
                format!(
                    "a team uploads at most {limit_bytes} bytes on a UTC day; yours has uploaded \
                     {used_bytes} today, and this bundle has {bundle_bytes} or more. Send it after \
                     midnight UTC, or leave out what the agent does not need to run"
                ),
            )
            .with("limit_bytes", limit_bytes)
            .with("used_bytes", used_bytes),
            StoreError::StoredQuotaSpent {
                limit_bytes,
                used_bytes,
                bundle_bytes,
            } => Self::new(
                ProblemKind::StoredQuotaSpent,
                format!(
                    "at most {limit_bytes} bytes of bundles are kept for a team; {used_bytes} are kept of \
                     yours, and this one has {bundle_bytes} or more. Ask the organiser for more room \
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
    fn a_cause_that_is_ours_stays_inside() {
        let problem = Problem::from(StoreError::Artifacts("disk /dev/secret is full".into()));
        assert_eq!(problem.kind(), ProblemKind::Internal);
        assert!(!problem.detail().contains("secret"));
    }
}
