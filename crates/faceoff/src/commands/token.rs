//! `faceoff token`: creates, lists, rotates and revokes tokens.

use super::{
    output::{print, print_list, time_text},
    people::ended_text,
    server::ServerArgs,
};
use crate::client::Client;
use anyhow::Context;
use clap::{Args, Subcommand};
use faceoff_api::{
    requests::{CreatedCredentials, NewToken},
    views::token::TokenView,
};
use faceoff_types::{TeamId, TokenId};
use jiff::{SignedDuration, Timestamp};

/// Creates, lists, rotates and revokes tokens.
#[derive(Debug, Args)]
pub struct TokenCommand {
    #[command(flatten)]
    server: ServerArgs,
    #[command(subcommand)]
    action: TokenAction,
}

#[derive(Debug, Subcommand)]
pub(super) enum TokenAction {
    /// List tokens and sessions, the newest first
    List,
    /// Create a token and print it; it is shown only once
    Create {
        /// Name of the token, e.g. laptop
        name: String,
        /// Days until the token expires [default: never]
        #[arg(long, value_name = "DAYS", value_parser = clap::value_parser!(u16).range(1..))]
        days: Option<u16>,
        /// Create a token for API clients of the team with this id instead of your own account
        #[arg(long, value_name = "ID")]
        team: Option<TeamId>,
    },
    /// Replace the secret of a token and print the new one, which is shown only once; the old one becomes invalid
    Rotate {
        /// The token's id
        #[arg(id = "id", value_name = "ID")]
        token: TokenId,
    },
    /// Revoke a token or end a session. The tokens, invitations and webhooks that were made with it end, too, unless it is one of
    /// your own
    Revoke {
        /// The token's id
        #[arg(id = "id", value_name = "ID")]
        token: TokenId,
        /// Keep the tokens, invitations and webhooks that were made with the token
        #[arg(long)]
        keep_made: bool,
        /// End the tokens, invitations and webhooks that were made with the token, even if the token is one of your own
        #[arg(long, conflicts_with = "keep_made")]
        end_made: bool,
    },
}

impl TokenCommand {
    /// Runs the chosen action.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async {
            run_action(&self.server.client()?, self.server.json, self.action).await
        })
    }
}

/// Runs an action with the client's token.
pub(super) async fn run_action(
    client: &Client,
    json: bool,
    action: TokenAction,
) -> anyhow::Result<()> {
    match action {
        TokenAction::List => {
            let tokens = client.tokens().await?;
            let now = Timestamp::now();
            print_list(
                json,
                &tokens,
                |token| token_line(token, now),
                "no tokens yet; create one with faceoff token create NAME",
            )
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
            let created = client.create_token(&new).await?;
            print(json, &created, |created| {
                format!(
                    "token {} ({})\n{}\nThe token is not shown again.",
                    created.token.name, created.token.id, created.secret
                )
            })
        }
        TokenAction::Rotate { token } => {
            let rotated = client.rotate_token(token).await?;
            print(json, &rotated, |rotated| {
                format!(
                    "token {} ({})\n{}\nThe token is not shown again. The old one is invalid.",
                    rotated.token.name, rotated.token.id, rotated.secret
                )
            })
        }
        TokenAction::Revoke {
            token,
            keep_made,
            end_made,
        } => {
            // `None`: the server decides by the token's owner.
            let made = match (keep_made, end_made) {
                (true, _) => Some(CreatedCredentials::Keep),
                (false, true) => Some(CreatedCredentials::End),
                (false, false) => None,
            };
            let revoked = client.revoke_token(token, made).await?;
            print(json, &revoked, |revoked| {
                token_line(&revoked.token, Timestamp::now()) + &ended_text(revoked.ended.as_ref())
            })
        }
    }
}

fn token_line(token: &TokenView, now: Timestamp) -> String {
    let state = match (token.revoked_at, token.expires_at) {
        (Some(revoked_at), _) => format!("revoked {}", time_text(revoked_at)),
        (None, Some(expires_at)) if expires_at <= now => {
            format!("expired {}", time_text(expires_at))
        }
        (None, Some(expires_at)) => format!("valid until {}", time_text(expires_at)),
        (None, None) => "valid".to_owned(),
    };
    let owner = match (token.team, token.person) {
        (Some(id), _) => format!("team:{id}"),
        (None, Some(id)) => format!("person:{id}"),
        // The operator's token: the operator has access to the server's data folder.
        (None, None) => "host".to_owned(),
    };
    let last_use = token.last_used_at.map_or_else(
        || "never used".to_owned(),
        |time| format!("used {}", time_text(time)),
    );
    format!(
        "{}  {:<20} {:<7} {owner}  created {}  {last_use}  {state}",
        token.id,
        token.name,
        token.kind,
        time_text(token.created_at)
    )
}
