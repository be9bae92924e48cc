//! Where commands go that speak to a server, and as whom.

use super::ca_file::CaFile;
use crate::{
    client::Client,
    credentials::{self, Credentials, Login},
    exit::NotSignedIn,
};
use clap::Args;
use std::path::{Path, PathBuf};

/// Of a server on this machine, as it is configured by default.
pub const HERE: &str = "http://127.0.0.1:8080";

/// Where a command goes, and as whom. What is left out is that of `faceoff login`.
#[derive(Debug, Args)]
pub struct ServerArgs {
    /// The server [default: that of faceoff login, or http://127.0.0.1:8080]
    #[arg(long, global = true, value_name = "URL", env = "FACEOFF_SERVER")]
    server: Option<String>,
    /// Your token, or your team's [default: that of faceoff login]
    #[arg(long, global = true, env = "FACEOFF_TOKEN", hide_env_values = true)]
    token: Option<String>,
    #[command(flatten)]
    ca: CaFile,
    /// Print the server's answer as JSON
    #[arg(long, global = true)]
    pub json: bool,
}

/// Where something that a command needs comes from.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// Of the command line.
    Option,
    Environment,
    Login,
    Default,
}

impl Source {
    /// In words; `option` and `variable` are what it could have been named with.
    pub fn words(&self, option: &str, variable: &str) -> String {
        match self {
            Self::Option => option.to_owned(),
            Self::Environment => variable.to_owned(),
            Self::Login => "faceoff login".to_owned(),
            Self::Default => "the default".to_owned(),
        }
    }

    /// Of a value that clap took from either.
    fn given(value: &str, variable: &str) -> Self {
        if std::env::var(variable).is_ok_and(|set| set == value) {
            Self::Environment
        } else {
            Self::Option
        }
    }
}

#[derive(Debug)]
pub struct Found {
    pub server: String,
    pub server_from: Source,
    pub token: Option<String>,
    pub token_from: Source,
    pub ca_file: Option<PathBuf>,
}

impl Found {
    /// The server and the login of what is given: `server` and `token` of the command line or the environment.
    ///
    /// # Errors
    /// If the file of the logins is needed and cannot be used.
    pub fn of(
        server: Option<&str>,
        token: Option<(&str, &str)>,
        ca_file: Option<&Path>,
    ) -> anyhow::Result<Self> {
        let kept = match credentials::path() {
            // Whoever says everything needs no file.
            _ if server.is_some() && token.is_some() => Credentials::default(),
            Ok(file) => Credentials::load(&file)?,
            Err(_) => Credentials::default(),
        };
        let (server, server_from) = match (server, kept.default_server()) {
            (Some(server), _) => (server, Source::given(server, "FACEOFF_SERVER")),
            (None, Some(server)) => (server, Source::Login),
            (None, None) => (HERE, Source::Default),
        };
        let login: Option<Login> = kept.of(server).cloned();
        let ca_file = ca_file
            .map(Path::to_owned)
            .or_else(|| login.as_ref()?.ca_file.clone());
        let (token, token_from) = match (token, login) {
            (Some((token, variable)), _) => (
                Some(token.trim().to_owned()),
                Source::given(token, variable),
            ),
            (None, Some(login)) => (Some(login.token), Source::Login),
            (None, None) => (None, Source::Default),
        };
        Ok(Self {
            server: server.to_owned(),
            server_from,
            token,
            token_from,
            ca_file,
        })
    }

    /// A client that speaks for whose token it is, or for nobody.
    ///
    /// # Errors
    /// If the address is none.
    pub fn client(&self) -> anyhow::Result<Client> {
        Client::new(&self.server, self.token.as_deref(), self.ca_file.as_deref())
    }
}

impl ServerArgs {
    /// What this command goes by.
    ///
    /// # Errors
    /// If the file of the logins cannot be used.
    pub fn found(&self) -> anyhow::Result<Found> {
        let token = self.token.as_deref().map(|token| (token, "FACEOFF_TOKEN"));
        Found::of(self.server.as_deref(), token, self.ca.path())
    }

    /// A client that speaks for whose token it is, or for nobody.
    ///
    /// # Errors
    /// If the address is none.
    pub fn anybody(&self) -> anyhow::Result<Client> {
        self.found()?.client()
    }

    /// A client that speaks for somebody.
    ///
    /// # Errors
    /// If there is no token, or the address is none.
    pub fn client(&self) -> anyhow::Result<Client> {
        let found = self.found()?;
        if found.token.is_none() {
            return Err(NotSignedIn(format!(
                "nobody is signed in to {}: faceoff login, or faceoff join LINK with your invitation; or give a token with \
                 --token or FACEOFF_TOKEN",
                found.server
            ))
            .into());
        }
        found.client()
    }
}
