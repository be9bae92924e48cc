use crate::{
    column::{Bytes32, Instant},
    error::{Result, StoreError},
};
use faceoff_types::{InvitationId, PersonId, TeamId};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};

/// What whoever follows the link becomes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InvitedAs {
    /// One of the organisers.
    Organiser,
    /// A member of this team.
    Member(TeamId),
    /// The first member of a team that they name.
    Founder,
    /// The person that they are, with a new password or key.
    Return(PersonId),
}

impl InvitedAs {
    const fn columns(self) -> (&'static str, Option<Text<TeamId>>, Option<Text<PersonId>>) {
        match self {
            Self::Organiser => ("organiser", None, None),
            Self::Member(team) => ("member", Some(Text(team)), None),
            Self::Founder => ("founder", None, None),
            Self::Return(person) => ("return", None, Some(Text(person))),
        }
    }

    fn of(role: &str, team: Option<Text<TeamId>>, person: Option<Text<PersonId>>) -> Result<Self> {
        Ok(match (role, team, person) {
            ("organiser", None, None) => Self::Organiser,
            ("founder", None, None) => Self::Founder,
            ("member", Some(team), None) => Self::Member(team.0),
            ("return", None, Some(person)) => Self::Return(person.0),
            _ => return Err(StoreError::Damaged(format!("invited as {role:?}"))),
        })
    }
}

/// Where an invitation stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InvitationState {
    Open,
    /// Somebody has followed it.
    Accepted {
        by: PersonId,
        at: Timestamp,
    },
    /// It was taken back.
    Revoked {
        at: Timestamp,
    },
}

/// A link by which one person joins, once.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Invitation {
    /// Names it; tells nothing of the link.
    pub id: InvitationId,
    /// What it makes of them.
    pub invited_as: InvitedAs,
    /// For whom it was made, as who made it wrote.
    pub note: String,
    /// When it was made.
    pub created_at: Timestamp,
    /// From then on it is worth nothing.
    pub expires_at: Timestamp,
    /// What became of it.
    pub state: InvitationState,
}

struct Row {
    id: Text<InvitationId>,
    role: String,
    team_id: Option<Text<TeamId>>,
    person_id: Option<Text<PersonId>>,
    note: String,
    created_at: Instant,
    expires_at: Instant,
    accepted_at: Option<Instant>,
    accepted_by: Option<Text<PersonId>>,
    revoked_at: Option<Instant>,
}

impl TryFrom<Row> for Invitation {
    type Error = StoreError;
    fn try_from(row: Row) -> Result<Self> {
        let state = match (row.accepted_at, row.accepted_by, row.revoked_at) {
            (Some(at), Some(by), None) => InvitationState::Accepted { by: by.0, at: at.0 },
            (_, _, Some(at)) => InvitationState::Revoked { at: at.0 },
            _ => InvitationState::Open,
        };
        Ok(Self {
            id: row.id.0,
            invited_as: InvitedAs::of(&row.role, row.team_id, row.person_id)?,
            note: row.note,
            created_at: row.created_at.0,
            expires_at: row.expires_at.0,
            state,
        })
    }
}

/// `SELECT` of whole invitations; the argument is what follows `FROM invitations`.
macro_rules! select_invitations {
    ($tail:literal $(, $argument:expr)*) => {
        sqlx::query_as!(
            Row,
            r#"SELECT id AS "id: Text<InvitationId>", role, team_id AS "team_id: Text<TeamId>",
                      person_id AS "person_id: Text<PersonId>", note, created_at AS "created_at: Instant",
                      expires_at AS "expires_at: Instant", accepted_at AS "accepted_at: Instant",
                      accepted_by AS "accepted_by: Text<PersonId>", revoked_at AS "revoked_at: Instant"
               FROM invitations "# + $tail
            $(, $argument)*
        )
    };
}

/// All that were ever made, the newest first.
pub(crate) async fn all(connection: &mut SqliteConnection) -> Result<Vec<Invitation>> {
    let rows = select_invitations!("ORDER BY created_at DESC, id DESC")
        .fetch_all(connection)
        .await?;
    rows.into_iter().map(Invitation::try_from).collect()
}

pub(crate) async fn find(
    connection: &mut SqliteConnection,
    id: InvitationId,
) -> Result<Invitation> {
    let id = Text(id);
    select_invitations!("WHERE id = ?", id)
        .fetch_optional(connection)
        .await?
        .ok_or(StoreError::NotFound("invitation"))?
        .try_into()
}

/// Whatever it is worth.
pub(crate) async fn by_code(
    connection: &mut SqliteConnection,
    code_hash: [u8; 32],
) -> Result<Option<Invitation>> {
    let code_hash = Bytes32(code_hash);
    let row = select_invitations!("WHERE code_hash = ?", code_hash)
        .fetch_optional(connection)
        .await?;
    row.map(Invitation::try_from).transpose()
}

/// Those of a team's members that somebody could still follow.
pub(crate) async fn count_open(
    connection: &mut SqliteConnection,
    team: TeamId,
    now: Timestamp,
) -> Result<i64> {
    let (team, now) = (Text(team), Instant(now));
    Ok(sqlx::query_scalar!(
        "SELECT COUNT(*) FROM invitations
         WHERE team_id = ? AND accepted_at IS NULL AND revoked_at IS NULL AND expires_at > ?",
        team,
        now
    )
    .fetch_one(connection)
    .await?)
}

pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    invitation: &Invitation,
    code_hash: [u8; 32],
) -> Result<()> {
    let (id, code_hash) = (Text(invitation.id), Bytes32(code_hash));
    let (role, team, person) = invitation.invited_as.columns();
    let created_at = Instant(invitation.created_at);
    let expires_at = Instant(invitation.expires_at);
    sqlx::query!(
        "INSERT INTO invitations (id, code_hash, role, team_id, person_id, note, created_at, expires_at)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
        id,
        code_hash,
        role,
        team,
        person,
        invitation.note,
        created_at,
        expires_at,
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn set_accepted(
    connection: &mut SqliteConnection,
    id: InvitationId,
    by: PersonId,
    at: Timestamp,
) -> Result<()> {
    let (id, by, at) = (Text(id), Text(by), Instant(at));
    sqlx::query!(
        "UPDATE invitations SET accepted_at = ?, accepted_by = ? WHERE id = ?",
        at,
        by,
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn set_revoked(
    connection: &mut SqliteConnection,
    id: InvitationId,
    at: Timestamp,
) -> Result<()> {
    let (id, at) = (Text(id), Instant(at));
    sqlx::query!("UPDATE invitations SET revoked_at = ? WHERE id = ?", at, id)
        .execute(connection)
        .await?;
    Ok(())
}
