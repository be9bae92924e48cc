//! Removal of a submission's bundle (the uploaded files) on request of its team or an organiser.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    store::Store,
    tables::{
        bundles, games,
        submissions::{self, Submission, SubmissionState},
        teams::{self, Evidence},
    },
    write::Tx,
};
use faceoff_types::{SubmissionId, TeamId};
use jiff::Timestamp;

/// Refuses to remove evidence: submissions of a team that is disqualified, or that an organiser has retired.
async fn check_no_evidence(tx: &mut Tx, team: TeamId) -> Result<()> {
    let reason = match teams::evidence(tx, team).await? {
        None => return Ok(()),
        Some(Evidence::Disqualified(decision)) => format!(
            "the team was disqualified on {} ({}); its submissions and results are kept as evidence while it is",
            decision.at.strftime("%Y-%m-%d at %H:%M UTC"),
            decision.reason
        ),
        Some(Evidence::Retired(at)) => format!(
            "an organiser withdrew the team from the season on {}; its submissions and results are kept for the \
             organisers",
            at.strftime("%Y-%m-%d at %H:%M UTC")
        ),
    };
    StoreError::conflict(reason)
}

/// Refuses to remove a bundle that is still needed.
async fn check_not_needed(tx: &mut Tx, submission: &Submission) -> Result<()> {
    if let Some(request) = &submission.deletion_request {
        return StoreError::conflict(format!(
            "it was deleted on {} by {}",
            request.requested_at.strftime("%Y-%m-%d at %H:%M UTC"),
            request.actor
        ));
    }
    if let Some(removed) = &submission.bundle_removed {
        return StoreError::conflict(format!(
            "its bundle was removed on {} {}: there is nothing left to delete",
            removed.at.strftime("%Y-%m-%d at %H:%M UTC"),
            removed.reason
        ));
    }
    match submission.state {
        SubmissionState::Valid => {}
        SubmissionState::Validating => {
            return StoreError::conflict(
                "its validation run is queued or running: wait for its result",
            );
        }
        SubmissionState::Invalid { .. } | SubmissionState::PlatformFailed { .. } => {
            return StoreError::conflict(
                "it failed its validation run, so the server removes its bundle automatically: there is nothing to delete",
            );
        }
    }
    check_no_evidence(tx, submission.team).await?;
    let uses = bundles::uses(tx, submission.id).await?;
    if uses.is_active {
        return StoreError::conflict(
            "it is active and will be evaluated at the next cutoff: choose another one, or withdraw it, first",
        );
    }
    if uses.open > 0 {
        return StoreError::conflict(format!(
            "it is being evaluated ({} evaluations or ablations are queued or running): wait for their end",
            uses.open
        ));
    }
    if uses.unreleased > 0 {
        return StoreError::conflict(
            "it was evaluated on a day that is not released, and a rerun may still need it: wait for the release",
        );
    }
    if games::needs_submission(tx, submission.id).await? {
        return StoreError::conflict(
            "it takes part in a tournament that is not closed: until then a game may have to be played again",
        );
    }
    if uses.proposed > 0 {
        // Proposals are visible to organisers only.
        return StoreError::conflict(
            "the organisers still need it for something that is not decided yet: try again later",
        );
    }
    Ok(())
}

impl Store {
    /// Checks whether [`Store::delete_submission`] would succeed at `now`.
    ///
    /// # Errors
    /// [`StoreError::Conflict`] with the reason why it would not.
    #[boxed_future]
    pub async fn check_deletable(&self, id: SubmissionId, now: Timestamp) -> Result<Submission> {
        // The check writes nothing, but needs one consistent view of several tables.
        self.write(Actor::Server, now, async |tx| {
            let submission = submissions::find(tx, id).await?;
            check_not_needed(tx, &submission).await?;
            Ok(submission)
        })
        .await
    }

    /// Removes the bundle of a valid submission for good. It cannot be downloaded from now on; its file is deleted
    /// later, by [`Store::remove_files_of_removed`]. Its results, log and hash stay. The team can read `reason`.
    /// [`StoreError::Conflict`] if the bundle is gone, is still needed, or is evidence.
    #[boxed_future]
    pub async fn delete_submission(
        &self,
        actor: Actor,
        id: SubmissionId,
        reason: &str,
        now: Timestamp,
    ) -> Result<Submission> {
        self.write(actor.clone(), now, async |tx| {
            let submission = submissions::find(tx, id).await?;
            check_not_needed(tx, &submission).await?;
            bundles::set_removed(tx, id, reason, now).await?;
            bundles::set_deleted(tx, id, &actor, now).await?;
            let event = Event::SubmissionDeleted {
                reason: reason.to_owned(),
            };
            tx.record(Subject::Submission(id), event);
            submissions::find(tx, id).await
        })
        .await
    }
}
