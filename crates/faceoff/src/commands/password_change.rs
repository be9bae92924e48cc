//! `faceoff password`: sets the user's password.

use super::{output::print, password, people::changed_access_text, server::ServerArgs};
use anyhow::{Context, bail};
use clap::Args;
use faceoff_api::requests::NewPassword;
use std::io::IsTerminal;

/// Sets your password and revokes all your other tokens and sessions. If you had a password before, the team tokens, invitations and
/// webhooks that you have made end, too, and are printed. Prompts for the old and the new password; without a terminal, reads them as two
/// lines of standard input, the old one first (empty if there is none).
#[derive(Debug, Args)]
pub struct PasswordCommand {
    #[command(flatten)]
    server: ServerArgs,
}

impl PasswordCommand {
    /// Sets the password.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses, or the repeated new password differs.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async {
            let client = self.server.client()?;
            let caller = client.whoami().await?;
            let person = caller
                .person
                .context("the token does not belong to a user; only users have passwords")?;
            let (old, new) = read_passwords()?;
            let change = NewPassword {
                old: Some(old).filter(|old| !old.is_empty()),
                password: new,
            };
            let person = client.set_password(person.id, &change).await?;
            print(self.server.json, &person, |person| {
                format!("password set\n{}", changed_access_text(person))
            })
        })
    }
}

/// The old and the new password.
fn read_passwords() -> anyhow::Result<(String, String)> {
    if !std::io::stdin().is_terminal() {
        let input = password::read_stdin()?;
        let lines = input.split_once('\n');
        let (old, new) = lines
            .context("expected two lines: the old password, which may be empty, and the new one")?;
        return Ok((old.trim_end_matches('\r').to_owned(), new.to_owned()));
    }
    let prompt = |question: &str| password::prompt(question, "");
    let old = prompt("old password (empty if none): ")?;
    let new = prompt("new password: ")?;
    if prompt("repeat the new password: ")? != new {
        bail!("the new passwords differ; nothing was changed");
    }
    Ok((old, new))
}
