//! The table of invitations: links with which users join, or get access to their account again.

use crate::{
    column::{Bytes32, Instant},
    error::{Result, StoreError},
    tables::tokens::Creator,
};
use faceoff_types::{InvitationId, TeamId, TokenId, UserId};
use jiff::Timestamp;
use sqlx::SqliteConnection;

/// The role of the user who accepts an invitation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InvitationRole {
    Organiser,
    /// A member of this team.
    Member(TeamId),
    /// The first member of a new team.
    Founder,
    /// An existing user, who gets access again: with a new token or session, and a new password if they want one. Stored as
    /// `return`.
    RestoreAccess(UserId),
}

impl InvitationRole {
    const fn columns(self) -> (&'static str, Option<TeamId>, Option<UserId>) {
        match self {
            Self::Organiser => ("organiser", None, None),
            Self::Member(team) => ("member", Some(team), None),
            Self::Founder => ("founder", None, None),
            Self::RestoreAccess(user) => ("return", None, Some(user)),
        }
    }

    fn from_columns(role: &str, team: Option<TeamId>, user: Option<UserId>) -> Result<Self> {
        Ok(match (role, team, user) {
            ("organiser", None, None) => Self::Organiser,
            ("founder", None, None) => Self::Founder,
            ("member", Some(team), None) => Self::Member(team),
            ("return", None, Some(user)) => Self::RestoreAccess(user),
            _ => return Err(StoreError::Damaged(format!("invited as {role:?}"))),
        })
    }
}

/// State of an invitation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InvitationState {
    /// It can be accepted until it expires.
    Unused,
    Accepted {
        user: UserId,
        accepted_at: Timestamp,
    },
    Revoked {
        revoked_at: Timestamp,
    },
}

/// An invitation link, which can be used once.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Invitation {
    /// Not secret: the link cannot be derived from it.
    pub id: InvitationId,
    pub role: InvitationRole,
    /// A note of its author, to recognise it in lists.
    pub note: String,
    pub creator: Creator,
    pub created_at: Timestamp,
    pub expires_at: Timestamp,
    pub state: InvitationState,
}

struct InvitationRow {
    id: InvitationId,
    role: String,
    team_id: Option<TeamId>,
    person_id: Option<UserId>,
    note: String,
    made_by: Option<UserId>,
    made_with: Option<TokenId>,
    created_at: Instant,
    expires_at: Instant,
    accepted_at: Option<Instant>,
    accepted_by: Option<UserId>,
    revoked_at: Option<Instant>,
}

impl TryFrom<InvitationRow> for Invitation {
    type Error = StoreError;
    fn try_from(row: InvitationRow) -> Result<Self> {
        let state = match (row.accepted_at, row.accepted_by, row.revoked_at) {
            (Some(at), Some(user), None) => InvitationState::Accepted {
                user,
                accepted_at: at.0,
            },
            (_, _, Some(at)) => InvitationState::Revoked { revoked_at: at.0 },
            _ => InvitationState::Unused,
        };
        Ok(Self {
            id: row.id,
            role: InvitationRole::from_columns(&row.role, row.team_id, row.person_id)?,
            note: row.note,
            creator: Creator {
                user: row.made_by,
                token: row.made_with,
            },
            created_at: row.created_at.0,
            expires_at: row.expires_at.0,
            state,
        })
    }
}

/// `SELECT` of whole invitations; the argument is the SQL after `FROM invitations`.
macro_rules! select_invitations {
    ($tail:literal $(, $argument:expr)*) => {
        sqlx::query_as!(
            InvitationRow,
            "SELECT id, role, team_id, person_id, note, made_by, made_with, created_at, expires_at, accepted_at,
                    accepted_by, revoked_at
             FROM invitations " + $tail
            $(, $argument)*
        )
    };
}

/// At most `limit` invitations, including used and expired ones, the newest first: all, or those to be a member of a team. Only
/// those that come after the invitation `after` in this order.
pub(crate) async fn list(
    connection: &mut SqliteConnection,
    team: Option<TeamId>,
    after: Option<&Invitation>,
    limit: u32,
) -> Result<Vec<Invitation>> {
    let created_at = Instant(after.map_or(Timestamp::MAX, |invitation| invitation.created_at));
    let id = after.map(|invitation| invitation.id);
    let rows = match team {
        None => {
            select_invitations!(
                "WHERE (created_at, id) < (?, ?) ORDER BY created_at DESC, id DESC LIMIT ?",
                created_at,
                id,
                limit
            )
            .fetch_all(connection)
            .await?
        }
        Some(team) => {
            select_invitations!(
                "WHERE team_id = ? AND (created_at, id) < (?, ?) ORDER BY created_at DESC, id DESC LIMIT ?",
                team,
                created_at,
                id,
                limit
            )
            .fetch_all(connection)
            .await?
        }
    };
    rows.into_iter().map(Invitation::try_from).collect()
}

/// Deletes at most `limit` invitations that were revoked, or expired unused, at `ended_until` or earlier. Returns their number.
pub(crate) async fn delete_ended(
    connection: &mut SqliteConnection,
    ended_until: Timestamp,
    limit: u32,
) -> Result<usize> {
    let deleted = sqlx::query!(
        "DELETE FROM invitations WHERE id IN (
             SELECT id FROM invitations
             WHERE accepted_at IS NULL AND coalesce(revoked_at, expires_at) <= ? LIMIT ?)",
        Instant(ended_until),
        limit
    )
    .execute(connection)
    .await?;
    Ok(usize::try_from(deleted.rows_affected()).unwrap_or(usize::MAX))
}

pub(crate) async fn find(
    connection: &mut SqliteConnection,
    id: InvitationId,
) -> Result<Invitation> {
    select_invitations!("WHERE id = ?", id)
        .fetch_optional(connection)
        .await?
        .ok_or(StoreError::NotFound("invitation"))?
        .try_into()
}

/// The invitation with this code, valid or not.
pub(crate) async fn by_code(
    connection: &mut SqliteConnection,
    code_hash: [u8; 32],
) -> Result<Option<Invitation>> {
    let row = select_invitations!("WHERE code_hash = ?", Bytes32(code_hash))
        .fetch_optional(connection)
        .await?;
    row.map(Invitation::try_from).transpose()
}

/// The valid, unused invitations at `now` that this user has made, or that were made with this token.
pub(crate) async fn open_created_by(
    connection: &mut SqliteConnection,
    creator: Creator,
    now: Timestamp,
) -> Result<Vec<Invitation>> {
    let rows = select_invitations!(
        "WHERE (made_by = ?1 OR made_with = ?2) AND accepted_at IS NULL AND revoked_at IS NULL AND expires_at > ?3
         ORDER BY created_at, id",
        creator.user,
        creator.token,
        Instant(now)
    )
    .fetch_all(connection)
    .await?;
    rows.into_iter().map(Invitation::try_from).collect()
}

/// The valid, unused links at `now` with which this user gets access again.
pub(crate) async fn open_access_links_of(
    connection: &mut SqliteConnection,
    user: UserId,
    now: Timestamp,
) -> Result<Vec<Invitation>> {
    let rows = select_invitations!(
        "WHERE person_id = ? AND accepted_at IS NULL AND revoked_at IS NULL AND expires_at > ?",
        user,
        Instant(now)
    )
    .fetch_all(connection)
    .await?;
    rows.into_iter().map(Invitation::try_from).collect()
}

/// Number of valid, unused invitations for members of a team.
pub(crate) async fn count_open(
    connection: &mut SqliteConnection,
    team: TeamId,
    now: Timestamp,
) -> Result<i64> {
    Ok(sqlx::query_scalar!(
        "SELECT COUNT(*) FROM invitations
         WHERE team_id = ? AND accepted_at IS NULL AND revoked_at IS NULL AND expires_at > ?",
        team,
        Instant(now)
    )
    .fetch_one(connection)
    .await?)
}

pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    invitation: &Invitation,
    code_hash: [u8; 32],
) -> Result<()> {
    let (role, team, user) = invitation.role.columns();
    sqlx::query!(
        "INSERT INTO invitations (id, code_hash, role, team_id, person_id, note, made_by, made_with, created_at, expires_at)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        invitation.id,
        Bytes32(code_hash),
        role,
        team,
        user,
        invitation.note,
        invitation.creator.user,
        invitation.creator.token,
        Instant(invitation.created_at),
        Instant(invitation.expires_at),
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn set_accepted(
    connection: &mut SqliteConnection,
    id: InvitationId,
    user: UserId,
    accepted_at: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE invitations SET accepted_at = ?, accepted_by = ? WHERE id = ?",
        Instant(accepted_at),
        user,
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn set_revoked(
    connection: &mut SqliteConnection,
    id: InvitationId,
    revoked_at: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE invitations SET revoked_at = ? WHERE id = ?",
        Instant(revoked_at),
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}
