//! Lookup of a tournament that a command names.

use crate::client::Client;
use anyhow::{Context, bail};
use faceoff_types::TournamentId;

/// Finds a tournament by name or id.
pub(in crate::commands) async fn find_tournament(
    client: &Client,
    name_or_id: &str,
) -> anyhow::Result<TournamentId> {
    if let Ok(id) = name_or_id.parse() {
        return Ok(id);
    }
    let tournaments = client.tournaments().await?;
    let has_name = |name: &str| name.eq_ignore_ascii_case(name_or_id);
    match tournaments
        .iter()
        .find(|tournament| has_name(tournament.name.as_str()))
    {
        Some(found) => Ok(found.id),
        None => bail!("there is no tournament {name_or_id:?}; see faceoff tournament list"),
    }
}

/// Finds a tournament by name or id, or the newest one.
pub(in crate::commands) async fn find_tournament_or_newest(
    client: &Client,
    name_or_id: Option<&str>,
) -> anyhow::Result<TournamentId> {
    match name_or_id {
        Some(name_or_id) => find_tournament(client, name_or_id).await,
        None => {
            let tournaments = client.tournaments().await?;
            let newest = tournaments.last().map(|tournament| tournament.id);
            newest.context("there is no tournament yet; organisers open one with faceoff admin tournament open NAME")
        }
    }
}
