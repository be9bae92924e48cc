//! Credentials of `faceoff login`: one token per server, in a file that only its owner can read.

use crate::client::server_address;
use anyhow::{Context, ensure};
use serde::{Deserialize, Serialize};
use std::{
    collections::BTreeMap,
    env, fs,
    io::{ErrorKind, Write},
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
};

#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Credentials {
    /// The server of commands without `--server`.
    #[serde(skip_serializing_if = "Option::is_none")]
    default: Option<String>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    servers: BTreeMap<String, Login>,
}

/// The token for a server.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Login {
    pub token: String,
    /// The token was created by signing in, so signing out revokes it. A token that the user supplied stays valid.
    #[serde(
        default,
        rename = "made_here",
        skip_serializing_if = "std::ops::Not::not"
    )]
    pub created_by_login: bool,
    /// Certificate authorities of the server, in addition to the machine's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ca_file: Option<PathBuf>,
}

// Keeps tokens out of messages.
impl std::fmt::Debug for Login {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Login")
            .field("ca_file", &self.ca_file)
            .finish_non_exhaustive()
    }
}

/// Path of the file: `$XDG_CONFIG_HOME/faceoff/credentials.toml`, or below `~/.config`.
pub fn path() -> anyhow::Result<PathBuf> {
    let absolute = |name| {
        env::var_os(name)
            .map(PathBuf::from)
            .filter(|path| path.is_absolute())
    };
    let config = absolute("XDG_CONFIG_HOME").or_else(|| Some(absolute("HOME")?.join(".config")));
    let config = config.context(
        "neither XDG_CONFIG_HOME nor HOME names a folder for the credentials; give the token as FACEOFF_TOKEN",
    )?;
    Ok(config.join("faceoff/credentials.toml"))
}

impl Credentials {
    /// Reads the file; empty if it does not exist.
    ///
    /// # Errors
    /// If the file cannot be read, other users can read it, or its content is invalid.
    pub fn load(file: &Path) -> anyhow::Result<Self> {
        let reading = || format!("reading the credentials in {}", file.display());
        let text = match fs::read_to_string(file) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Self::default()),
            text => text.with_context(reading)?,
        };
        let mode = fs::metadata(file)
            .with_context(reading)?
            .permissions()
            .mode();
        ensure!(
            mode & 0o077 == 0,
            "{} contains tokens and can be read by other users: chmod 600 it, and create new tokens if they may have been read",
            file.display()
        );
        // The parser's message would quote the file.
        toml::from_str(&text).ok().with_context(|| {
            format!(
                "{} is not a valid credentials file; remove it, and log in again",
                file.display()
            )
        })
    }

    /// Writes the complete file, or leaves it unchanged.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn save(&self, file: &Path) -> anyhow::Result<()> {
        let writing = || format!("writing the credentials to {}", file.display());
        let folder = file.parent().with_context(writing)?;
        fs::create_dir_all(folder).with_context(writing)?;
        fs::set_permissions(folder, fs::Permissions::from_mode(0o700)).with_context(writing)?;
        let text = toml::to_string_pretty(self).with_context(writing)?;
        // A temporary file is private from the start.
        let mut new_file = tempfile::NamedTempFile::new_in(folder).with_context(writing)?;
        new_file.write_all(text.as_bytes()).with_context(writing)?;
        new_file.as_file().sync_all().with_context(writing)?;
        new_file.persist(file).with_context(writing)?;
        Ok(())
    }

    /// The server of commands without `--server`.
    pub fn default_server(&self) -> Option<&str> {
        self.default.as_deref()
    }

    /// This is the server of commands without `--server`.
    pub fn is_default(&self, server: &str) -> bool {
        self.default == Some(server_address(server))
    }

    /// The login to a server.
    pub fn login(&self, server: &str) -> Option<&Login> {
        self.servers.get(&server_address(server))
    }

    /// Adds or replaces a login. Its server becomes the default if `is_default`, or if there is no other default.
    pub fn add(&mut self, server: &str, login: Login, is_default: bool) {
        let server = server_address(server);
        if is_default || self.default.is_none() {
            self.default = Some(server.clone());
        }
        self.servers.insert(server, login);
    }

    /// Removes a login. If it was the default, the only remaining server becomes the default.
    pub fn remove(&mut self, server: &str) -> Option<Login> {
        let server = server_address(server);
        let removed = self.servers.remove(&server)?;
        if self.default.as_ref() == Some(&server) {
            let mut remaining = self.servers.keys();
            self.default = match (remaining.next(), remaining.next()) {
                (Some(only), None) => Some(only.clone()),
                _ => None,
            };
        }
        Some(removed)
    }

    /// All servers with a login.
    pub fn servers(&self) -> impl Iterator<Item = &str> {
        self.servers.keys().map(String::as_str)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn login(token: &str) -> Login {
        Login {
            token: token.to_owned(),
            created_by_login: false,
            ca_file: None,
        }
    }

    #[test]
    fn logins_are_private_and_per_server() {
        let home = tempfile::tempdir().unwrap();
        let file = home.path().join("faceoff/credentials.toml");
        let mut credentials = Credentials::load(&file).unwrap();
        assert_eq!(credentials.default_server(), None);
        credentials.add("https://a.example/", login("fo_person_a"), false);
        credentials.add("http://127.0.0.1:8080", login("fo_person_b"), false);
        credentials.save(&file).unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
        assert_eq!(mode(&file), 0o600);
        assert_eq!(mode(file.parent().unwrap()), 0o700);

        let mut loaded = Credentials::load(&file).unwrap();
        assert_eq!(loaded.default_server(), Some("https://a.example"));
        assert_eq!(
            loaded.login("HTTPS://A.example").unwrap().token,
            "fo_person_a"
        );
        assert_eq!(
            loaded.login("http://127.0.0.1:8080/").unwrap().token,
            "fo_person_b"
        );
        assert!(loaded.login("https://b.example").is_none());
        assert!(!format!("{loaded:?}").contains("fo_person"));
        assert!(loaded.remove("https://a.example").is_some());
        assert_eq!(loaded.default_server(), Some("http://127.0.0.1:8080"));
        assert!(loaded.remove("https://a.example").is_none());
    }

    #[test]
    fn file_open_to_others_or_invalid_is_refused_unquoted() {
        let home = tempfile::tempdir().unwrap();
        let file = home.path().join("credentials.toml");
        let message = || format!("{:#}", Credentials::load(&file).unwrap_err());
        fs::write(&file, "token = \"fo_person_secret\"\n").unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).unwrap();
        assert!(message().contains("chmod 600"), "{}", message());
        fs::set_permissions(&file, fs::Permissions::from_mode(0o600)).unwrap();
        assert!(message().contains("log in again"), "{}", message());
        assert!(!message().contains("secret"), "{}", message());
    }
}
