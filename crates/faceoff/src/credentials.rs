//! What `faceoff login` keeps: for each server a token, in a file that only its owner can read.

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
    /// The server of commands that name none.
    #[serde(skip_serializing_if = "Option::is_none")]
    default: Option<String>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    servers: BTreeMap<String, Login>,
}

/// Who we are to a server.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Login {
    pub token: String,
    /// Was it made by signing in, so that signing out ends it?
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub made_here: bool,
    /// Its authorities' certificates, besides the machine's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ca_file: Option<PathBuf>,
}

// A token must not come into a message by accident.
impl std::fmt::Debug for Login {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Login")
            .field("ca_file", &self.ca_file)
            .finish_non_exhaustive()
    }
}

/// Where the file is: `$XDG_CONFIG_HOME/faceoff/credentials.toml`, or below `~/.config`.
pub fn path() -> anyhow::Result<PathBuf> {
    let absolute = |name| {
        env::var_os(name)
            .map(PathBuf::from)
            .filter(|path| path.is_absolute())
    };
    let config = absolute("XDG_CONFIG_HOME").or_else(|| Some(absolute("HOME")?.join(".config")));
    let config = config.context(
        "neither XDG_CONFIG_HOME nor HOME names a folder in which a login could be kept; give the token as FACEOFF_TOKEN",
    )?;
    Ok(config.join("faceoff/credentials.toml"))
}

/// A server's address as it is kept: however it was written, it is the same server.
fn key(server: &str) -> String {
    match reqwest::Url::parse(server) {
        Ok(url) => url.as_str().trim_end_matches('/').to_owned(),
        // Whoever uses it is told what is wrong with it.
        Err(_) => server.to_owned(),
    }
}

impl Credentials {
    /// What the file has; nothing, if there is none.
    ///
    /// # Errors
    /// If it cannot be read, others can read it, too, or it is none of this program's.
    pub fn load(file: &Path) -> anyhow::Result<Self> {
        let reading = || format!("reading the logins of {}", file.display());
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
            "{} can be read by others, and holds tokens: chmod 600 it, and make new tokens if others may have read it",
            file.display()
        );
        // The parser's words would quote the file.
        toml::from_str(&text).ok().with_context(|| {
            format!(
                "{} is not as faceoff login writes it; remove it, and log in again",
                file.display()
            )
        })
    }

    /// Writes the file anew, or not at all.
    ///
    /// # Errors
    /// If the disk refuses.
    pub fn save(&self, file: &Path) -> anyhow::Result<()> {
        let writing = || format!("keeping the login in {}", file.display());
        let folder = file.parent().with_context(writing)?;
        fs::create_dir_all(folder).with_context(writing)?;
        fs::set_permissions(folder, fs::Permissions::from_mode(0o700)).with_context(writing)?;
        let text = toml::to_string_pretty(self).with_context(writing)?;
        // Such a file is its owner's from the beginning.
        let mut made = tempfile::NamedTempFile::new_in(folder).with_context(writing)?;
        made.write_all(text.as_bytes()).with_context(writing)?;
        made.as_file().sync_all().with_context(writing)?;
        made.persist(file).with_context(writing)?;
        Ok(())
    }

    /// The server of commands that name none.
    pub fn default_server(&self) -> Option<&str> {
        self.default.as_deref()
    }

    /// Is it the server of commands that name none?
    pub fn is_default(&self, server: &str) -> bool {
        self.default == Some(key(server))
    }

    /// Who we are to this one.
    pub fn of(&self, server: &str) -> Option<&Login> {
        self.servers.get(&key(server))
    }

    /// Keeps a login, in place of an earlier one; its server is the default from now on, if there is none or `is_default`.
    pub fn keep(&mut self, server: &str, login: Login, is_default: bool) {
        let key = key(server);
        if is_default || self.default.is_none() {
            self.default = Some(key.clone());
        }
        self.servers.insert(key, login);
    }

    /// Forgets one. The default is another that is left, if it is the only one.
    pub fn forget(&mut self, server: &str) -> Option<Login> {
        let key = key(server);
        let forgotten = self.servers.remove(&key)?;
        if self.default.as_ref() == Some(&key) {
            let mut left = self.servers.keys();
            self.default = match (left.next(), left.next()) {
                (Some(only), None) => Some(only.clone()),
                _ => None,
            };
        }
        Some(forgotten)
    }

    /// The servers that there are logins for.
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
            made_here: false,
            ca_file: None,
        }
    }

    #[test]
    fn logins_are_kept_for_their_owner_alone_and_server_by_server() {
        let home = tempfile::tempdir().unwrap();
        let file = home.path().join("faceoff/credentials.toml");
        let mut kept = Credentials::load(&file).unwrap();
        assert_eq!(kept.default_server(), None);
        kept.keep("https://a.example/", login("fo_person_a"), false);
        kept.keep("http://127.0.0.1:8080", login("fo_person_b"), false);
        kept.save(&file).unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
        assert_eq!(mode(&file), 0o600);
        assert_eq!(mode(file.parent().unwrap()), 0o700);

        let mut again = Credentials::load(&file).unwrap();
        assert_eq!(again.default_server(), Some("https://a.example"));
        assert_eq!(again.of("HTTPS://A.example").unwrap().token, "fo_person_a");
        assert_eq!(
            again.of("http://127.0.0.1:8080/").unwrap().token,
            "fo_person_b"
        );
        assert!(again.of("https://b.example").is_none());
        assert!(!format!("{again:?}").contains("fo_person"));
        assert!(again.forget("https://a.example").is_some());
        assert_eq!(again.default_server(), Some("http://127.0.0.1:8080"));
        assert!(again.forget("https://a.example").is_none());
    }

    #[test]
    fn a_file_that_others_can_read_or_that_is_not_ours_is_not_used_and_not_quoted() {
        let home = tempfile::tempdir().unwrap();
        let file = home.path().join("credentials.toml");
        let told = || format!("{:#}", Credentials::load(&file).unwrap_err());
        fs::write(&file, "token = \"fo_person_secret\"\n").unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).unwrap();
        assert!(told().contains("chmod 600"), "{}", told());
        fs::set_permissions(&file, fs::Permissions::from_mode(0o600)).unwrap();
        assert!(told().contains("log in again"), "{}", told());
        assert!(!told().contains("secret"), "{}", told());
    }
}
