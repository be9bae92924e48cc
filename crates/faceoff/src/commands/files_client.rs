//! What fetches and stores bundles and recordings on other machines.

use crate::client;
use anyhow::Context as _;
use std::{path::Path, time::Duration};

/// How long connecting to the server may take.
const CONNECTS_WITHIN: Duration = Duration::from_secs(10);
/// How long nothing may come of what the server asks a bucket for.
const READS_WITHIN: Duration = Duration::from_secs(60);

/// What a worker fetches and stores with. It trusts this host's authorities, and those of the file.
///
/// How long nothing may move the worker watches: a limit of the client's for reading would run while a file is sent, too.
///
/// # Errors
/// If the file holds none.
pub fn files_client(ca_file: Option<&Path>) -> anyhow::Result<reqwest::Client> {
    built(builder(ca_file)?)
}

/// Likewise, by which the server reaches a bucket: it stores in small pieces, and is answered soon.
///
/// # Errors
/// If the file holds none.
pub fn bucket_client(ca_file: Option<&Path>) -> anyhow::Result<reqwest::Client> {
    built(builder(ca_file)?.read_timeout(READS_WITHIN))
}

fn builder(ca_file: Option<&Path>) -> anyhow::Result<reqwest::ClientBuilder> {
    Ok(reqwest::Client::builder()
        .tls_backend_preconfigured(client::trusting_tls(ca_file)?)
        .connect_timeout(CONNECTS_WITHIN))
}

fn built(builder: reqwest::ClientBuilder) -> anyhow::Result<reqwest::Client> {
    builder
        .build()
        .context("setting up the client that fetches files")
}
