//! `[nats]`: how server and remote workers (processes on other machines that run jobs) connect through a NATS message server.

use anyhow::ensure;
use faceoff_types::url_without_password;
use faceoff_worker::NatsConfig;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// `[nats]`
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NatsSection {
    /// Address of NATS; left out: no remote workers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub url: Option<String>,
    /// Prefix of this server's streams and subjects; it must be unique for each server of one NATS.
    pub name: String,
    /// File with the nkey seed that identifies this server or worker to NATS.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nkey_file: Option<PathBuf>,
    /// Certificate authorities (PEM) of NATS, instead of the host's; for file transfers, a worker trusts both.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ca_file: Option<PathBuf>,
    /// Address of this server for the file transfers of workers; left out, `server.public_url`, or else the listen
    /// address.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub files_url: Option<String>,
    /// S3-compatible bucket through which bundles and recordings are transferred, instead of through this server. Keys, region and
    /// endpoint come from the environment (`AWS_ACCESS_KEY_ID` …).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bucket: Option<String>,
}

impl Default for NatsSection {
    fn default() -> Self {
        Self {
            url: None,
            name: "faceoff".to_owned(),
            nkey_file: None,
            ca_file: None,
            files_url: None,
            bucket: None,
        }
    }
}

impl NatsSection {
    /// The settings of the connection; `None` without NATS.
    #[must_use]
    pub fn connection(&self) -> Option<NatsConfig> {
        Some(NatsConfig {
            url: self.url.clone()?,
            name: self.name.clone(),
            nkey_file: self.nkey_file.clone(),
            ca_file: self.ca_file.clone(),
        })
    }

    /// Checks the conditions that the types do not express.
    pub(super) fn check(&self) -> anyhow::Result<()> {
        let is_absent_or_valid = |url: &Option<String>, schemes: &[&str]| {
            url.as_ref().is_none_or(|url| {
                let rest = schemes.iter().find_map(|scheme| url.strip_prefix(scheme));
                rest.is_some_and(|rest| {
                    !rest.is_empty()
                        && !rest.ends_with('/')
                        // Addresses stand in logs and errors, and so would a password.
                        && !rest.contains(|char: char| char.is_whitespace() || char == '@')
                })
            })
        };
        let shown = |url: &Option<String>| {
            url_without_password(url.as_deref().unwrap_or_default()).into_owned()
        };
        ensure!(
            is_absent_or_valid(&self.url, &["nats://", "tls://"]),
            "nats.url: expected nats://HOST:PORT or tls://HOST:PORT without user and password (nats.nkey_file identifies this \
             program), got {:?}",
            shown(&self.url)
        );
        ensure!(
            is_absent_or_valid(&self.files_url, &["http://", "https://"]),
            "nats.files_url: expected http://HOST:PORT or https://HOST without a password and a trailing slash, got {:?}",
            shown(&self.files_url)
        );
        ensure!(
            is_absent_or_valid(&self.bucket, &["s3://"]),
            "nats.bucket: expected s3://BUCKET or s3://BUCKET/PREFIX without a trailing slash, got {:?}",
            shown(&self.bucket)
        );
        Ok(())
    }
}
