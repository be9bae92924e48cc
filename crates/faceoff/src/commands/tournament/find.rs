use crate::client::Client;
use anyhow::{Context, bail};
use faceoff_types::TournamentId;

/// The tournament of this name or id.
pub(in crate::commands) async fn find(
    client: &Client,
    wanted: &str,
) -> anyhow::Result<TournamentId> {
    if let Ok(id) = wanted.parse() {
        return Ok(id);
    }
    let tournaments = client.tournaments().await?;
    let named = |name: &str| name.eq_ignore_ascii_case(wanted);
    match tournaments.iter().find(|one| named(one.name.as_str())) {
        Some(found) => Ok(found.id),
        None => bail!("no tournament is named {wanted:?}; faceoff tournament list names them"),
    }
}

/// The tournament of this name or id, or the newest.
pub(in crate::commands) async fn find_or_newest(
    client: &Client,
    wanted: Option<&str>,
) -> anyhow::Result<TournamentId> {
    match wanted {
        Some(wanted) => find(client, wanted).await,
        None => {
            let tournaments = client.tournaments().await?;
            let newest = tournaments.last().map(|tournament| tournament.id);
            newest.context("there is no tournament yet; an organiser opens one: faceoff admin tournament open NAME")
        }
    }
}
