//! Teams: their creation, tokens, changes and retirement.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{
        invitations::add_team,
        requester::Requester,
        tokens::{NewToken, add_token, revoke_all},
    },
    store::Store,
    tables::{
        divisions, season,
        teams::{self, Team, TeamProfile},
        tokens::{TokenKind, TokenOwner},
        users,
    },
    write::Tx,
};
use faceoff_types::{TeamId, TeamName};
use jiff::Timestamp;

/// Name of the token that is created with a team.
const FIRST_TOKEN_NAME: &str = "first";

async fn add_team_token(
    tx: &mut Tx,
    team: TeamId,
    hash: [u8; 32],
    requester: Requester,
) -> Result<()> {
    let token = NewToken {
        hash,
        kind: TokenKind::ApiToken,
        owner: TokenOwner::Team(team),
        name: FIRST_TOKEN_NAME.to_owned(),
        requester,
        expires_at: None,
    };
    add_token(tx, token).await?;
    Ok(())
}

/// Changes of a team; `None` leaves a value unchanged.
#[derive(Debug, Clone, Default)]
pub struct TeamChange {
    pub name: Option<TeamName>,
    /// Replaces the whole profile.
    pub profile: Option<TeamProfile>,
    /// Is the team a baseline: a reference agent of the organisers, which is not ranked?
    pub baseline: Option<bool>,
}

impl Store {
    /// Creates a team. `token_hash` is the hash of its bearer token; the token itself is never
    /// stored. [`StoreError::TeamNameTaken`](crate::StoreError::TeamNameTaken) if the name exists, ignoring case.
    #[boxed_future]
    pub async fn create_team(
        &self,
        actor: Actor,
        name: &TeamName,
        token_hash: [u8; 32],
        requester: Requester,
        now: Timestamp,
    ) -> Result<Team> {
        self.write(actor, now, async |tx| {
            let id = add_team(tx, name.clone(), TeamProfile::default()).await?;
            add_team_token(tx, id, token_hash, requester).await?;
            teams::find(tx, id).await
        })
        .await
    }

    /// Replaces the tokens of a team by a new one: the old ones are revoked. Its members' tokens stay valid.
    #[boxed_future]
    pub async fn set_team_token(
        &self,
        actor: Actor,
        id: TeamId,
        token_hash: [u8; 32],
        requester: Requester,
        now: Timestamp,
    ) -> Result<()> {
        self.write(actor, now, async |tx| {
            teams::find(tx, id).await?;
            revoke_all(tx, TokenOwner::Team(id), None).await?;
            add_team_token(tx, id, token_hash, requester).await?;
            tx.record(Subject::Team(id), Event::TokenReplaced);
            Ok(())
        })
        .await
    }

    /// Changes a team's name, profile or baseline status. [`StoreError::TeamNameTaken`] if another team has the name,
    /// [`StoreError::Conflict`] if there is no such division, or the ranks of a signed-off board would change,
    /// [`StoreError::SeasonClosed`] once the season is over.
    #[boxed_future]
    pub async fn change_team(
        &self,
        actor: Actor,
        id: TeamId,
        change: TeamChange,
        now: Timestamp,
    ) -> Result<Team> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let team = teams::find(tx, id).await?;
            if let Some(name) = change.name.filter(|name| *name != team.name) {
                teams::set_name(tx, id, &name).await?;
                let event = Event::TeamRenamed {
                    from: team.name,
                    to: name,
                };
                tx.record(Subject::Team(id), event);
            }
            if let Some(mut profile) = change.profile {
                if let Some(division) = &profile.division {
                    profile.division = Some(divisions::check(tx, division).await?);
                }
                if profile != team.profile {
                    teams::set_profile(tx, id, &profile).await?;
                    let event = Event::TeamDescribed {
                        affiliation: profile.affiliation,
                        link: profile.link,
                        division: profile.division,
                    };
                    tx.record(Subject::Team(id), event);
                }
            }
            if let Some(baseline) = change.baseline.filter(|new| *new != team.is_baseline) {
                if let Some(stage) = teams::signed_off_stage(tx, id).await? {
                    return StoreError::conflict(format!(
                        "the stage {stage:?} is signed off with results of the team, and its ranks would change: whether \
                         the team is a baseline cannot be changed any more. Nothing was changed"
                    ));
                }
                teams::set_baseline(tx, id, baseline).await?;
                let event = if baseline {
                    Event::TeamMadeBaseline
                } else {
                    Event::TeamMadeRanked
                };
                tx.record(Subject::Team(id), event);
            }
            teams::find(tx, id).await
        })
        .await
    }

    /// Retires a team, on its own or an organiser's request: it cannot upload and is not evaluated on later days.
    /// Evaluations that were queued continue, and its results stay. If an organiser retires it, its files are kept, too.
    /// [`StoreError::Conflict`] if it has retired already.
    #[boxed_future]
    pub async fn retire_team(&self, actor: Actor, id: TeamId, now: Timestamp) -> Result<Team> {
        self.write(actor.clone(), now, async |tx| {
            let is_by_organiser = match actor {
                Actor::Operator => true,
                Actor::User(user) => users::find(tx, user).await?.team.is_none(),
                _ => false,
            };
            if teams::find(tx, id).await?.retired_at.is_some() {
                return StoreError::conflict("the team has retired already");
            }
            teams::set_retired(tx, id, Some(now), is_by_organiser).await?;
            tx.record(Subject::Team(id), Event::TeamRetired);
            teams::find(tx, id).await
        })
        .await
    }

    /// Lets a retired team take part again. [`StoreError::Conflict`] if it has not retired.
    #[boxed_future]
    pub async fn return_team(&self, actor: Actor, id: TeamId, now: Timestamp) -> Result<Team> {
        self.write(actor, now, async |tx| {
            if teams::find(tx, id).await?.retired_at.is_none() {
                return StoreError::conflict("the team has not retired");
            }
            teams::set_retired(tx, id, None, false).await?;
            tx.record(Subject::Team(id), Event::TeamReturned);
            teams::find(tx, id).await
        })
        .await
    }
}
