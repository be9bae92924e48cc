//! Sign-offs of stages, after which results are final, and the final days of stages.

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
    pub signed_off_at: Timestamp,
    pub actor: Actor,
    /// The teams that were disqualified at the sign-off. Exactly these are left out of the stage's boards from then on.
    pub disqualified_teams: Vec<TeamId>,
}

impl SignOff {
    /// Reads a sign-off from its columns, which are set together.
    pub(crate) fn from_columns(
        signed_off_at: Option<Instant>,
        actor: Option<Actor>,
        disqualified_teams: Option<Json<Vec<TeamId>>>,
    ) -> Option<Self> {
        Some(Self {
            signed_off_at: signed_off_at?.0,
            actor: actor?,
            disqualified_teams: disqualified_teams?.0,
        })
    }
}

/// Refuses to change a stage that is signed off.
pub(crate) async fn check_not_signed_off(
    connection: &mut SqliteConnection,
    stage: StageId,
) -> Result<()> {
    let sign_off = sqlx::query!(
        r#"SELECT name, finalised_at AS "at!", finalised_by AS "by!: String"
           FROM stages WHERE id = ? AND finalised_at IS NOT NULL"#,
        stage
    )
    .fetch_optional(connection)
    .await?;
    match sign_off {
        None => Ok(()),
        Some(row) => StoreError::conflict(format!(
            "the stage {:?} was signed off on {} by {}: it cannot be changed any more",
            row.name,
            row.at.0.strftime("%Y-%m-%d at %H:%M:%S UTC"),
            row.by
        )),
    }
}

pub(crate) async fn sign_off(
    connection: &mut SqliteConnection,
    stage: StageId,
    actor: &Actor,
    now: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE stages SET finalised_at = ?, finalised_by = ?,
                finalised_without = (SELECT json_group_array(id) FROM teams WHERE disqualified_at IS NOT NULL)
         WHERE id = ?",
        Instant(now),
        actor,
        stage,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Number of a stage's open evaluations.
pub(crate) async fn count_open(connection: &mut SqliteConnection, stage: StageId) -> Result<u32> {
    Ok(sqlx::query_scalar!(
        r#"SELECT COUNT(*) AS "count!: u32" FROM counting_evaluations WHERE stage_id = ? AND state = 'open'"#,
        stage
    )
    .fetch_one(connection)
    .await?)
}

/// Number of a stage's evaluations with a score, including voided ones.
pub(crate) async fn count_scored(connection: &mut SqliteConnection, stage: StageId) -> Result<u32> {
    Ok(sqlx::query_scalar!(
        r#"SELECT COUNT(*) AS "count!: u32" FROM counting_evaluations WHERE stage_id = ? AND state = 'finished'"#,
        stage
    )
    .fetch_one(connection)
    .await?)
}

/// The cutoff of a stage's final day, if it has passed.
pub(crate) async fn final_cutoff(
    connection: &mut SqliteConnection,
    stage: StageId,
) -> Result<Option<Timestamp>> {
    let cutoff_at = sqlx::query_scalar!(
        "SELECT cutoff_at FROM days WHERE stage_id = ? AND is_final = 1",
        stage
    )
    .fetch_optional(connection)
    .await?;
    Ok(cutoff_at.map(|at| at.0))
}

/// Marks a new day as the final day of its stage.
pub(crate) async fn set_final_day(
    connection: &mut SqliteConnection,
    stage_day: StageDay,
) -> Result<()> {
    sqlx::query!(
        "UPDATE days SET is_final = 1 WHERE stage_id = ? AND day = ?",
        stage_day.stage,
        Text(stage_day.date)
    )
    .execute(connection)
    .await?;
    Ok(())
}
