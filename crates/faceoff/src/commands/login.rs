//! `faceoff login`: stores a token for later commands.

use super::{ca_file::CaFile, output::print, password, server::DEFAULT_SERVER, whoami};
use crate::{
    client::Client,
    credentials::{self, Credentials, Login},
};
use anyhow::{Context, ensure};
use clap::Args;
use faceoff_api::{requests::NewToken, secret_extraction::extract_secret, views::user::CallerView};
use serde::Serialize;
use std::{
    fs,
    path::{Path, PathBuf},
};

/// Signs in to a server, so that later commands need neither --server nor --token: with an existing token, or with
/// name and password, which creates a token for this machine. The token is stored in
/// `$XDG_CONFIG_HOME/faceoff/credentials.toml` (`~/.config/faceoff/credentials.toml`), which only you can read, and
/// is never shown.
#[derive(Debug, Args)]
pub struct LoginCommand {
    /// The server [default: FACEOFF_SERVER, the server of the last login, or http://127.0.0.1:8080]
    server: Option<String>,
    /// Your name, to sign in with name and password instead of a token
    #[arg(long)]
    name: Option<String>,
    /// Read the password from standard input instead of prompting
    #[arg(long, requires = "name")]
    password_stdin: bool,
    /// Read the token from standard input instead of prompting
    #[arg(long, conflicts_with = "name")]
    token_stdin: bool,
    /// Do not make this the default server, if there is another one
    #[arg(long)]
    not_default: bool,
    #[command(flatten)]
    ca: CaFile,
    /// Print your account as JSON
    #[arg(long)]
    json: bool,
}

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct LoggedIn<'a> {
    server: &'a str,
    /// This is the server of commands without `--server`.
    default: bool,
    file: &'a Path,
    #[serde(flatten)]
    caller: &'a CallerView,
}

impl LoginCommand {
    /// Signs in and stores the token.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses the token or password. Nothing is stored then.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(self.sign_in())
    }

    async fn sign_in(self) -> anyhow::Result<()> {
        let file = credentials::path()?;
        let credentials = Credentials::load(&file)?;
        let named_server = self.server.or_else(|| std::env::var("FACEOFF_SERVER").ok());
        let server = named_server
            .as_deref()
            .or(credentials.default_server())
            .unwrap_or(DEFAULT_SERVER);
        // Later commands may run in other folders.
        let ca_file: Option<PathBuf> = match self.ca.path() {
            Some(path) => Some(
                fs::canonicalize(path)
                    .with_context(|| format!("looking for {}", path.display()))?,
            ),
            None => credentials
                .login(server)
                .and_then(|login| login.ca_file.clone()),
        };
        let client = Client::new(server, None, ca_file.as_deref())?;
        let created_by_login = self.name.is_some();
        let token = match self.name {
            Some(name) => {
                let password = if self.password_stdin {
                    password::read_stdin()?
                } else {
                    password::prompt(
                        "password: ",
                        "use --password-stdin and pass the password as standard input",
                    )?
                };
                create_token(&client, &name, &password).await?
            }
            None if self.token_stdin => password::read_stdin()?,
            None => password::prompt(
                "token (or sign in with --name NAME): ",
                "use --token-stdin and pass the token as standard input, or --name NAME --password-stdin",
            )?,
        };
        let token = extract_secret(&token).to_owned();
        ensure!(
            !token.is_empty(),
            "expected a token, which begins with fo_; without one, accept an invitation (faceoff join LINK), or sign in with --name"
        );
        let caller = client.with_token(&token).whoami().await?;
        let login = Login {
            token,
            created_by_login,
            ca_file,
        };
        // Loaded again, because another command may have changed the file while the user was typing.
        let mut credentials = Credentials::load(&file)?;
        let replaced = credentials
            .login(server)
            .filter(|old| old.created_by_login)
            .cloned();
        // A stored token that the user enters again was still created by an earlier login.
        let is_same = replaced
            .as_ref()
            .is_some_and(|old| old.token == login.token);
        let login = Login {
            created_by_login: login.created_by_login || is_same,
            ..login
        };
        credentials.add(server, login, !self.not_default);
        credentials.save(&file)?;
        if let Some(old) = replaced.filter(|_| !is_same) {
            // No one else has the old token. If it is already invalid, revoking it may fail.
            let _ = client.with_token(&old.token).revoke_own_token().await;
        }
        let view = LoggedIn {
            server,
            default: credentials.is_default(server),
            file: &file,
            caller: &caller,
        };
        print(self.json, &view, |view| {
            let mut text = format!(
                "{}\nsigned in to {server}, token stored in {}",
                whoami::whoami_text(&caller),
                file.display()
            );
            if !view.default {
                text.push_str(&format!(
                    "; it is not the default server, use --server {server}"
                ));
            }
            text
        })
    }
}

/// Creates a token for this machine in a session that ends afterwards.
async fn create_token(client: &Client, name: &str, password: &str) -> anyhow::Result<String> {
    // The host's name identifies the token in lists; the file exists on Linux.
    let host = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let host: String = host.trim().chars().take(20).collect();
    let new = NewToken {
        name: format!("faceoff login, {host}"),
        expires_at: None,
        team: None,
    };
    client
        .create_token_with_password(name, password, &new)
        .await
}
