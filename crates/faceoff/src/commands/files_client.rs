//! HTTP clients that transfer bundles and recordings between workers, server and *bucket*, an object store (S3) for large files.

use crate::client;
use anyhow::Context as _;
use std::{path::Path, time::Duration};

const CONNECT_TIMEOUT: Duration = Duration::from_secs(10);
/// Longest silence of a bucket that the server reads from.
const READ_TIMEOUT: Duration = Duration::from_secs(60);

/// The client of a worker. It trusts the certificate authorities of this host and of `ca_file`.
///
/// It has no read timeout, which would also expire while a file is being sent; the worker detects stalled transfers.
///
/// # Errors
/// If `ca_file` has no certificate.
pub fn files_client(ca_file: Option<&Path>) -> anyhow::Result<reqwest::Client> {
    build_client(builder(ca_file)?)
}

/// The server's client of a bucket. It has a read timeout, because the server uploads in small parts.
///
/// # Errors
/// If `ca_file` has no certificate.
pub fn bucket_client(ca_file: Option<&Path>) -> anyhow::Result<reqwest::Client> {
    build_client(builder(ca_file)?.read_timeout(READ_TIMEOUT))
}

fn builder(ca_file: Option<&Path>) -> anyhow::Result<reqwest::ClientBuilder> {
    Ok(reqwest::Client::builder()
        .tls_backend_preconfigured(client::tls_client_config(ca_file)?)
        .connect_timeout(CONNECT_TIMEOUT))
}

fn build_client(builder: reqwest::ClientBuilder) -> anyhow::Result<reqwest::Client> {
    builder
        .build()
        .context("setting up the HTTP client for files")
}
