//! Settings for *remote workers*, processes on other machines that run the server's jobs. They receive jobs through a NATS message
//! server, and transfer files through the server itself or through a *bucket*, an object store (S3).

use crate::{
    commands::{files_client::bucket_client, reported_capabilities::own_capabilities},
    config::Config,
};
use faceoff_http::LinkKey;
use faceoff_runner::AgentEnvironment;
use faceoff_worker::{BucketConfig, RemoteConfig};
use std::net::SocketAddr;

/// The settings of remote workers; `None` if NATS is not configured. `address` is where the server listens.
pub(super) fn remote_config(
    config: &Config,
    address: SocketAddr,
    link_key: &LinkKey,
    agent: &AgentEnvironment,
) -> anyhow::Result<Option<RemoteConfig>> {
    let Some(nats) = config.nats.connection() else {
        anyhow::ensure!(
            config.workers.play,
            "workers.play is false and nats.url is not set: no worker would run evaluations"
        );
        return Ok(None);
    };
    let bucket = match &config.nats.bucket {
        Some(url) => Some(BucketConfig {
            url: url.clone(),
            http: bucket_client(config.nats.ca_file.as_deref())?,
            folder: config.server.data_dir.join("from-bucket"),
        }),
        None => None,
    };
    let files_url = config.nats.files_url.clone();
    let files_url = files_url.or_else(|| config.server.public_url.clone());
    Ok(Some(RemoteConfig {
        nats,
        files_url: files_url.unwrap_or_else(|| format!("http://{address}")),
        key: link_key.grant_key(),
        bucket,
        // Counts the checks of results that did not end, for example because they ended the server.
        checks_dir: config.server.data_dir.join("result-checks"),
        checked_episodes: config.workers.checked_episodes,
        // A worker gets jobs only if it can do what this server offers to agents.
        required: own_capabilities(agent, config.slots())?,
    }))
}
