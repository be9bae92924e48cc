//! Server and token of a command: from its options, the environment or the stored login.

use super::ca_file::CaFile;
use crate::{
    client::Client,
    credentials::{self, Credentials, Login},
    exit::NotSignedIn,
};
use clap::Args;
use faceoff_api::secret_extraction::extract_secret;
use std::path::{Path, PathBuf};

/// A server on this machine with the default configuration.
pub const DEFAULT_SERVER: &str = "http://127.0.0.1:8080";

/// Options for server and token; their defaults are those of `faceoff login`.
#[derive(Debug, Args)]
pub struct ServerArgs {
    /// The server [default: the server of the last faceoff login, or http://127.0.0.1:8080]
    #[arg(long, global = true, value_name = "URL", env = "FACEOFF_SERVER")]
    server: Option<String>,
    /// Your token, or your team's [default: the token of faceoff login]
    #[arg(long, global = true, env = "FACEOFF_TOKEN", hide_env_values = true)]
    token: Option<String>,
    #[command(flatten)]
    ca: CaFile,
    /// Print the server's response as JSON
    #[arg(long, global = true)]
    pub json: bool,
}

/// Source of a setting.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// The command line.
    Option,
    Environment,
    Login,
    Default,
}

impl Source {
    /// The source as text; `option` and `variable` are the names of the setting.
    pub fn text(&self, option: &str, variable: &str) -> String {
        match self {
            Self::Option => option.to_owned(),
            Self::Environment => variable.to_owned(),
            Self::Login => "faceoff login".to_owned(),
            Self::Default => "the default".to_owned(),
        }
    }

    /// The source of a value that clap has read from the command line or the environment.
    fn of_value(value: &str, variable: &str) -> Self {
        if std::env::var(variable).is_ok_and(|text| text == value) {
            Self::Environment
        } else {
            Self::Option
        }
    }
}

/// Server, token and certificate authority of a command, with their sources.
#[derive(Debug)]
pub struct Connection {
    pub server: String,
    pub server_source: Source,
    pub token: Option<String>,
    pub token_source: Source,
    pub ca_file: Option<PathBuf>,
}

impl Connection {
    /// Completes `server` and `token`, given by option or environment, with the stored login. `token` is the token and
    /// the name of its variable.
    ///
    /// # Errors
    /// If the credentials file is needed and cannot be read.
    pub fn resolve(
        server: Option<&str>,
        token: Option<(&str, &str)>,
        ca_file: Option<&Path>,
    ) -> anyhow::Result<Self> {
        let credentials = match credentials::path() {
            // If both are given, the file is not needed.
            _ if server.is_some() && token.is_some() => Credentials::default(),
            Ok(file) => Credentials::load(&file)?,
            Err(_) => Credentials::default(),
        };
        let (server, server_source) = match (server, credentials.default_server()) {
            (Some(server), _) => (server, Source::of_value(server, "FACEOFF_SERVER")),
            (None, Some(server)) => (server, Source::Login),
            (None, None) => (DEFAULT_SERVER, Source::Default),
        };
        let login: Option<Login> = credentials.login(server).cloned();
        let ca_file = ca_file
            .map(Path::to_owned)
            .or_else(|| login.as_ref()?.ca_file.clone());
        let (token, token_source) = match (token, login) {
            (Some((token, variable)), _) => (
                Some(extract_secret(token).to_owned()),
                Source::of_value(token, variable),
            ),
            (None, Some(login)) => (Some(login.token), Source::Login),
            (None, None) => (None, Source::Default),
        };
        Ok(Self {
            server: server.to_owned(),
            server_source,
            token,
            token_source,
            ca_file,
        })
    }

    /// A client with the token, or without one.
    ///
    /// # Errors
    /// If the address is invalid.
    pub fn client(&self) -> anyhow::Result<Client> {
        Client::new(&self.server, self.token.as_deref(), self.ca_file.as_deref())
    }
}

impl ServerArgs {
    /// Server and token of this command.
    ///
    /// # Errors
    /// If the credentials file cannot be read.
    pub fn connection(&self) -> anyhow::Result<Connection> {
        let token = self.token.as_deref().map(|token| (token, "FACEOFF_TOKEN"));
        Connection::resolve(self.server.as_deref(), token, self.ca.path())
    }

    /// A client with the token, or without one.
    ///
    /// # Errors
    /// If the address is invalid.
    pub fn client_with_optional_token(&self) -> anyhow::Result<Client> {
        self.connection()?.client()
    }

    /// A client with a token.
    ///
    /// # Errors
    /// If there is no token, or the address is invalid.
    pub fn client(&self) -> anyhow::Result<Client> {
        let connection = self.connection()?;
        if connection.token.is_none() {
            return Err(NotSignedIn(format!(
                "not signed in to {}: run faceoff login, or faceoff join LINK with your invitation, or give a token with \
                --token or FACEOFF_TOKEN",
                connection.server
            ))
            .into());
        }
        connection.client()
    }
}
