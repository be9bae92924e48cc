use crate::{
    error::Result,
    store::Store,
    tables::teams::{self, Team},
};
use faceoff_types::TeamId;

impl Store {
    /// The team with this id.
    pub async fn team(&self, id: TeamId) -> Result<Team> {
        teams::find(&mut *self.database.read.acquire().await?, id).await
    }

    /// The team whose token has this hash.
    pub async fn team_by_token_hash(&self, token_hash: [u8; 32]) -> Result<Option<Team>> {
        teams::by_token_hash(&mut *self.database.read.acquire().await?, token_hash).await
    }

    /// All teams, by name.
    pub async fn teams(&self) -> Result<Vec<Team>> {
        teams::all(&mut *self.database.read.acquire().await?).await
    }
}
