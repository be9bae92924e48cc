//! `faceoff login`: keeps a token for the commands to come.

use super::{ca_file::CaFile, output::print, password, server::HERE, whoami};
use crate::{
    client::Client,
    credentials::{self, Credentials, Login},
};
use anyhow::{Context, ensure};
use clap::Args;
use faceoff_api::{requests::NewToken, views::person::WhoView};
use serde::Serialize;
use std::{
    fs,
    path::{Path, PathBuf},
};

/// Signs in to a server, so that later commands need neither --server nor --token: by a token that you have, or by name
/// and password, for which a token of this machine's is made. It is kept in `$XDG_CONFIG_HOME/faceoff/credentials.toml`
/// (`~/.config/faceoff/credentials.toml`), which you alone can read, and never shown.
#[derive(Debug, Args)]
pub struct LoginCommand {
    /// The server [default: FACEOFF_SERVER, the one of the last login, or http://127.0.0.1:8080]
    server: Option<String>,
    /// Your name: sign in by it and your password, and not by a token
    #[arg(long)]
    name: Option<String>,
    /// Read the password from standard input, and do not ask for it
    #[arg(long, requires = "name")]
    password_stdin: bool,
    /// Read the token from standard input, and do not ask for it
    #[arg(long, conflicts_with = "name")]
    token_stdin: bool,
    /// Do not make it the server of commands that name none, if another one is
    #[arg(long)]
    not_default: bool,
    #[command(flatten)]
    ca: CaFile,
    /// Print who you are as JSON
    #[arg(long)]
    json: bool,
}

/// What is printed with `--json`.
#[derive(Debug, Serialize)]
struct LoggedIn<'a> {
    server: &'a str,
    /// Do commands go there that name none?
    default: bool,
    file: &'a Path,
    #[serde(flatten)]
    who: &'a WhoView,
}

impl LoginCommand {
    /// Signs in and keeps the token.
    ///
    /// # Errors
    /// If the server cannot be reached or does not know who that is; nothing is kept then.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(self.sign_in())
    }

    async fn sign_in(self) -> anyhow::Result<()> {
        let file = credentials::path()?;
        let kept = Credentials::load(&file)?;
        let named = self.server.or_else(|| std::env::var("FACEOFF_SERVER").ok());
        let server = named.as_deref().or(kept.default_server()).unwrap_or(HERE);
        // It is used from any folder later on.
        let ca_file: Option<PathBuf> = match self.ca.path() {
            Some(path) => Some(
                fs::canonicalize(path)
                    .with_context(|| format!("looking for {}", path.display()))?,
            ),
            None => kept.of(server).and_then(|login| login.ca_file.clone()),
        };
        let client = Client::new(server, None, ca_file.as_deref())?;
        let made_here = self.name.is_some();
        let token = match self.name {
            Some(name) => {
                let password = if self.password_stdin {
                    password::from_input()?
                } else {
                    password::ask(
                        "password: ",
                        "give --password-stdin and the password as its input",
                    )?
                };
                by_password(&client, &name, &password).await?
            }
            None if self.token_stdin => password::from_input()?.trim().to_owned(),
            None => password::ask(
                "token (or sign in by --name NAME): ",
                "give --token-stdin and the token as its input, or --name NAME --password-stdin",
            )?
            .trim()
            .to_owned(),
        };
        ensure!(
            !token.is_empty(),
            "expected a token, which begins with fo_; who has none joins by an invitation (faceoff join LINK), or gives --name"
        );
        let who = client.with_token(&token).whoami().await?;
        let login = Login {
            token,
            made_here,
            ca_file,
        };
        // Looked at again: it may have taken a while to type.
        let mut kept = Credentials::load(&file)?;
        let replaced = kept.of(server).filter(|old| old.made_here).cloned();
        // The same token given again is still the one that was made here.
        let is_same = replaced
            .as_ref()
            .is_some_and(|old| old.token == login.token);
        let login = Login {
            made_here: login.made_here || is_same,
            ..login
        };
        kept.keep(server, login, !self.not_default);
        kept.save(&file)?;
        if let Some(old) = replaced.filter(|_| !is_same) {
            // Nobody else has it. One that is worth nothing already is as good as revoked.
            let _ = client.with_token(&old.token).end_token().await;
        }
        let told = LoggedIn {
            server,
            default: kept.is_default(server),
            file: &file,
            who: &who,
        };
        print(self.json, &told, || {
            let mut text = format!(
                "{}\nsigned in to {server}, kept in {}",
                whoami::text(&who),
                file.display()
            );
            if !told.default {
                text.push_str(&format!("; commands go there by --server {server}"));
            }
            text
        })
    }
}

/// A token of this machine's, made by a session that ends with it.
async fn by_password(client: &Client, name: &str, password: &str) -> anyhow::Result<String> {
    // So that it can be told from others in a list of tokens; Linux has the file.
    let host = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let host: String = host.trim().chars().take(20).collect();
    let new = NewToken {
        name: format!("faceoff login, {host}"),
        expires_at: None,
        team: None,
    };
    client.token_by_password(name, password, &new).await
}
