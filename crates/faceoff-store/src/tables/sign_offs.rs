//! Sign-offs of stages, and their final days.

use crate::{
    column::{Instant, Json},
    error::{Result, StoreError},
    event::Actor,
};
use faceoff_types::{StageDay, StageId, TeamId};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};

/// An organiser's sign-off of a stage's result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SignOff {
    pub at: Timestamp,
    pub by: Actor,
    /// The teams that were disqualified at the sign-off: exactly these are left out of its boards from then on.
    pub without: Vec<TeamId>,
}

impl SignOff {
    /// Reads it from its columns, which are set together.
    pub(crate) fn from_columns(
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

/// Refuses to change a stage that is signed off.
pub(crate) async fn check_not_signed_off(
    connection: &mut SqliteConnection,
    stage: StageId,
) -> Result<()> {
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
            "the stage {:?} was signed off on {} by {}: it cannot be changed any more",
            row.name,
            row.at.0.strftime("%Y-%m-%d at %H:%M:%S UTC"),
            row.by
        ))),
    }
}

pub(crate) async fn sign_off(
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

/// Number of a stage's open evaluations.
pub(crate) async fn count_open(connection: &mut SqliteConnection, stage: StageId) -> Result<u32> {
    let id = Text(stage);
    Ok(sqlx::query_scalar!(
        r#"SELECT COUNT(*) AS "count!: u32" FROM evaluations WHERE stage_id = ? AND state = 'open'"#,
        id
    )
    .fetch_one(connection)
    .await?)
}

/// Number of a stage's evaluations with a score, including voided ones.
pub(crate) async fn count_scored(connection: &mut SqliteConnection, stage: StageId) -> Result<u32> {
    let id = Text(stage);
    Ok(sqlx::query_scalar!(
        r#"SELECT COUNT(*) AS "count!: u32" FROM evaluations WHERE stage_id = ? AND state = 'finished'"#,
        id
    )
    .fetch_one(connection)
    .await?)
}

/// The cutoff of a stage's final day, if it has passed.
pub(crate) async fn final_cutoff(
    connection: &mut SqliteConnection,
    stage: StageId,
) -> Result<Option<Timestamp>> {
    let id = Text(stage);
    let cutoff_at = sqlx::query_scalar!(
        r#"SELECT cutoff_at AS "cutoff_at: Instant" FROM days WHERE stage_id = ? AND is_final = 1"#,
        id
    )
    .fetch_optional(connection)
    .await?;
    Ok(cutoff_at.map(|at| at.0))
}

/// Marks a new day as its stage's final one.
pub(crate) async fn set_final_day(
    connection: &mut SqliteConnection,
    stage_day: StageDay,
) -> Result<()> {
    let (stage, day) = (Text(stage_day.stage), Text(stage_day.date));
    sqlx::query!(
        "UPDATE days SET is_final = 1 WHERE stage_id = ? AND day = ?",
        stage,
        day
    )
    .execute(connection)
    .await?;
    Ok(())
}
