use crate::client::Client;
use anyhow::bail;
use faceoff_types::TeamId;

/// The team of this name or id.
pub(super) async fn find_team(client: &Client, wanted: &str) -> anyhow::Result<TeamId> {
    if let Ok(id) = wanted.parse() {
        return Ok(id);
    }
    let teams = client.teams().await?;
    match teams.iter().find(|team| team.name.as_str() == wanted) {
        Some(team) => Ok(team.id),
        None => bail!("no team is named {wanted:?}; faceoff admin teams lists them"),
    }
}
