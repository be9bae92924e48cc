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
    views::user::CallerView,
};
use faceoff_types::{DivisionName, TeamName, UserName};
use serde::Serialize;
use std::fs;

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
    /// Your name, for signing in and for lists: 1 to 40 letters, digits, spaces and . _ -; not with a link that
    /// restores an account
    #[arg(long)]
    name: Option<UserName>,
    /// Read a password of 12 or more characters from standard input; without a password, you sign in with tokens only
    #[arg(long)]
    password_stdin: bool,
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

/// Splits a link into server and code; accepts a code alone, too.
fn parse_link(link: &str) -> anyhow::Result<(Option<&str>, &str)> {
    let (server, code) = match link.split_once("/join/") {
        Some(("", code)) => (None, code),
        Some((server, code)) => (Some(server), code),
        None => (None, link),
    };
    let code = code.trim().trim_end_matches('/');
    if !code.starts_with("fo_invite_") {
        bail!(
            "expected a link like https://…/join/fo_invite_…, or the code at its end, got {link:?}"
        );
    }
    Ok((server, code))
}

/// Output of `--sign-in --json`: everything but the token.
#[derive(Debug, Serialize)]
struct SignedIn<'a> {
    #[serde(flatten)]
    caller: &'a CallerView,
}

impl JoinCommand {
    /// Accepts the invitation.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        let (link_server, code) = parse_link(&self.link)?;
        // The server in the link has priority over --server and FACEOFF_SERVER.
        let server = link_server.or(self.server.as_deref());
        let server = server.unwrap_or(DEFAULT_SERVER);
        let client = Client::new(server, None, self.ca.path())?;
        let password = match self.password_stdin {
            true => Some(password::read_stdin()?),
            false => None,
        };
        let join = JoinRequest {
            code: code.to_owned(),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn link_and_code_are_both_accepted() {
        let code = "fo_invite_abc";
        assert_eq!(parse_link(code).unwrap(), (None, code));
        assert_eq!(parse_link("/join/fo_invite_abc").unwrap(), (None, code));
        let whole = parse_link("https://faceoff.example.org/join/fo_invite_abc\n").unwrap();
        assert_eq!(whole, (Some("https://faceoff.example.org"), code));
        for wrong in ["", "https://faceoff.example.org/", "fo_team_abc"] {
            assert!(parse_link(wrong).is_err(), "{wrong}");
        }
    }
}
