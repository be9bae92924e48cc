//! `faceoff password`: sets the password by which a person signs in.

use super::{output::print, password, people::person_line, server::ServerArgs};
use anyhow::{Context, bail};
use clap::Args;
use faceoff_api::requests::NewPassword;
use std::io::IsTerminal;

/// Sets the password by which you sign in; all your other tokens and sessions are worth nothing from then on. Asks for the old
/// one and the new one; without a terminal they are the lines of standard input, the old one first (empty: there is none).
#[derive(Debug, Args)]
pub struct PasswordCommand {
    #[command(flatten)]
    server: ServerArgs,
}

impl PasswordCommand {
    /// Sets it.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses, or the new one is not typed twice alike.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async {
            let client = self.server.client()?;
            let who = client.whoami().await?;
            let person = who
                .person
                .context("the token is a program's, not a person's; only people have passwords")?;
            let (old, new) = typed()?;
            let wanted = NewPassword {
                old: Some(old).filter(|old| !old.is_empty()),
                password: new,
            };
            let person = client.set_password(person.id, &wanted).await?;
            print(self.server.json, &person, || {
                format!("the password is set\n{}", person_line(&person))
            })
        })
    }
}

/// The old one, and the new one.
fn typed() -> anyhow::Result<(String, String)> {
    if !std::io::stdin().is_terminal() {
        let input = password::from_input()?;
        let lines = input.split_once('\n');
        let (old, new) = lines
            .context("expected two lines: the old password, which may be empty, and the new one")?;
        return Ok((old.trim_end_matches('\r').to_owned(), new.to_owned()));
    }
    let ask = |question: &str| password::ask(question, "");
    let old = ask("old password (none: return): ")?;
    let new = ask("new password: ")?;
    if ask("the new one again: ")? != new {
        bail!("the two are not the same; nothing was changed");
    }
    Ok((old, new))
}
