//! `faceoff join`: follows an invitation.

use super::{output::print, whoami};
use crate::client::Client;
use anyhow::{Context, bail};
use clap::Args;
use faceoff_http::requests::{FoundedTeam, Join};
use faceoff_types::{DivisionName, PersonName, TeamName};
use std::io::Read;

/// Follows an invitation and prints the token that comes of it, this once.
#[derive(Debug, Args)]
pub struct JoinCommand {
    /// The link that you were given, or the code at its end
    link: String,
    /// The server [default: that of the link, or http://127.0.0.1:8080]
    #[arg(long, value_name = "URL", env = "FACEOFF_SERVER")]
    server: Option<String>,
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

impl JoinCommand {
    /// Joins.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        let (of_link, code) = parts(&self.link)?;
        let server = self.server.as_deref().or(of_link);
        let client = Client::new(server.unwrap_or("http://127.0.0.1:8080"), None)?;
        let password = match self.password_stdin {
            true => {
                let mut text = String::new();
                std::io::stdin()
                    .read_to_string(&mut text)
                    .context("reading the password from standard input")?;
                Some(text.trim_end_matches(['\r', '\n']).to_owned())
            }
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
        super::block_on(async {
            let joined = client.join(&join).await?;
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
