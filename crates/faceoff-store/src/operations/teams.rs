use crate::{
    error::Result,
    event::{Actor, Event, Subject},
    store::Store,
    tables::teams::{self, Team},
};
use faceoff_types::{TeamId, TeamName};
use jiff::Timestamp;

impl Store {
    /// Creates a team. `token_hash` is the hash of its bearer token; the token itself is never
    /// stored. [`StoreError::TeamNameTaken`](crate::StoreError::TeamNameTaken) if the name exists, whatever its case.
    pub async fn create_team(
        &self,
        actor: Actor,
        name: &TeamName,
        token_hash: [u8; 32],
        now: Timestamp,
    ) -> Result<Team> {
        self.write(actor, now, async |tx| {
            let id = TeamId::new();
            let (name, created_at) = (name.clone(), now);
            let team = Team {
                id,
                name: name.clone(),
                created_at,
                disqualified: None,
            };
            teams::insert(tx, &team, token_hash).await?;
            tx.record(Subject::Team(id), Event::TeamCreated { name });
            // as it is stored, its instant to the millisecond
            teams::find(tx, id).await
        })
        .await
    }

    /// Replaces a lost token; the old one is void from now on.
    pub async fn set_team_token(
        &self,
        actor: Actor,
        id: TeamId,
        token_hash: [u8; 32],
        now: Timestamp,
    ) -> Result<()> {
        self.write(actor, now, async |tx| {
            teams::set_token(tx, id, token_hash).await?;
            tx.record(Subject::Team(id), Event::TokenReplaced);
            Ok(())
        })
        .await
    }
}
