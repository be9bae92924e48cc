//! Proposals: what is tried, or played again, without counting.

use crate::{
    column::Instant,
    error::{Result, StoreError},
};
use faceoff_types::{ProposalId, StageId};
use jiff::{Timestamp, civil::Date};
use sqlx::{SqliteConnection, types::Text};

/// Evaluations of a stage that do not count.
#[derive(Debug, Clone, PartialEq)]
pub struct Proposal {
    /// Part of its URLs.
    pub id: ProposalId,
    /// Whose rules they are played by.
    pub stage: StageId,
    /// By which of these.
    pub revision: u32,
    pub kind: ProposalKind,
    pub reason: String,
    /// When it was queued.
    pub created_at: Timestamp,
    /// What became of it; `None`: nothing yet.
    pub settled: Option<Settled>,
}

/// What a proposal plays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProposalKind {
    /// What is active now, on episodes of its own: to see how it goes. It never counts.
    Trial,
    /// One evaluation of a day once more, on the same episodes.
    Evaluation(Date),
    /// All of a day that count, once more, on the same episodes.
    Day(Date),
    /// All of a day that count, on the same episodes by the stage's newest rules: for the board of these.
    Rules(Date),
}

impl ProposalKind {
    /// The date whose results it would change; `None` of a trial.
    #[must_use]
    pub const fn day(self) -> Option<Date> {
        match self {
            Self::Trial => None,
            Self::Evaluation(day) | Self::Day(day) | Self::Rules(day) => Some(day),
        }
    }

    const fn label(self) -> &'static str {
        match self {
            Self::Trial => "trial",
            Self::Evaluation(_) => "evaluation",
            Self::Day(_) => "day",
            Self::Rules(_) => "rules",
        }
    }

    fn of(label: &str, day: Option<Date>) -> Option<Self> {
        Some(match (label, day) {
            ("trial", None) => Self::Trial,
            ("evaluation", Some(day)) => Self::Evaluation(day),
            ("day", Some(day)) => Self::Day(day),
            ("rules", Some(day)) => Self::Rules(day),
            _ => return None,
        })
    }
}

/// How a proposal ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Settled {
    /// What it played counts since then.
    Applied(Timestamp),
    /// It never will.
    Dropped(Timestamp),
}

struct Row {
    id: Text<ProposalId>,
    stage: Text<StageId>,
    revision: u32,
    kind: String,
    day: Option<Text<Date>>,
    reason: String,
    created_at: Instant,
    settled_at: Option<Instant>,
    outcome: Option<String>,
}

impl TryFrom<Row> for Proposal {
    type Error = StoreError;
    fn try_from(row: Row) -> Result<Self> {
        let damaged = |what: &str| StoreError::Damaged(format!("proposal {}: {what}", row.id.0));
        let kind = ProposalKind::of(&row.kind, row.day.as_ref().map(|day| day.0));
        let settled = match (row.outcome.as_deref(), row.settled_at) {
            (None, None) => None,
            (Some("applied"), Some(at)) => Some(Settled::Applied(at.0)),
            (Some("dropped"), Some(at)) => Some(Settled::Dropped(at.0)),
            _ => return Err(damaged("settled in no way that there is")),
        };
        Ok(Self {
            id: row.id.0,
            stage: row.stage.0,
            revision: row.revision,
            kind: kind.ok_or_else(|| damaged("of no kind that there is"))?,
            reason: row.reason,
            created_at: row.created_at.0,
            settled,
        })
    }
}

macro_rules! select_proposals {
    ($tail:literal $(, $argument:expr)*) => {
        sqlx::query_as!(
            Row,
            r#"SELECT id AS "id: Text<ProposalId>", stage_id AS "stage: Text<StageId>", revision AS "revision: u32",
                      kind, day AS "day: Text<Date>", reason, created_at AS "created_at: Instant",
                      settled_at AS "settled_at: Instant", outcome
               FROM proposals "# + $tail
            $(, $argument)*
        )
    };
}

/// All of the season, the newest first.
pub(crate) async fn all(connection: &mut SqliteConnection) -> Result<Vec<Proposal>> {
    let rows = select_proposals!("ORDER BY created_at DESC, id DESC");
    let rows = rows.fetch_all(connection).await?;
    rows.into_iter().map(Proposal::try_from).collect()
}

pub(crate) async fn find(connection: &mut SqliteConnection, id: ProposalId) -> Result<Proposal> {
    let id = Text(id);
    select_proposals!("WHERE id = ?", id)
        .fetch_optional(connection)
        .await?
        .ok_or(StoreError::NotFound("proposal"))?
        .try_into()
}

pub(crate) async fn insert(connection: &mut SqliteConnection, new: &Proposal) -> Result<()> {
    let (id, stage, kind) = (Text(new.id), Text(new.stage), new.kind.label());
    let (day, created_at) = (new.kind.day().map(Text), Instant(new.created_at));
    sqlx::query!(
        "INSERT INTO proposals (id, stage_id, revision, kind, day, reason, created_at)
         VALUES (?, ?, ?, ?, ?, ?, ?)",
        id,
        stage,
        new.revision,
        kind,
        day,
        new.reason,
        created_at,
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn settle(
    connection: &mut SqliteConnection,
    id: ProposalId,
    settled: Settled,
) -> Result<()> {
    let (outcome, at) = match settled {
        Settled::Applied(at) => ("applied", at),
        Settled::Dropped(at) => ("dropped", at),
    };
    let (id, at) = (Text(id), Instant(at));
    sqlx::query!(
        "UPDATE proposals SET outcome = ?, settled_at = ? WHERE id = ?",
        outcome,
        at,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}
