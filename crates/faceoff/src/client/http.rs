use anyhow::Context;
use std::time::Duration;

/// What speaks HTTP to servers that the user has named, and waits so long for a silent one.
pub(super) fn http(patience: Duration) -> anyhow::Result<reqwest::Client> {
    reqwest::Client::builder()
        .user_agent(concat!("faceoff/", env!("CARGO_PKG_VERSION")))
        .connect_timeout(Duration::from_secs(10))
        .read_timeout(patience)
        // The server is named by the user; a proxy of the environment is meant for other hosts.
        .no_proxy()
        .build()
        .context("setting up the HTTP client")
}
