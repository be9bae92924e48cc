//! A connection to NATS, the message broker between server and workers, that reconnects automatically and logs changes
//! of its state.

use super::names::Names;
use anyhow::Context as _;
use async_nats::{Client, ConnectOptions, Event};
use std::{
    path::PathBuf,
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

/// Timeout of requests over NATS.
pub(super) const REQUEST_TIMEOUT: Duration = Duration::from_secs(5);
/// The longest pause between two attempts to connect.
const LONGEST_PAUSE: Duration = Duration::from_secs(5);

/// How to reach NATS.
#[derive(Debug, Clone)]
pub struct NatsConfig {
    /// `nats://HOST:PORT`, or `tls://HOST:PORT`.
    pub url: String,
    /// Name of the server, with which its streams and subjects begin.
    pub name: String,
    /// A file with the seed of an nkey, which identifies the client to NATS.
    pub nkey_file: Option<PathBuf>,
    /// A file with PEM certificates of the authorities trusted for NATS, in place of the host's.
    pub ca_file: Option<PathBuf>,
}

impl NatsConfig {
    /// Connects as `client_name`, now or as soon as NATS is reachable. `on_status` is called with the reason when the
    /// connection fails, and with `None` when it is established.
    pub(super) async fn connect(
        &self,
        client_name: &str,
        on_status: impl Fn(Option<&str>) + Send + Sync + 'static,
    ) -> anyhow::Result<Client> {
        let log = Arc::new(ConnectionLog {
            url: self.url.clone(),
            cause: Mutex::default(),
            on_status: Box::new(on_status),
        });
        let reconnect_log = Arc::clone(&log);
        let options = self
            .options(client_name)
            .await?
            .retry_on_initial_connect()
            .max_reconnects(None)
            .reconnect_delay_callback(|tries| {
                // 100 ms, doubled with each attempt.
                LONGEST_PAUSE.min(Duration::from_millis(100 << tries.min(6)))
            })
            // Only this callback knows why the last attempt failed. It leaves the choice of the NATS server to the client.
            .reconnect_to_server_callback(move |servers, _| {
                let cause = servers.into_iter().find_map(|server| server.last_error);
                if let Some(cause) = cause {
                    reconnect_log.record_failure(&cause);
                }
                std::future::ready(None)
            })
            .event_callback(move |event| {
                let log = Arc::clone(&log);
                async move { log.record(&event) }
            });
        let connected = options.connect(&self.url).await;
        connected.with_context(|| format!("connecting to NATS at {}", self.url))
    }

    /// Client name, credentials and trusted certificates.
    pub(super) async fn options(&self, client_name: &str) -> anyhow::Result<ConnectOptions> {
        let mut options = ConnectOptions::new()
            .name(client_name)
            .custom_inbox_prefix(Names::new(&self.name)?.inbox(client_name))
            .request_timeout(Some(REQUEST_TIMEOUT));
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

/// Called with the reason for a missing connection, or `None`.
type StatusCallback = dyn Fn(Option<&str>) + Send + Sync;

/// Logs the state of a connection, without repetitions.
struct ConnectionLog {
    url: String,
    /// The last logged cause of a failure; empty while connected. Only changes are logged.
    cause: Mutex<String>,
    on_status: Box<StatusCallback>,
}

impl ConnectionLog {
    fn record(&self, event: &Event) {
        let url = &self.url;
        match event {
            Event::Connected => {
                self.set_cause("");
                (self.on_status)(None);
                tracing::info!(url, "connected to NATS");
            }
            Event::Disconnected => {
                (self.on_status)(Some(&format!("there is no connection to {url}")));
                tracing::warn!(
                    url,
                    "no connection to NATS; trying again until there is one"
                );
            }
            // Further errors are logged with their cause before the next attempt, by the callback above.
            Event::ClientError(error) if self.is_healthy() => {
                self.record_failure(&error.to_string());
            }
            Event::ClientError(error) => tracing::debug!(url, %error, "NATS cannot be reached"),
            Event::ServerError(error) => tracing::error!(url, %error, "NATS refuses"),
            event => tracing::info!(url, %event, "NATS"),
        }
    }

    fn record_failure(&self, cause: &str) {
        if !self.set_cause(cause) {
            return;
        }
        let url = &self.url;
        (self.on_status)(Some(&format!("{url}: {cause}")));
        if cause.contains("certificate") {
            tracing::error!(
                url,
                cause,
                "NATS cannot be reached: its certificate is not trusted; nats.ca_file must name the authority that signed it"
            );
        } else {
            tracing::warn!(
                url,
                cause,
                "NATS cannot be reached; trying again until it can"
            );
        }
    }

    /// Has no cause been logged since the last connection?
    fn is_healthy(&self) -> bool {
        let cause = self.cause.lock().unwrap_or_else(PoisonError::into_inner);
        cause.is_empty()
    }

    /// Records the cause; returns true if it differs from the previous one.
    fn set_cause(&self, cause: &str) -> bool {
        let mut logged = self.cause.lock().unwrap_or_else(PoisonError::into_inner);
        let is_new = *logged != cause;
        cause.clone_into(&mut logged);
        is_new
    }
}
