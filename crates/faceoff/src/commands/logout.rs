//! `faceoff logout`: deletes the stored token and revokes it.

use super::output::print;
use crate::{
    client::{Client, is_refused_with},
    credentials::{self, Credentials},
};
use anyhow::Context;
use clap::Args;
use reqwest::StatusCode;
use serde_json::json;

/// Signs out of a server: deletes the token that `faceoff login` has stored, and revokes it if `login` has created it.
#[derive(Debug, Args)]
pub struct LogoutCommand {
    /// The server [default: the default server of commands]
    server: Option<String>,
    /// Always revoke the token, even one that existed before and may be used elsewhere
    #[arg(long)]
    revoke: bool,
    /// Never revoke the token, for example because the server no longer exists
    #[arg(long, conflicts_with = "revoke")]
    keep_token: bool,
    /// Print a summary as JSON
    #[arg(long)]
    json: bool,
}

impl LogoutCommand {
    /// Signs out.
    ///
    /// # Errors
    /// If there is no login, or the token cannot be revoked; the login stays then.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(self.sign_out())
    }

    async fn sign_out(self) -> anyhow::Result<()> {
        let file = credentials::path()?;
        let mut credentials = Credentials::load(&file)?;
        let named_server = self.server.or_else(|| std::env::var("FACEOFF_SERVER").ok());
        let server = named_server.as_deref().or(credentials.default_server());
        let server = server.context("not signed in")?.to_owned();
        let login = credentials.remove(&server).with_context(|| {
            let others: Vec<_> = credentials.servers().collect();
            format!("not signed in to {server}; there are logins to {others:?}")
        })?;
        let mut revoked = false;
        let should_revoke = self.revoke || (login.created_by_login && !self.keep_token);
        if should_revoke {
            let client = Client::new(&server, Some(&login.token), login.ca_file.as_deref())?;
            revoked = match client.revoke_own_token().await {
                Ok(()) => true,
                // The token is already invalid.
                Err(error) if is_refused_with(&error, StatusCode::UNAUTHORIZED) => false,
                Err(error) => {
                    return Err(error.context(
                        "the token was not revoked, so you are still signed in; faceoff logout --keep-token signs out without revoking it",
                    ));
                }
            };
        }
        // Loaded again, because another command may have changed the file meanwhile.
        let mut credentials = Credentials::load(&file)?;
        if credentials
            .login(&server)
            .is_some_and(|other| other.token == login.token)
        {
            credentials.remove(&server);
        }
        credentials.save(&file)?;
        let summary = json!({ "server": server, "token_revoked": revoked, "default": credentials.default_server() });
        print(self.json, &summary, |_| {
            let outcome = match (should_revoke, revoked) {
                (true, true) => "the token is revoked",
                (true, false) => "the token was already invalid",
                (false, _) => "the token is deleted here, but still valid",
            };
            let next = match credentials.default_server() {
                Some(next) if next != server => format!("; the default server is now {next}"),
                _ => String::new(),
            };
            format!("signed out of {server}: {outcome}{next}")
        })
    }
}
