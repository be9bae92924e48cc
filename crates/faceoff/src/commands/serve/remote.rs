//! What other machines are given.

use crate::{
    commands::{files_client::bucket_client, introduction::introduction},
    config::Config,
};
use faceoff_http::LinkKey;
use faceoff_runner::AgentEnvironment;
use faceoff_worker::{BucketConfig, RemoteConfig};
use std::net::SocketAddr;

/// How work is given to other machines, if it is.
pub(super) fn config(
    config: &Config,
    listens_on: SocketAddr,
    link_key: &LinkKey,
    agent: &AgentEnvironment,
) -> anyhow::Result<Option<RemoteConfig>> {
    let Some(nats) = config.nats.connection() else {
        anyhow::ensure!(
            config.workers.play,
            "workers.play is false and no nats.url is set: nobody would play"
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
    let files = config.nats.files_url.clone();
    let files = files.or_else(|| config.server.public_url.clone());
    Ok(Some(RemoteConfig {
        nats,
        files: files.unwrap_or_else(|| format!("http://{listens_on}")),
        key: link_key.of_grants(),
        bucket,
        checked_episodes: config.workers.checked_episodes,
        like: introduction(agent, config.slots())?,
    }))
}
