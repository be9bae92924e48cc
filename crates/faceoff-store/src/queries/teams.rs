//! Queries of teams.

use crate::{
    boxed_future,
    error::Result,
    store::Store,
    tables::teams::{self, Team},
};
use faceoff_types::TeamId;

impl Store {
    /// The team with this id.
    #[boxed_future]
    pub async fn team(&self, id: TeamId) -> Result<Team> {
        teams::find(&mut *self.database.read.acquire().await?, id).await
    }

    /// All teams, by name.
    #[boxed_future]
    pub async fn teams(&self) -> Result<Vec<Team>> {
        teams::all(&mut *self.database.read.acquire().await?).await
    }
}
