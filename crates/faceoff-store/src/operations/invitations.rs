//! Invitations: single-use links with which users join. Their creation, revocation and acceptance. A link contains a
//! secret code; the code of a registration of a new team becomes an invitation once organisers have approved it. Links of the
//! role [`RestoreAccess`](InvitationRole::RestoreAccess), stored as `return`, give an existing user access again.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{
        ended_credentials::{self, EndedCredentials, revoke_created_by},
        requester::{self, Requester},
        tokens::{NewToken, add_token, revoke_all},
    },
    store::Store,
    tables::{
        divisions,
        invitations::{self, Invitation, InvitationRole, InvitationState},
        registrations::{self, Registration, RegistrationState},
        season,
        teams::{self, Team, TeamProfile},
        terms,
        tokens::{Token, TokenKind, TokenOwner},
        users::{self, User},
    },
    write::Tx,
};
use faceoff_types::{InvitationId, TeamId, TeamName, UserId, UserName};
use jiff::Timestamp;

/// Number of invitations to one team that may be open at a time.
pub const MAX_OPEN_INVITATIONS: i64 = 20;

/// An invitation to be created. The caller makes the code in the link; only its hash is stored.
#[derive(Debug, Clone)]
pub struct NewInvitation {
    /// Hash of the code's text.
    pub code_hash: [u8; 32],
    /// Role of the user who accepts it.
    pub role: InvitationRole,
    pub note: String,
    pub requester: Requester,
    pub expires_at: Timestamp,
}

/// Data of a user who accepts an invitation.
#[derive(Debug, Clone)]
pub struct JoinRequest {
    /// Hash of the code in the link.
    pub code_hash: [u8; 32],
    /// Name of a new user; `None` for one who gets access again and has a name.
    pub name: Option<UserName>,
    /// Password hash as a PHC string, if the user wants a password.
    pub password_hash: Option<String>,
    /// The new team, if the invitation is for a founder.
    pub team: Option<(TeamName, TeamProfile)>,
    /// Version of the terms that the user accepts.
    pub accepted_terms: Option<u32>,
    /// Hash of the token or session that the user gets.
    pub token_hash: [u8; 32],
    pub token_kind: TokenKind,
    pub token_name: String,
    pub token_expires_at: Option<Timestamp>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct JoinOutcome {
    pub user: User,
    /// The user's team; `None` for an organiser.
    pub team: Option<Team>,
    pub token: Token,
    /// The credentials that were revoked because the user got access again: those that the user had created before.
    pub ended: EndedCredentials,
}

/// Status of the code in an invitation link or a registration link.
#[derive(Debug, Clone, PartialEq)]
pub enum CodeStatus {
    /// An invitation that can be accepted, with the team's name if it is for a member.
    Invitation(Invitation, Option<TeamName>),
    /// The organisers have not decided on the registration yet.
    PendingRegistration(Registration),
    /// The organisers have refused the registration.
    RefusedRegistration(Registration),
}

fn invalid_invitation<T>(reason: impl Into<String>) -> Result<T> {
    Err(StoreError::InvitationInvalid(reason.into()))
}

fn check_open(invitation: &Invitation, now: Timestamp) -> Result<()> {
    let format_time = |time: Timestamp| time.strftime("%Y-%m-%d %H:%M UTC").to_string();
    match invitation.state {
        InvitationState::Accepted { accepted_at, .. } => invalid_invitation(format!(
            "the invitation was accepted on {}, and can be used only once; ask for another one",
            format_time(accepted_at)
        )),
        InvitationState::Revoked { revoked_at } => invalid_invitation(format!(
            "the invitation was revoked on {}; ask for another one",
            format_time(revoked_at)
        )),
        InvitationState::Unused if invitation.expires_at <= now => invalid_invitation(format!(
            "the invitation expired on {}; ask for another one",
            format_time(invitation.expires_at)
        )),
        InvitationState::Unused => Ok(()),
    }
}

/// Adds an invitation whose expiry has been checked.
pub(super) async fn invite(tx: &mut Tx, new: NewInvitation) -> Result<Invitation> {
    let now = tx.now;
    let creator = requester::check(tx, &new.requester, now).await?;
    let invitation = Invitation {
        id: InvitationId::new(),
        role: new.role,
        note: new.note,
        creator,
        created_at: now,
        expires_at: new.expires_at,
        state: InvitationState::Unused,
    };
    invitations::insert(tx, &invitation, new.code_hash).await?;
    let (role, subject) = match invitation.role {
        InvitationRole::Organiser => ("organiser", Subject::Season),
        InvitationRole::Founder => ("founder", Subject::Season),
        InvitationRole::Member(team) => ("member", Subject::Team(team)),
        // The name in the log is that of the column and of the API.
        InvitationRole::RestoreAccess(user) => ("return", Subject::User(user)),
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

/// Refuses if the user has not accepted the season's newest terms, or has accepted terms although it has none.
pub(super) async fn check_terms(tx: &mut Tx, accepted: Option<u32>) -> Result<()> {
    match terms::newest(tx).await? {
        Some(newest) if accepted != Some(newest) => StoreError::conflict(format!(
            "accepted_terms: taking part needs consent to version {newest} of the terms (GET /api/v1/terms); got {}",
            accepted.map_or_else(|| "none".to_owned(), |version| format!("{version}"))
        )),
        None if accepted.is_some() => {
            StoreError::conflict("accepted_terms: this season has no terms, so leave it out")
        }
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

async fn add_user(tx: &mut Tx, request: &mut JoinRequest, team: Option<TeamId>) -> Result<UserId> {
    let Some(name) = request.name.clone() else {
        return StoreError::conflict(
            "name: expected the name that the user is shown with and signs in with; got none",
        );
    };
    check_terms(tx, request.accepted_terms).await?;
    let user = User {
        id: UserId::new(),
        name,
        team,
        joined_at: tx.now,
        left_at: None,
        has_password: request.password_hash.is_some(),
        accepted_terms: request.accepted_terms,
    };
    users::insert(tx, &user, request.password_hash.as_deref()).await?;
    let (id, name) = (user.id, user.name);
    tx.record(Subject::User(id), Event::UserJoined { name, team });
    Ok(id)
}

/// Gives a user access again: all earlier tokens and sessions are revoked, and so are the credentials that the user has created.
async fn restore_access(
    tx: &mut Tx,
    id: UserId,
    request: &JoinRequest,
) -> Result<EndedCredentials> {
    let user = users::find(tx, id).await?;
    if request.name.as_ref().is_some_and(|name| *name != user.name) {
        return StoreError::conflict(format!(
            "name: the link belongs to {}; leave the name out",
            user.name
        ));
    }
    if user.left_at.is_some() {
        return invalid_invitation(format!("{} has left", user.name));
    }
    revoke_all(tx, TokenOwner::User(id), None).await?;
    if let Some(password_hash) = &request.password_hash {
        users::set_password(tx, id, password_hash).await?;
        tx.record(Subject::User(id), Event::PasswordSet);
    }
    revoke_created_by(tx, id, None, "the user who made it got new access").await
}

async fn join(tx: &mut Tx, mut request: JoinRequest) -> Result<JoinOutcome> {
    let now = tx.now;
    let invitation = match code_status(tx, request.code_hash, now).await? {
        CodeStatus::Invitation(invitation, _) => invitation,
        CodeStatus::PendingRegistration(registration) => {
            return invalid_invitation(format!(
                "the registration of “{}” is pending; the same link is valid once the organisers have approved it",
                registration.team_name
            ));
        }
        CodeStatus::RefusedRegistration(registration) => {
            let RegistrationState::Refused { reason, .. } = registration.state else {
                return invalid_invitation("the registration was refused");
            };
            return invalid_invitation(format!("the registration was refused: {reason}"));
        }
    };
    let is_founder = invitation.role == InvitationRole::Founder;
    if is_founder != request.team.is_some() {
        return StoreError::conflict(if is_founder {
            "team: the link is for the founder of a team; expected the team's name"
        } else {
            "team: the link is not for the founder of a team; leave it out"
        });
    }
    let mut ended = EndedCredentials::default();
    let user = match invitation.role {
        InvitationRole::Organiser => add_user(tx, &mut request, None).await?,
        InvitationRole::Member(team) => add_user(tx, &mut request, Some(team)).await?,
        InvitationRole::Founder => {
            season::check_open(tx).await?;
            let team = match request.team.take() {
                Some((name, profile)) => Some(add_team(tx, name, profile).await?),
                None => None,
            };
            add_user(tx, &mut request, team).await?
        }
        InvitationRole::RestoreAccess(user) => {
            // Before the user's own credentials are revoked, which may include this link.
            invitations::set_accepted(tx, invitation.id, user, now).await?;
            ended = restore_access(tx, user, &request).await?;
            user
        }
    };
    if !matches!(invitation.role, InvitationRole::RestoreAccess(_)) {
        invitations::set_accepted(tx, invitation.id, user, now).await?;
    }
    let token = NewToken {
        hash: request.token_hash,
        kind: request.token_kind,
        owner: TokenOwner::User(user),
        name: request.token_name,
        requester: Requester {
            user: Some(user),
            token: None,
        },
        expires_at: request.token_expires_at,
    };
    let token = add_token(tx, token).await?;
    let user = users::find(tx, user).await?;
    let team = match user.team {
        Some(team) => Some(teams::find(tx, team).await?),
        None => None,
    };
    Ok(JoinOutcome {
        user,
        team,
        token,
        ended,
    })
}

async fn code_status(
    connection: &mut sqlx::SqliteConnection,
    hash: [u8; 32],
    now: Timestamp,
) -> Result<CodeStatus> {
    if let Some(invitation) = invitations::by_code(connection, hash).await? {
        check_open(&invitation, now)?;
        let team = match invitation.role {
            InvitationRole::Member(team) => Some(teams::find(connection, team).await?.name),
            _ => None,
        };
        return Ok(CodeStatus::Invitation(invitation, team));
    }
    match registrations::by_code(connection, hash).await? {
        Some(registration) => Ok(match registration.state {
            RegistrationState::Refused { .. } => CodeStatus::RefusedRegistration(registration),
            RegistrationState::Pending | RegistrationState::Approved { .. } => {
                CodeStatus::PendingRegistration(registration)
            }
        }),
        None => invalid_invitation(
            "there is no such invitation; check that the whole link was copied, or ask for another one",
        ),
    }
}

impl Store {
    /// Creates an invitation. One with which a user gets access again revokes the user's earlier ones. [`StoreError::Conflict`] if it
    /// would be expired, if the team has [`MAX_OPEN_INVITATIONS`] open ones, or the user has left; [`StoreError::NotFound`] if there
    /// is no such team or user.
    #[boxed_future]
    pub async fn invite(
        &self,
        actor: Actor,
        new: NewInvitation,
        now: Timestamp,
    ) -> Result<Invitation> {
        self.write(actor, now, async |tx| {
            if new.expires_at <= now {
                return StoreError::conflict(format!(
                    "expires_at: expected a time in the future, got {}",
                    new.expires_at
                ));
            }
            match new.role {
                InvitationRole::Member(team) => {
                    teams::find(tx, team).await?;
                    if invitations::count_open(tx, team, now).await? >= MAX_OPEN_INVITATIONS {
                        return StoreError::conflict(format!(
                            "the team has {MAX_OPEN_INVITATIONS} open invitations, which is the limit: revoke one that \
                             is not needed (DELETE /api/v1/invitations/ID)"
                        ));
                    }
                }
                InvitationRole::RestoreAccess(user) => {
                    let user = users::find(tx, user).await?;
                    if user.left_at.is_some() {
                        return StoreError::conflict(format!(
                            "{} has left; create a new invitation, for another name",
                            user.name
                        ));
                    }
                    for earlier in invitations::open_access_links_of(tx, user.id, now).await? {
                        ended_credentials::revoke_invitation(tx, earlier).await?;
                    }
                }
                InvitationRole::Organiser | InvitationRole::Founder => {}
            }
            invite(tx, new).await
        })
        .await
    }

    /// Revokes an invitation. [`StoreError::Conflict`] if it was accepted.
    #[boxed_future]
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
                    return StoreError::conflict(
                        "the invitation was accepted; remove the user with DELETE /api/v1/people/ID",
                    );
                }
                InvitationState::Revoked { .. } => {}
                InvitationState::Unused => {
                    return ended_credentials::revoke_invitation(tx, invitation).await;
                }
            }
            Ok(invitation)
        })
        .await
    }

    /// Status of a code. [`StoreError::InvitationInvalid`] with the reason if it is not valid.
    #[boxed_future]
    pub async fn code_status(&self, hash: [u8; 32], now: Timestamp) -> Result<CodeStatus> {
        code_status(&mut *self.database.read.acquire().await?, hash, now).await
    }

    /// Accepts an invitation: a user joins, or gets access again, and receives a token or a session.
    /// [`StoreError::InvitationInvalid`] if it is not valid (any more), [`StoreError::UserNameTaken`],
    /// [`StoreError::TeamNameTaken`], [`StoreError::Conflict`] naming the missing field.
    #[boxed_future]
    pub async fn join(&self, request: JoinRequest, now: Timestamp) -> Result<JoinOutcome> {
        self.write(Actor::Visitor, now, async |tx| join(tx, request).await)
            .await
    }

    /// At most `limit` invitations, the newest first: all, or those to be a member of a team. With `after`, those that come after
    /// this invitation; `None` if it is not in the list.
    #[boxed_future]
    pub async fn invitations_after(
        &self,
        team: Option<TeamId>,
        after: Option<InvitationId>,
        limit: u32,
    ) -> Result<Option<Vec<Invitation>>> {
        let mut connection = self.database.read.acquire().await?;
        let is_listed = |invitation: &Invitation| {
            team.is_none_or(|team| invitation.role == InvitationRole::Member(team))
        };
        let after = match after {
            None => None,
            Some(id) => match invitations::find(&mut connection, id).await {
                Ok(invitation) if is_listed(&invitation) => Some(invitation),
                Ok(_) | Err(StoreError::NotFound(_)) => return Ok(None),
                Err(error) => return Err(error),
            },
        };
        let listed = invitations::list(&mut connection, team, after.as_ref(), limit).await?;
        Ok(Some(listed))
    }

    #[boxed_future]
    pub async fn invitation(&self, id: InvitationId) -> Result<Invitation> {
        invitations::find(&mut *self.database.read.acquire().await?, id).await
    }
}
