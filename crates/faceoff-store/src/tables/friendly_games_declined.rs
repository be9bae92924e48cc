//! The teams that decline friendly games requested by other teams.

use crate::error::Result;
use faceoff_types::TeamId;
use sqlx::SqliteConnection;

/// Does the team decline friendly games?
pub(crate) async fn declines(connection: &mut SqliteConnection, team: TeamId) -> Result<bool> {
    Ok(sqlx::query_scalar!(
        r#"SELECT EXISTS (SELECT 1 FROM friendly_games_declined WHERE team_id = ?) AS "declines!: bool""#,
        team
    )
    .fetch_one(connection)
    .await?)
}

pub(crate) async fn set(
    connection: &mut SqliteConnection,
    team: TeamId,
    declines: bool,
) -> Result<()> {
    if declines {
        sqlx::query!(
            "INSERT OR IGNORE INTO friendly_games_declined (team_id) VALUES (?)",
            team
        )
        .execute(connection)
        .await?;
    } else {
        sqlx::query!(
            "DELETE FROM friendly_games_declined WHERE team_id = ?",
            team
        )
        .execute(connection)
        .await?;
    }
    Ok(())
}
