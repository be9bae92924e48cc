//! The table of proposals: trials, which never count, and proposed re-evaluations, which count only if they are applied.

use crate::{
    column::Instant,
    error::{Result, StoreError},
};
use faceoff_types::{ProposalId, StageId};
use jiff::{Timestamp, civil::Date};
use sqlx::{SqliteConnection, types::Text};

/// A trial or a proposed re-evaluation of a stage.
#[derive(Debug, Clone, PartialEq)]
pub struct Proposal {
    /// Part of its URLs.
    pub id: ProposalId,
    pub stage: StageId,
    /// Revision of the stage's rules.
    pub revision: u32,
    pub kind: ProposalKind,
    pub reason: String,
    /// When it was queued.
    pub created_at: Timestamp,
    /// `None` while it is neither applied nor dropped.
    pub outcome: Option<ProposalOutcome>,
}

/// The evaluations that a proposal consists of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProposalKind {
    /// A trial of the currently active submissions on separate episodes. It never counts.
    Trial,
    /// Repeats one evaluation of a day, on the same episodes.
    Evaluation(Date),
    /// Repeats all counting evaluations of a day, on the same episodes.
    Day(Date),
    /// Repeats all counting evaluations of a day, on the same episodes, under the newest revision of the stage's rules.
    DayWithNewestRules(Date),
}

impl ProposalKind {
    /// The date whose results it would change; `None` for a trial.
    #[must_use]
    pub const fn day(self) -> Option<Date> {
        match self {
            Self::Trial => None,
            Self::Evaluation(day) | Self::Day(day) | Self::DayWithNewestRules(day) => Some(day),
        }
    }

    const fn stored_name(self) -> &'static str {
        match self {
            Self::Trial => "trial",
            Self::Evaluation(_) => "evaluation",
            Self::Day(_) => "day",
            Self::DayWithNewestRules(_) => "rules",
        }
    }

    fn from_columns(stored_name: &str, day: Option<Date>) -> Option<Self> {
        Some(match (stored_name, day) {
            ("trial", None) => Self::Trial,
            ("evaluation", Some(day)) => Self::Evaluation(day),
            ("day", Some(day)) => Self::Day(day),
            ("rules", Some(day)) => Self::DayWithNewestRules(day),
            _ => return None,
        })
    }
}

/// How a proposal ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProposalOutcome {
    /// Its results count since then.
    Applied(Timestamp),
    /// Its results will never count.
    Dropped(Timestamp),
}

struct ProposalRow {
    id: ProposalId,
    stage: StageId,
    revision: u32,
    kind: String,
    day: Option<Text<Date>>,
    reason: String,
    created_at: Instant,
    settled_at: Option<Instant>,
    outcome: Option<String>,
}

impl TryFrom<ProposalRow> for Proposal {
    type Error = StoreError;
    fn try_from(row: ProposalRow) -> Result<Self> {
        let damaged =
            |problem: &str| StoreError::Damaged(format!("proposal {}: {problem}", row.id));
        let kind = ProposalKind::from_columns(&row.kind, row.day.as_ref().map(|day| day.0));
        let outcome = match (row.outcome.as_deref(), row.settled_at) {
            (None, None) => None,
            (Some("applied"), Some(at)) => Some(ProposalOutcome::Applied(at.0)),
            (Some("dropped"), Some(at)) => Some(ProposalOutcome::Dropped(at.0)),
            _ => return Err(damaged("unknown outcome")),
        };
        Ok(Self {
            id: row.id,
            stage: row.stage,
            revision: row.revision,
            kind: kind.ok_or_else(|| damaged("unknown kind"))?,
            reason: row.reason,
            created_at: row.created_at.0,
            outcome,
        })
    }
}

/// `SELECT` of whole proposals; the argument is the SQL after `FROM proposals`.
macro_rules! select_proposals {
    ($tail:literal $(, $argument:expr)*) => {
        sqlx::query_as!(
            ProposalRow,
            "SELECT id, stage_id AS stage, revision, kind, day, reason, created_at, settled_at, outcome
             FROM proposals " + $tail
            $(, $argument)*
        )
    };
}

/// All proposals of the season, the newest first.
pub(crate) async fn all(connection: &mut SqliteConnection) -> Result<Vec<Proposal>> {
    let rows = select_proposals!("ORDER BY created_at DESC, id DESC");
    let rows = rows.fetch_all(connection).await?;
    rows.into_iter().map(Proposal::try_from).collect()
}

pub(crate) async fn find(connection: &mut SqliteConnection, id: ProposalId) -> Result<Proposal> {
    select_proposals!("WHERE id = ?", id)
        .fetch_optional(connection)
        .await?
        .ok_or(StoreError::NotFound("proposal"))?
        .try_into()
}

pub(crate) async fn insert(connection: &mut SqliteConnection, proposal: &Proposal) -> Result<()> {
    sqlx::query!(
        "INSERT INTO proposals (id, stage_id, revision, kind, day, reason, created_at)
         VALUES (?, ?, ?, ?, ?, ?, ?)",
        proposal.id,
        proposal.stage,
        proposal.revision,
        proposal.kind.stored_name(),
        proposal.kind.day().map(Text),
        proposal.reason,
        Instant(proposal.created_at),
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn set_outcome(
    connection: &mut SqliteConnection,
    id: ProposalId,
    outcome: ProposalOutcome,
) -> Result<()> {
    let (outcome_name, decided_at) = match outcome {
        ProposalOutcome::Applied(at) => ("applied", at),
        ProposalOutcome::Dropped(at) => ("dropped", at),
    };
    sqlx::query!(
        "UPDATE proposals SET outcome = ?, settled_at = ? WHERE id = ?",
        outcome_name,
        Instant(decided_at),
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}
