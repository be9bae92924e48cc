//! Stages that are signed off, and the final day that some of them wait for.

use crate::{
    column::{Instant, Json},
    error::{Result, StoreError},
    event::Actor,
};
use faceoff_types::{StageDay, StageId, TeamId};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};

/// The organiser has signed a stage's result off.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finalised {
    pub at: Timestamp,
    pub by: Actor,
    /// The teams that were disqualified then: its boards are without them for good, and with all others.
    pub without: Vec<TeamId>,
}

impl Finalised {
    /// From its columns, which are set together.
    pub(crate) fn of(
        at: Option<Instant>,
        by: Option<Text<Actor>>,
        without: Option<Json<Vec<TeamId>>>,
    ) -> Option<Self> {
        Some(Self {
            at: at?.0,
            by: by?.0,
            without: without?.0,
        })
    }
}

/// Refuses what would change a stage that is signed off.
pub(crate) async fn check_not(connection: &mut SqliteConnection, stage: StageId) -> Result<()> {
    let id = Text(stage);
    let found = sqlx::query!(
        r#"SELECT name, finalised_at AS "at!: Instant", finalised_by AS "by!: String"
           FROM stages WHERE id = ? AND finalised_at IS NOT NULL"#,
        id
    )
    .fetch_optional(connection)
    .await?;
    match found {
        None => Ok(()),
        Some(row) => Err(StoreError::Conflict(format!(
            "the stage {:?} was signed off on {} by {}: nothing of it changes any more",
            row.name,
            row.at.0.strftime("%Y-%m-%d at %H:%M:%S UTC"),
            row.by
        ))),
    }
}

/// Signs a stage off.
pub(crate) async fn set(
    connection: &mut SqliteConnection,
    stage: StageId,
    by: &Actor,
    now: Timestamp,
) -> Result<()> {
    let (id, by, now) = (Text(stage), Text(by), Instant(now));
    sqlx::query!(
        "UPDATE stages SET finalised_at = ?, finalised_by = ?,
                finalised_without = (SELECT json_group_array(id) FROM teams WHERE disqualified_at IS NOT NULL)
         WHERE id = ?",
        now,
        by,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// How many evaluations of a stage are not over.
pub(crate) async fn count_open(connection: &mut SqliteConnection, stage: StageId) -> Result<u32> {
    let id = Text(stage);
    Ok(sqlx::query_scalar!(
        r#"SELECT COUNT(*) AS "count!: u32" FROM evaluations WHERE stage_id = ? AND state = 'open'"#,
        id
    )
    .fetch_one(connection)
    .await?)
}

/// How many evaluations of a stage have a score, voided or not.
pub(crate) async fn count_scored(connection: &mut SqliteConnection, stage: StageId) -> Result<u32> {
    let id = Text(stage);
    Ok(sqlx::query_scalar!(
        r#"SELECT COUNT(*) AS "count!: u32" FROM evaluations WHERE stage_id = ? AND state = 'finished'"#,
        id
    )
    .fetch_one(connection)
    .await?)
}

/// When a stage's final day had its cut, if it had.
pub(crate) async fn final_cut(
    connection: &mut SqliteConnection,
    stage: StageId,
) -> Result<Option<Timestamp>> {
    let id = Text(stage);
    let cut_at = sqlx::query_scalar!(
        r#"SELECT cut_at AS "cut_at: Instant" FROM days WHERE stage_id = ? AND is_final = 1"#,
        id
    )
    .fetch_optional(connection)
    .await?;
    Ok(cut_at.map(|at| at.0))
}

/// A day that has just had its cut is its stage's final one.
pub(crate) async fn set_final_day(connection: &mut SqliteConnection, of: StageDay) -> Result<()> {
    let (stage, day) = (Text(of.stage), Text(of.date));
    sqlx::query!(
        "UPDATE days SET is_final = 1 WHERE stage_id = ? AND day = ?",
        stage,
        day
    )
    .execute(connection)
    .await?;
    Ok(())
}
