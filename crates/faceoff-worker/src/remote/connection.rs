//! A connection to NATS that comes back by itself, and says in the log when it goes and comes.

use anyhow::Context as _;
use async_nats::{Client, ConnectOptions, Event};
use std::{path::PathBuf, time::Duration};

/// How long a question may go unanswered before it counts as lost.
pub(super) const ANSWER: Duration = Duration::from_secs(5);
/// The longest pause between two tries to connect.
const LONGEST_PAUSE: Duration = Duration::from_secs(5);

/// How to reach NATS.
#[derive(Debug, Clone)]
pub struct NatsConfig {
    /// `nats://HOST:PORT`, or `tls://HOST:PORT`.
    pub url: String,
    /// What the server's streams and subjects begin with.
    pub name: String,
    /// A file with the seed of an nkey, by which NATS knows who connects.
    pub nkey_file: Option<PathBuf>,
    /// A file with the certificates (PEM) by which NATS is known, beside those of this host.
    pub ca_file: Option<PathBuf>,
}

impl NatsConfig {
    /// Connects as `who`, now or as soon as NATS is there.
    pub(super) async fn connect(&self, who: &str) -> anyhow::Result<Client> {
        let told = self.url.clone();
        let options = self
            .options(who)
            .await?
            .retry_on_initial_connect()
            .max_reconnects(None)
            .reconnect_delay_callback(|tries| {
                LONGEST_PAUSE.min(Duration::from_millis(100 << tries.min(6)))
            })
            .event_callback(move |event| {
                let url = told.clone();
                async move { tell(&url, &event) }
            });
        let connected = options.connect(&self.url).await;
        connected.with_context(|| format!("connecting to NATS at {}", self.url))
    }

    /// By which name and key, and whom it trusts.
    pub(super) async fn options(&self, who: &str) -> anyhow::Result<ConnectOptions> {
        let mut options = ConnectOptions::new()
            .name(who)
            .custom_inbox_prefix(format!("_INBOX.{}.{who}", self.name))
            .request_timeout(Some(ANSWER));
        if let Some(file) = &self.nkey_file {
            let seed = tokio::fs::read_to_string(file)
                .await
                .with_context(|| format!("reading the nkey {}", file.display()))?;
            options = options.nkey(seed.trim().to_owned());
        }
        if let Some(file) = &self.ca_file {
            options = options.add_root_certificates(file.clone());
        }
        Ok(options)
    }
}

fn tell(url: &str, event: &Event) {
    match event {
        Event::Connected => tracing::info!(url, "connected to NATS"),
        Event::Disconnected => {
            tracing::warn!(
                url,
                "no connection to NATS; trying again until there is one"
            );
        }
        Event::ClientError(error) => {
            tracing::warn!(url, %error, "NATS cannot be reached; trying again until it can");
        }
        Event::ServerError(error) => tracing::error!(url, %error, "NATS refuses"),
        other => tracing::info!(url, event = %other, "NATS"),
    }
}
