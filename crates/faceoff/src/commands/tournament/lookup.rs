//! Lookup of a tournament that a command names.

use crate::client::Client;
use anyhow::{Context, bail};
use clap::Args;
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

/// The tournament of a command that shows the newest one by default.
#[derive(Debug, Args)]
pub(in crate::commands) struct TournamentOrNewest {
    /// The tournament's name or id [default: the newest]
    tournament: Option<String>,
}

impl TournamentOrNewest {
    /// Finds the tournament.
    pub(in crate::commands) async fn find(&self, client: &Client) -> anyhow::Result<TournamentId> {
        if let Some(name_or_id) = &self.tournament {
            return find_tournament(client, name_or_id).await;
        }
        let tournaments = client.tournaments().await?;
        let newest = tournaments.last().map(|tournament| tournament.id);
        newest.context("there is no tournament yet; organisers open one with faceoff admin tournament open NAME")
    }
}
