//! `faceoff logout`: forgets a token, and revokes it.

use super::output::print;
use crate::{
    client::{ApiError, Client},
    credentials::{self, Credentials},
};
use anyhow::Context;
use clap::Args;
use serde_json::json;

/// Signs out of a server: forgets the token that `faceoff login` has kept, and revokes it if it was made for that.
#[derive(Debug, Args)]
pub struct LogoutCommand {
    /// The server [default: the one that commands go to]
    server: Option<String>,
    /// Revoke the token in any case: also one that you had before, and that may be used elsewhere
    #[arg(long)]
    revoke: bool,
    /// Revoke it in no case, for example because the server is gone
    #[arg(long, conflicts_with = "revoke")]
    keep_token: bool,
    /// Print what was done as JSON
    #[arg(long)]
    json: bool,
}

impl LogoutCommand {
    /// Signs out.
    ///
    /// # Errors
    /// If nobody is signed in, or the token cannot be revoked; it stays then.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(self.sign_out())
    }

    async fn sign_out(self) -> anyhow::Result<()> {
        let file = credentials::path()?;
        let mut kept = Credentials::load(&file)?;
        let named = self.server.or_else(|| std::env::var("FACEOFF_SERVER").ok());
        let server = named.as_deref().or(kept.default_server());
        let server = server.context("nobody is signed in")?.to_owned();
        let login = kept.forget(&server).with_context(|| {
            let others: Vec<_> = kept.servers().collect();
            format!("nobody is signed in to {server}; logins there are: {others:?}")
        })?;
        let mut revoked = false;
        let ends = self.revoke || (login.made_here && !self.keep_token);
        if ends {
            let client = Client::new(&server, Some(&login.token), login.ca_file.as_deref())?;
            revoked = match client.end_token().await {
                Ok(()) => true,
                // It is worth nothing already.
                Err(error) if is_unknown(&error) => false,
                Err(error) => {
                    return Err(error.context(
                        "the token is not revoked, so you are still signed in; faceoff logout --keep-token forgets it all the same",
                    ));
                }
            };
        }
        // Looked at again: another command may have written it meanwhile.
        let mut kept = Credentials::load(&file)?;
        if kept
            .of(&server)
            .is_some_and(|other| other.token == login.token)
        {
            kept.forget(&server);
        }
        kept.save(&file)?;
        let told =
            json!({ "server": server, "token_revoked": revoked, "default": kept.default_server() });
        print(self.json, &told, || {
            let what = match (ends, revoked) {
                (true, true) => "its token is revoked",
                (true, false) => "its token was worth nothing any more",
                (false, _) => "its token is forgotten here, and still good",
            };
            let next = match kept.default_server() {
                Some(next) if next != server => format!("; commands go to {next} now"),
                _ => String::new(),
            };
            format!("signed out of {server}: {what}{next}")
        })
    }
}

fn is_unknown(error: &anyhow::Error) -> bool {
    error
        .downcast_ref::<ApiError>()
        .is_some_and(|error| error.status == reqwest::StatusCode::UNAUTHORIZED)
}
