//! `faceoff join`: accepts an invitation.

use super::{ca_file::CaFile, output::print, password, server::DEFAULT_SERVER, whoami};
use crate::{
    client::Client,
    credentials::{self, Credentials, Login},
};
use anyhow::{Context, bail};
use clap::Args;
use faceoff_api::{
    requests::{FoundedTeam, JoinRequest},
    secret_extraction::InvitationLink,
    views::user::CallerView,
};
use faceoff_types::{DivisionName, TeamName, UserName};
use serde::Serialize;
use std::{fs, io::IsTerminal};

/// Accepts an invitation and prints the new token, which is shown only once; with --sign-in, stores the token like
/// faceoff login.
#[derive(Debug, Args)]
pub struct JoinCommand {
    /// The invitation link, or the code at its end
    link: String,
    /// The server [default: the link's, or http://127.0.0.1:8080]
    #[arg(long, value_name = "URL", env = "FACEOFF_SERVER")]
    server: Option<String>,
    #[command(flatten)]
    ca: CaFile,
    /// Your name, for signing in and for lists: 1 to 40 letters and digits of any script, spaces and . _ - ' & + ·; not with a link that
    /// restores an account
    #[arg(long)]
    name: Option<UserName>,
    /// Read a password of 12 or more characters from standard input instead of prompting at the terminal; without a
    /// password, you sign in with tokens only
    #[arg(long)]
    password_stdin: bool,
    /// Set no password and do not prompt for one
    #[arg(long, conflicts_with = "password_stdin")]
    no_password: bool,
    /// The version of the terms that you accept, if the season has terms
    #[arg(long, value_name = "VERSION")]
    accept_terms: Option<u32>,
    /// The name of your new team, if the link is for a new team
    #[arg(long, value_name = "NAME")]
    team: Option<TeamName>,
    /// The team's affiliation
    #[arg(long, requires = "team")]
    affiliation: Option<String>,
    /// The team's web page
    #[arg(long, requires = "team", value_name = "URL")]
    team_link: Option<String>,
    /// The team's division
    #[arg(long, requires = "team")]
    division: Option<DivisionName>,
    /// Sign in: store the token for later commands, like faceoff login, instead of printing it
    #[arg(long)]
    sign_in: bool,
    /// Print the server's response as JSON
    #[arg(long)]
    json: bool,
}

/// Output of `--sign-in --json`: everything but the token.
#[derive(Debug, Serialize)]
struct SignedIn<'a> {
    #[serde(flatten)]
    caller: &'a CallerView,
}

/// Prompts for a new password; `None` if the user enters none.
fn prompt_password() -> anyhow::Result<Option<String>> {
    let question = "password, 12 or more characters (empty: sign in with tokens only): ";
    let password = password::prompt(question, "")?;
    if password.is_empty() {
        return Ok(None);
    }
    if password::prompt("repeat the password: ", "")? != password {
        bail!("the passwords differ; the invitation can still be used");
    }
    Ok(Some(password))
}

impl JoinCommand {
    /// Accepts the invitation.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        let link = InvitationLink::find(&self.link).with_context(|| {
            format!(
                "expected a link like https://…/join/fo_invite_…, or the code at its end, got {:?}",
                self.link
            )
        })?;
        // The server in the link has priority over --server and FACEOFF_SERVER.
        let server = link.server.as_deref().or(self.server.as_deref());
        let server = server.unwrap_or(DEFAULT_SERVER);
        let client = Client::new(server, None, self.ca.path())?;
        let password = if self.password_stdin {
            Some(password::read_stdin()?)
        } else if self.no_password || !std::io::stdin().is_terminal() {
            None
        } else {
            prompt_password()?
        };
        let join = JoinRequest {
            code: link.code.clone(),
            name: self.name,
            password,
            team: self.team.map(|name| FoundedTeam {
                name,
                affiliation: self.affiliation,
                link: self.team_link,
                division: self.division,
            }),
            accepted_terms: self.accept_terms,
        };
        // An invitation can be used only once, so an unreadable file of credentials must be noticed first.
        let credentials = match self.sign_in {
            true => {
                let file = credentials::path()?;
                Some((Credentials::load(&file)?, file))
            }
            false => None,
        };
        let ca_file = self.ca.path().map(fs::canonicalize).transpose();
        let ca_file = ca_file.context("looking for the file of --ca-file")?;
        super::block_on(async {
            let joined = client.join(&join).await?;
            if let Some((_, file)) = credentials {
                // Loaded again, because another command may have changed the file meanwhile.
                let mut credentials = Credentials::load(&file).inspect_err(|_| {
                    // The server does not show the token again.
                    println!("token {}", joined.secret);
                })?;
                let login = Login {
                    token: joined.secret.clone(),
                    created_by_login: true,
                    ca_file,
                };
                credentials.add(server, login, true);
                if let Err(error) = credentials.save(&file) {
                    // The server does not show the token again.
                    println!("token {}", joined.secret);
                    return Err(error);
                }
                let view = SignedIn {
                    caller: &joined.caller,
                };
                return print(self.json, &view, |_| {
                    let caller = whoami::whoami_text(&joined.caller);
                    format!(
                        "{caller}\nsigned in to {server}, token stored in {}",
                        file.display()
                    )
                });
            }
            print(self.json, &joined, |joined| {
                format!(
                    "{}\ntoken {}\nThe token is not shown again. Commands read it from FACEOFF_TOKEN.",
                    whoami::whoami_text(&joined.caller),
                    joined.secret
                )
            })
        })
    }
}
