//! What fetches and stores bundles and recordings on other machines.

use crate::client;
use anyhow::Context as _;
use std::{path::Path, time::Duration};

/// How long connecting to the server may take.
const CONNECTS_WITHIN: Duration = Duration::from_secs(10);
/// How long nothing may come of what is being fetched.
const READS_WITHIN: Duration = Duration::from_secs(60);

/// A client that trusts this host's authorities, and those of the file.
///
/// # Errors
/// If the file holds none.
pub fn files_client(ca_file: Option<&Path>) -> anyhow::Result<reqwest::Client> {
    reqwest::Client::builder()
        .tls_backend_preconfigured(client::trusting_tls(ca_file)?)
        .connect_timeout(CONNECTS_WITHIN)
        .read_timeout(READS_WITHIN)
        .build()
        .context("setting up the client that fetches files")
}
