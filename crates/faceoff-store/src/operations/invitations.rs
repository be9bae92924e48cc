//! Links by which people join: made, taken back, and followed once.

use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::tokens::{NewToken, add, revoke_all},
    store::Store,
    tables::{
        divisions,
        invitations::{self, Invitation, InvitationState, InvitedAs},
        people::{self, Person},
        registrations::{self, Registration, RegistrationState},
        season,
        teams::{self, Team, TeamProfile},
        terms,
        tokens::{Token, TokenKind, TokenOwner},
    },
    write::Tx,
};
use faceoff_types::{InvitationId, PersonId, PersonName, TeamId, TeamName};
use jiff::Timestamp;

/// Links to one team that may be open at a time.
pub const MAX_OPEN_INVITATIONS: i64 = 20;

/// An invitation to be made; the code in the link is the caller's.
#[derive(Debug, Clone)]
pub struct NewInvitation {
    /// Of the code's text.
    pub code_hash: [u8; 32],
    /// What it makes of whoever follows the link.
    pub invited_as: InvitedAs,
    pub note: String,
    /// From then on it is worth nothing.
    pub expires_at: Timestamp,
}

/// What whoever follows a link brings.
#[derive(Debug, Clone)]
pub struct Joining {
    /// Of the code in the link.
    pub code_hash: [u8; 32],
    /// What they want to be called; whoever comes back has a name.
    pub name: Option<PersonName>,
    /// PHC string of the hash of their password, if they want one.
    pub password: Option<String>,
    /// The team, if the link is its founder's.
    pub team: Option<(TeamName, TeamProfile)>,
    /// The version of the terms that they accept.
    pub accepted_terms: Option<u32>,
    /// The hash of the key or session that they get.
    pub token_hash: [u8; 32],
    /// Which of both.
    pub token_kind: TokenKind,
    /// What it is called.
    pub token_name: String,
    /// Until when it is good.
    pub token_expires_at: Option<Timestamp>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Joined {
    pub person: Person,
    /// Their team, unless they are an organiser.
    pub team: Option<Team>,
    /// With what they call from now on.
    pub token: Token,
}

/// What a code is good for.
#[derive(Debug, Clone, PartialEq)]
pub enum Code {
    /// A link that can be followed, to a team's name if it is a member's.
    Open(Invitation, Option<TeamName>),
    /// The registration waits for the organisers.
    Waiting(Registration),
    /// The organisers have refused the registration.
    Refused(Registration),
}

fn spent<T>(why: impl Into<String>) -> Result<T> {
    Err(StoreError::InvitationSpent(why.into()))
}

fn check_open(invitation: &Invitation, now: Timestamp) -> Result<()> {
    let shown = |at: Timestamp| at.strftime("%Y-%m-%d %H:%M UTC").to_string();
    match invitation.state {
        InvitationState::Accepted { at, .. } => spent(format!(
            "the invitation was accepted on {}, and is good for one person; ask for another one",
            shown(at)
        )),
        InvitationState::Revoked { at } => spent(format!(
            "the invitation was taken back on {}; ask for another one",
            shown(at)
        )),
        InvitationState::Open if invitation.expires_at <= now => spent(format!(
            "the invitation was good until {}; ask for another one",
            shown(invitation.expires_at)
        )),
        InvitationState::Open => Ok(()),
    }
}

/// Adds an invitation, for a time that is to come.
pub(super) async fn invite(tx: &mut Tx, new: NewInvitation) -> Result<Invitation> {
    let now = tx.now;
    let invitation = Invitation {
        id: InvitationId::new(),
        invited_as: new.invited_as,
        note: new.note,
        created_at: now,
        expires_at: new.expires_at,
        state: InvitationState::Open,
    };
    invitations::insert(tx, &invitation, new.code_hash).await?;
    let (role, subject) = match invitation.invited_as {
        InvitedAs::Organiser => ("organiser", Subject::Season),
        InvitedAs::Founder => ("founder", Subject::Season),
        InvitedAs::Member(team) => ("member", Subject::Team(team)),
        InvitedAs::Return(person) => ("return", Subject::Person(person)),
    };
    let event = Event::Invited {
        invitation: invitation.id,
        role: role.to_owned(),
        note: invitation.note.clone(),
        expires_at: invitation.expires_at,
    };
    tx.record(subject, event);
    invitations::find(tx, invitation.id).await
}

/// Refuses a wrong consent to the terms: there are some, and it is not to the newest.
pub(super) async fn check_terms(tx: &mut Tx, accepted: Option<u32>) -> Result<()> {
    match terms::newest(tx).await? {
        Some(newest) if accepted != Some(newest) => Err(StoreError::Conflict(format!(
            "accepted_terms: taking part needs consent to version {newest} of the terms (GET /api/v1/terms); got {}",
            accepted.map_or_else(|| "none".to_owned(), |version| format!("{version}"))
        ))),
        None if accepted.is_some() => Err(StoreError::Conflict(
            "accepted_terms: this season has no terms, so leave it out".into(),
        )),
        _ => Ok(()),
    }
}

/// Adds a team. [`StoreError::TeamNameTaken`] if its name exists.
pub(super) async fn add_team(
    tx: &mut Tx,
    name: TeamName,
    mut profile: TeamProfile,
) -> Result<TeamId> {
    if let Some(division) = &profile.division {
        profile.division = Some(divisions::check(tx, division).await?);
    }
    let team = Team {
        id: TeamId::new(),
        name,
        created_at: tx.now,
        disqualified: None,
        profile,
        retired_at: None,
        is_baseline: false,
    };
    teams::insert(tx, &team).await?;
    let (id, name) = (team.id, team.name);
    tx.record(Subject::Team(id), Event::TeamCreated { name });
    Ok(id)
}

async fn newcomer(tx: &mut Tx, joining: &mut Joining, team: Option<TeamId>) -> Result<PersonId> {
    let Some(name) = joining.name.clone() else {
        return Err(StoreError::Conflict(
            "name: expected the name by which the person is known and signs in; got none".into(),
        ));
    };
    check_terms(tx, joining.accepted_terms).await?;
    let person = Person {
        id: PersonId::new(),
        name,
        team,
        joined_at: tx.now,
        left_at: None,
        has_password: joining.password.is_some(),
        accepted_terms: joining.accepted_terms,
    };
    people::insert(tx, &person, joining.password.as_deref()).await?;
    let (id, name) = (person.id, person.name);
    tx.record(Subject::Person(id), Event::PersonJoined { name, team });
    Ok(id)
}

/// Lets a person back in: what they had before is worth nothing any more.
async fn come_back(tx: &mut Tx, id: PersonId, joining: &Joining) -> Result<()> {
    let person = people::find(tx, id).await?;
    if joining
        .name
        .as_ref()
        .is_some_and(|name| *name != person.name)
    {
        return Err(StoreError::Conflict(format!(
            "name: the link is {}'s; leave the name out",
            person.name
        )));
    }
    if person.left_at.is_some() {
        return spent(format!("{} has left", person.name));
    }
    revoke_all(tx, TokenOwner::Person(id), None).await?;
    if let Some(password) = &joining.password {
        people::set_password(tx, id, password).await?;
        tx.record(Subject::Person(id), Event::PasswordSet);
    }
    Ok(())
}

async fn join(tx: &mut Tx, mut joining: Joining) -> Result<Joined> {
    let now = tx.now;
    let invitation = match code(tx, joining.code_hash, now).await? {
        Code::Open(invitation, _) => invitation,
        Code::Waiting(registration) => {
            return spent(format!(
                "the registration of “{}” waits for the organisers; the same link is good once they have approved it",
                registration.team_name
            ));
        }
        Code::Refused(registration) => {
            let RegistrationState::Refused { reason, .. } = registration.state else {
                return spent("the registration was refused");
            };
            return spent(format!("the registration was refused: {reason}"));
        }
    };
    let founds = invitation.invited_as == InvitedAs::Founder;
    if founds != joining.team.is_some() {
        return Err(StoreError::Conflict(if founds {
            "team: the link is for the founder of a team; expected the team's name".into()
        } else {
            "team: the link is not for the founder of a team; leave it out".into()
        }));
    }
    let person = match invitation.invited_as {
        InvitedAs::Organiser => newcomer(tx, &mut joining, None).await?,
        InvitedAs::Member(team) => newcomer(tx, &mut joining, Some(team)).await?,
        InvitedAs::Founder => {
            season::check_open(tx).await?;
            let team = match joining.team.take() {
                Some((name, profile)) => Some(add_team(tx, name, profile).await?),
                None => None,
            };
            newcomer(tx, &mut joining, team).await?
        }
        InvitedAs::Return(person) => {
            come_back(tx, person, &joining).await?;
            person
        }
    };
    invitations::set_accepted(tx, invitation.id, person, now).await?;
    let token = NewToken {
        hash: joining.token_hash,
        kind: joining.token_kind,
        owner: TokenOwner::Person(person),
        name: joining.token_name,
        expires_at: joining.token_expires_at,
    };
    let token = add(tx, token).await?;
    let person = people::find(tx, person).await?;
    let team = match person.team {
        Some(team) => Some(teams::find(tx, team).await?),
        None => None,
    };
    Ok(Joined {
        person,
        team,
        token,
    })
}

async fn code(
    connection: &mut sqlx::SqliteConnection,
    hash: [u8; 32],
    now: Timestamp,
) -> Result<Code> {
    if let Some(invitation) = invitations::by_code(connection, hash).await? {
        check_open(&invitation, now)?;
        let team = match invitation.invited_as {
            InvitedAs::Member(team) => Some(teams::find(connection, team).await?.name),
            _ => None,
        };
        return Ok(Code::Open(invitation, team));
    }
    match registrations::by_code(connection, hash).await? {
        Some(registration) => Ok(match registration.state {
            RegistrationState::Refused { .. } => Code::Refused(registration),
            RegistrationState::Waiting | RegistrationState::Approved { .. } => {
                Code::Waiting(registration)
            }
        }),
        None => spent(
            "there is no such invitation; look whether the whole link was copied, or ask for another one",
        ),
    }
}

impl Store {
    /// Makes an invitation. [`StoreError::Conflict`] if it would be worth nothing, if the team has as many open as it
    /// may have, or the person has left; [`StoreError::NotFound`] if there is no such team or person.
    #[boxed]
    pub async fn invite(
        &self,
        actor: Actor,
        new: NewInvitation,
        now: Timestamp,
    ) -> Result<Invitation> {
        self.write(actor, now, async |tx| {
            if new.expires_at <= now {
                return Err(StoreError::Conflict(format!(
                    "expires_at: expected a time in the future, got {}",
                    new.expires_at
                )));
            }
            match new.invited_as {
                InvitedAs::Member(team) => {
                    teams::find(tx, team).await?;
                    if invitations::count_open(tx, team, now).await? >= MAX_OPEN_INVITATIONS {
                        return Err(StoreError::Conflict(format!(
                            "{MAX_OPEN_INVITATIONS} invitations to the team are open, and no more than that at a \
                             time: revoke one that is not needed (DELETE /api/v1/invitations/ID)"
                        )));
                    }
                }
                InvitedAs::Return(person) => {
                    let person = people::find(tx, person).await?;
                    if person.left_at.is_some() {
                        return Err(StoreError::Conflict(format!(
                            "{} has left; invite them anew, under another name",
                            person.name
                        )));
                    }
                }
                InvitedAs::Organiser | InvitedAs::Founder => {}
            }
            invite(tx, new).await
        })
        .await
    }

    /// Takes an invitation back. [`StoreError::Conflict`] if somebody has followed it.
    #[boxed]
    pub async fn revoke_invitation(
        &self,
        actor: Actor,
        id: InvitationId,
        now: Timestamp,
    ) -> Result<Invitation> {
        self.write(actor, now, async |tx| {
            let invitation = invitations::find(tx, id).await?;
            match invitation.state {
                InvitationState::Accepted { .. } => {
                    return Err(StoreError::Conflict(
                        "somebody has followed the link; remove them with DELETE /api/v1/people/ID"
                            .into(),
                    ));
                }
                InvitationState::Revoked { .. } => {}
                InvitationState::Open => {
                    invitations::set_revoked(tx, id, now).await?;
                    let subject = match invitation.invited_as {
                        InvitedAs::Member(team) => Subject::Team(team),
                        InvitedAs::Return(person) => Subject::Person(person),
                        InvitedAs::Organiser | InvitedAs::Founder => Subject::Season,
                    };
                    tx.record(subject, Event::InvitationRevoked { invitation: id });
                }
            }
            invitations::find(tx, id).await
        })
        .await
    }

    /// What a code is good for. [`StoreError::InvitationSpent`] says why it is good for nothing.
    #[boxed]
    pub async fn code(&self, hash: [u8; 32], now: Timestamp) -> Result<Code> {
        code(&mut *self.database.read.acquire().await?, hash, now).await
    }

    /// Follows a link: a person joins, or comes back, and has a key or a session from now on.
    /// [`StoreError::InvitationSpent`] if it is worth nothing (any more), [`StoreError::PersonNameTaken`],
    /// [`StoreError::TeamNameTaken`], [`StoreError::Conflict`] if something is missing that the text names.
    #[boxed]
    pub async fn join(&self, joining: Joining, now: Timestamp) -> Result<Joined> {
        self.write(Actor::Visitor, now, async |tx| join(tx, joining).await)
            .await
    }

    /// All invitations that were ever made, the newest first.
    #[boxed]
    pub async fn invitations(&self) -> Result<Vec<Invitation>> {
        invitations::all(&mut *self.database.read.acquire().await?).await
    }
}
