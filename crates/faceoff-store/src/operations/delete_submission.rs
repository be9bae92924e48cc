//! A team, or an organiser, has the archive of a submission removed.

use crate::{
    boxed,
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

fn conflict<T>(why: impl Into<String>) -> Result<T> {
    Err(StoreError::Conflict(why.into()))
}

/// Refuses to remove what is evidence against a team, or of one that an organiser has taken out of the season.
async fn check_no_evidence(tx: &mut Tx, team: TeamId) -> Result<()> {
    let why = match teams::evidence(tx, team).await? {
        None => return Ok(()),
        Some(Evidence::Disqualified(ruling)) => format!(
            "the team was disqualified on {} ({}); what it has uploaded and played is kept as evidence as long as it is",
            ruling.at.strftime("%Y-%m-%d at %H:%M UTC"),
            ruling.reason
        ),
        Some(Evidence::Retired(at)) => format!(
            "an organiser has taken the team out of the season on {}; what it has uploaded and played is kept for the \
             organisers",
            at.strftime("%Y-%m-%d at %H:%M UTC")
        ),
    };
    conflict(why)
}

/// Refuses to remove an archive that somebody needs.
async fn check_idle(tx: &mut Tx, submission: &Submission) -> Result<()> {
    if let Some(deleted) = &submission.deleted {
        return conflict(format!(
            "it was deleted on {} by {}",
            deleted.at.strftime("%Y-%m-%d at %H:%M UTC"),
            deleted.by
        ));
    }
    if let Some(removed) = &submission.archive_removed {
        return conflict(format!(
            "its archive was removed on {} {}: there is nothing left to delete",
            removed.at.strftime("%Y-%m-%d at %H:%M UTC"),
            removed.reason
        ));
    }
    match submission.state {
        SubmissionState::Valid => {}
        SubmissionState::Validating => {
            return conflict("its smoke run is queued or running: wait for its verdict");
        }
        SubmissionState::Invalid { .. } | SubmissionState::ValidationError { .. } => {
            return conflict(
                "its smoke run refused it, so the server removes its archive by itself: there is nothing to delete",
            );
        }
    }
    check_no_evidence(tx, submission.team).await?;
    let needs = bundles::needs(tx, submission.id).await?;
    if needs.is_active {
        return conflict(
            "it is active, and enters the next cut: choose another one, or withdraw it, first",
        );
    }
    if needs.open > 0 {
        return conflict(format!(
            "it is queued or playing ({} evaluations or ablations are not over): wait for their end",
            needs.open
        ));
    }
    if needs.unreleased > 0 {
        return conflict(
            "it has played a day that is not released, and may have to play it again: wait for the release",
        );
    }
    if games::needs(tx, submission.id).await? {
        return conflict(
            "it plays in a tournament that is not closed: its games may have to be played again until then",
        );
    }
    if needs.proposed > 0 {
        // Nobody but the organisers learns of what.
        return conflict(
            "the organisers still need it for something that is not decided yet: try again later",
        );
    }
    Ok(())
}

impl Store {
    /// Would [`Store::delete_submission`] be done at `now`?
    ///
    /// # Errors
    /// [`StoreError::Conflict`] says what it waits for.
    #[boxed]
    pub async fn check_deletable(&self, id: SubmissionId, now: Timestamp) -> Result<Submission> {
        // It writes nothing, but what it finds belongs together.
        self.write(Actor::Server, now, async |tx| {
            let submission = submissions::find(tx, id).await?;
            check_idle(tx, &submission).await?;
            Ok(submission)
        })
        .await
    }

    /// Has the archive of a valid submission removed, for good: nobody is promised it from now on, and its file goes
    /// later, by [`Store::remove_files_of_removed`]. What it has played, its log and its hash stay. `reason` is in
    /// words for its team. [`StoreError::Conflict`] if the archive is gone, is needed, or is evidence.
    #[boxed]
    pub async fn delete_submission(
        &self,
        actor: Actor,
        id: SubmissionId,
        reason: &str,
        now: Timestamp,
    ) -> Result<Submission> {
        self.write(actor.clone(), now, async |tx| {
            let submission = submissions::find(tx, id).await?;
            check_idle(tx, &submission).await?;
            bundles::remove(tx, id, reason, now).await?;
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
