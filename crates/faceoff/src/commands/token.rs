//! `faceoff token`: makes, lists, rotates and revokes tokens.

use super::{
    output::{or_none, print},
    server::ServerArgs,
};
use crate::client::Client;
use anyhow::Context;
use clap::{Args, Subcommand};
use faceoff_api::{requests::NewToken, views::token::TokenView};
use faceoff_types::{TeamId, TokenId};
use jiff::{SignedDuration, Timestamp};

/// Makes, lists, rotates and revokes tokens.
#[derive(Debug, Args)]
pub struct TokenCommand {
    #[command(flatten)]
    server: ServerArgs,
    #[command(subcommand)]
    action: TokenAction,
}

/// What can be done with tokens.
#[derive(Debug, Subcommand)]
pub(super) enum TokenAction {
    /// List tokens and sessions, the newest first
    List,
    /// Make a token and print it, this once
    Create {
        /// What it is for, e.g. laptop
        name: String,
        /// Days after which it is worth nothing; left out, it has no end
        #[arg(long, value_name = "DAYS", value_parser = clap::value_parser!(u16).range(1..))]
        days: Option<u16>,
        /// For the programs of the team with this id, not for you
        #[arg(long, value_name = "ID")]
        team: Option<TeamId>,
    },
    /// Give a token another secret and print it, this once; the old one is worth nothing from then on
    Rotate {
        /// The token's id
        #[arg(id = "id", value_name = "ID")]
        token: TokenId,
    },
    /// End a token or a session at once
    Revoke {
        /// The token's id
        #[arg(id = "id", value_name = "ID")]
        token: TokenId,
    },
}

impl TokenCommand {
    /// Does what was asked.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async { act(&self.server.client()?, self.server.json, self.action).await })
    }
}

/// Does it, as whoever the client is.
pub(super) async fn act(client: &Client, json: bool, action: TokenAction) -> anyhow::Result<()> {
    match action {
        TokenAction::List => {
            let tokens = client.tokens().await?;
            print(json, &tokens, || {
                let now = Timestamp::now();
                let lines = tokens.iter().map(|token| line(token, now)).collect();
                or_none(lines, "no token yet: faceoff token create NAME")
            })
        }
        TokenAction::Create { name, days, team } => {
            let end = |days: u16| {
                let days = SignedDuration::from_hours(24 * i64::from(days));
                Timestamp::now().checked_add(days)
            };
            let new = NewToken {
                name,
                expires_at: days.map(end).transpose().context("days")?,
                team,
            };
            let made = client.create_token(&new).await?;
            print(json, &made, || {
                format!(
                    "token {} ({})\n{}\nIt is not shown again.",
                    made.token.name, made.token.id, made.secret
                )
            })
        }
        TokenAction::Rotate { token } => {
            let made = client.rotate_token(token).await?;
            print(json, &made, || {
                format!(
                    "token {} ({})\n{}\nIt is not shown again; what it was before is worth nothing from now on.",
                    made.token.name, made.token.id, made.secret
                )
            })
        }
        TokenAction::Revoke { token } => {
            let revoked = client.revoke_token(token).await?;
            print(json, &revoked, || line(&revoked, Timestamp::now()))
        }
    }
}

fn line(token: &TokenView, now: Timestamp) -> String {
    let shown = |at: Timestamp| at.strftime("%Y-%m-%d %H:%M UTC").to_string();
    let state = match (token.revoked_at, token.expires_at) {
        (Some(at), _) => format!("revoked {}", shown(at)),
        (None, Some(at)) if at <= now => format!("expired {}", shown(at)),
        (None, Some(at)) => format!("good until {}", shown(at)),
        (None, None) => "good".to_owned(),
    };
    let owner = match (token.team, token.person) {
        (Some(id), _) => format!("team:{id}"),
        (None, Some(id)) => format!("person:{id}"),
        (None, None) => "host".to_owned(),
    };
    let used = token.last_used_at.map_or_else(
        || "never used".to_owned(),
        |at| format!("used {}", shown(at)),
    );
    format!(
        "{}  {:<20} {:<7} {owner}  made {}  {used}  {state}",
        token.id,
        token.name,
        token.kind,
        shown(token.created_at)
    )
}
