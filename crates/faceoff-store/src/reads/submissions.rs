use crate::{
    error::Result,
    store::Store,
    tables::submissions::{self, Submission},
};
use faceoff_types::{SubmissionId, TeamId};

impl Store {
    /// The submission with this id.
    pub async fn submission(&self, id: SubmissionId) -> Result<Submission> {
        submissions::find(&mut *self.database.read.acquire().await?, id).await
    }

    /// A team's submissions, newest first.
    pub async fn submissions_of(&self, team: TeamId) -> Result<Vec<Submission>> {
        submissions::of_team(&mut *self.database.read.acquire().await?, team).await
    }

    /// What each team that may play has active, the earliest upload first.
    pub async fn active_submissions(&self) -> Result<Vec<Submission>> {
        submissions::active(&mut *self.database.read.acquire().await?).await
    }

    /// The tail of the agent's standard error in its smoke run; `None` until that is over, and where
    /// our fault ended it.
    pub async fn submission_log(&self, id: SubmissionId) -> Result<Option<String>> {
        submissions::log(&mut *self.database.read.acquire().await?, id).await
    }
}
