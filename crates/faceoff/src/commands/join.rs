//! `faceoff join`: follows an invitation.

use super::{ca_file::CaFile, output::print, password, server::HERE, whoami};
use crate::{
    client::Client,
    credentials::{self, Credentials, Login},
};
use anyhow::{Context, bail};
use clap::Args;
use faceoff_api::{
    requests::{FoundedTeam, Join},
    views::person::WhoView,
};
use faceoff_types::{DivisionName, PersonName, TeamName};
use serde::Serialize;
use std::fs;

/// Follows an invitation and prints the token that comes of it, this once; with --sign-in keeps it, as faceoff login does.
#[derive(Debug, Args)]
pub struct JoinCommand {
    /// The link that you were given, or the code at its end
    link: String,
    /// The server [default: that of the link, or http://127.0.0.1:8080]
    #[arg(long, value_name = "URL", env = "FACEOFF_SERVER")]
    server: Option<String>,
    #[command(flatten)]
    ca: CaFile,
    /// By which you are known and sign in: 1 to 40 letters, digits, spaces and . _ -; not of who comes back
    #[arg(long)]
    name: Option<PersonName>,
    /// Read a password of 12 or more characters from standard input; without it you call by tokens only
    #[arg(long)]
    password_stdin: bool,
    /// The version of the terms that you accept, if there are terms
    #[arg(long, value_name = "VERSION")]
    accept_terms: Option<u32>,
    /// The team that you found, if the link is a founder's
    #[arg(long, value_name = "NAME")]
    team: Option<TeamName>,
    /// Where that team is from
    #[arg(long, requires = "team")]
    affiliation: Option<String>,
    /// Its page
    #[arg(long, requires = "team", value_name = "URL")]
    team_link: Option<String>,
    /// The division that it is in
    #[arg(long, requires = "team")]
    division: Option<DivisionName>,
    /// Sign in: keep the token as faceoff login does, for the commands to come, and do not print it
    #[arg(long)]
    sign_in: bool,
    /// Print the server's answer as JSON
    #[arg(long)]
    json: bool,
}

/// Server and code of a link, or the code alone.
fn parts(link: &str) -> anyhow::Result<(Option<&str>, &str)> {
    let (server, code) = match link.split_once("/join/") {
        Some(("", code)) => (None, code),
        Some((server, code)) => (Some(server), code),
        None => (None, link),
    };
    let code = code.trim().trim_end_matches('/');
    if !code.starts_with("fo_invite_") {
        bail!(
            "expected a link like https://…/join/fo_invite_…, or what stands at its end, got {link:?}"
        );
    }
    Ok((server, code))
}

/// What is printed of who has signed in: all but the token.
#[derive(Debug, Serialize)]
struct SignedIn<'a> {
    #[serde(flatten)]
    who: &'a WhoView,
}

impl JoinCommand {
    /// Joins.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        let (of_link, code) = parts(&self.link)?;
        // A link goes to the server that it names, whatever others commands go to.
        let server = of_link.or(self.server.as_deref());
        let server = server.unwrap_or(HERE);
        let client = Client::new(server, None, self.ca.path())?;
        let password = match self.password_stdin {
            true => Some(password::from_input()?),
            false => None,
        };
        let join = Join {
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
        // An invitation is good once: what cannot keep the token is found out before.
        let kept = match self.sign_in {
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
            if let Some((_, file)) = kept {
                // Looked at again: another command may have written it meanwhile.
                let mut kept = Credentials::load(&file).inspect_err(|_| {
                    // It comes this once.
                    println!("token {}", joined.secret);
                })?;
                let login = Login {
                    token: joined.secret.clone(),
                    made_here: true,
                    ca_file,
                };
                kept.keep(server, login, true);
                if let Err(error) = kept.save(&file) {
                    // It comes this once.
                    println!("token {}", joined.secret);
                    return Err(error);
                }
                let told = SignedIn { who: &joined.who };
                return print(self.json, &told, || {
                    let who = whoami::text(&joined.who);
                    format!("{who}\nsigned in to {server}, kept in {}", file.display())
                });
            }
            print(self.json, &joined, || {
                format!(
                    "{}\ntoken {}\nIt is not shown again. Commands take it from FACEOFF_TOKEN.",
                    whoami::text(&joined.who),
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
    fn a_link_and_its_code_are_both_taken() {
        let code = "fo_invite_abc";
        assert_eq!(parts(code).unwrap(), (None, code));
        assert_eq!(parts("/join/fo_invite_abc").unwrap(), (None, code));
        let whole = parts("https://faceoff.example.org/join/fo_invite_abc\n").unwrap();
        assert_eq!(whole, (Some("https://faceoff.example.org"), code));
        for wrong in ["", "https://faceoff.example.org/", "fo_team_abc"] {
            assert!(parts(wrong).is_err(), "{wrong}");
        }
    }
}
