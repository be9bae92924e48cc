//! Queries of submissions: the agents that teams have uploaded.

use crate::{
    boxed_future,
    error::Result,
    store::Store,
    tables::submissions::{self, Submission},
};
use faceoff_types::{SubmissionId, TeamId};
use jiff::Timestamp;

impl Store {
    /// The submission with this id.
    #[boxed_future]
    pub async fn submission(&self, id: SubmissionId) -> Result<Submission> {
        submissions::find(&mut *self.database.read.acquire().await?, id).await
    }

    /// A team's submissions, the newest first.
    #[boxed_future]
    pub async fn submissions_of(&self, team: TeamId) -> Result<Vec<Submission>> {
        submissions::of_team(&mut *self.database.read.acquire().await?, team).await
    }

    /// One page of a team's submissions, the newest first: the first ones, or those that follow the submission `after`.
    /// `None` if there is no submission `after`.
    #[boxed_future]
    pub async fn submissions_after(
        &self,
        team: TeamId,
        after: Option<SubmissionId>,
        limit: u32,
    ) -> Result<Option<Vec<Submission>>> {
        let mut tx = self.database.read.begin().await?;
        let start = match after {
            None => (Timestamp::MAX, None),
            Some(id) => match submissions::created_at(&mut tx, id).await? {
                Some(at) => (at, Some(id)),
                None => return Ok(None),
            },
        };
        submissions::of_team_after(&mut tx, team, start, limit)
            .await
            .map(Some)
    }

    /// The active submission of each team that may compete, the earliest upload first.
    #[boxed_future]
    pub async fn active_submissions(&self) -> Result<Vec<Submission>> {
        submissions::active(&mut *self.database.read.acquire().await?).await
    }

    /// The tail of the agent's standard error in its validation run; `None` until the run is over, and if
    /// a platform fault ended it.
    #[boxed_future]
    pub async fn submission_log(&self, id: SubmissionId) -> Result<Option<String>> {
        submissions::log(&mut *self.database.read.acquire().await?, id).await
    }
}
