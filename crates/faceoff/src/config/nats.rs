use anyhow::ensure;
use faceoff_worker::NatsConfig;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// `[nats]`
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NatsSection {
    /// Where it is; left out: no work is given to other machines.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub url: Option<String>,
    /// What this server's streams and subjects begin with; no two servers of one NATS have the same.
    pub name: String,
    /// A file with the seed of the nkey by which NATS knows who connects.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nkey_file: Option<PathBuf>,
    /// Certificates (PEM) of the authorities by which NATS is known, instead of those of the host; a worker fetches files by either.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ca_file: Option<PathBuf>,
    /// Where workers reach this server's files; left out, `server.public_url`, or else the address that it listens on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub files_url: Option<String>,
    /// Where bundles and recordings pass instead: a bucket of S3, or of what speaks as it does. Keys, region and endpoint are the
    /// environment's (`AWS_ACCESS_KEY_ID` …).
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
    /// As workers take it; `None`: there is none.
    #[must_use]
    pub fn connection(&self) -> Option<NatsConfig> {
        Some(NatsConfig {
            url: self.url.clone()?,
            name: self.name.clone(),
            nkey_file: self.nkey_file.clone(),
            ca_file: self.ca_file.clone(),
        })
    }

    /// What types alone cannot say.
    pub(super) fn check(&self) -> anyhow::Result<()> {
        let begins = |url: &Option<String>, schemes: &[&str]| {
            url.as_ref().is_none_or(|url| {
                let rest = schemes.iter().find_map(|scheme| url.strip_prefix(scheme));
                rest.is_some_and(|rest| {
                    !rest.is_empty() && !rest.ends_with('/') && !rest.contains(char::is_whitespace)
                })
            })
        };
        ensure!(
            begins(&self.url, &["nats://", "tls://"]),
            "nats.url: expected nats://HOST:PORT or tls://HOST:PORT, got {:?}",
            self.url.as_deref().unwrap_or_default()
        );
        ensure!(
            begins(&self.files_url, &["http://", "https://"]),
            "nats.files_url: expected http://HOST:PORT or https://HOST without a slash at its end, got {:?}",
            self.files_url.as_deref().unwrap_or_default()
        );
        ensure!(
            begins(&self.bucket, &["s3://"]),
            "nats.bucket: expected s3://BUCKET or s3://BUCKET/PREFIX without a slash at its end, got {:?}",
            self.bucket.as_deref().unwrap_or_default()
        );
        Ok(())
    }
}
