//! Lookup of a team that a command names.

use crate::client::Client;
use anyhow::bail;
use faceoff_types::TeamId;

/// Finds a team by name or id.
pub(super) async fn find_team(client: &Client, name_or_id: &str) -> anyhow::Result<TeamId> {
    if let Ok(id) = name_or_id.parse() {
        return Ok(id);
    }
    let teams = client.teams().await?;
    match teams.iter().find(|team| team.name.as_str() == name_or_id) {
        Some(team) => Ok(team.id),
        None => bail!("there is no team {name_or_id:?}; see faceoff admin teams"),
    }
}
