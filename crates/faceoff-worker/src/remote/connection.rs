//! A connection to NATS that comes back by itself, and says in the log when it goes and comes.

use super::names::Names;
use anyhow::Context as _;
use async_nats::{Client, ConnectOptions, Event};
use std::{
    path::PathBuf,
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

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
    /// A file with the certificates (PEM) of the authorities by which NATS is known, instead of those of this host.
    pub ca_file: Option<PathBuf>,
}

impl NatsConfig {
    /// Connects as `who`, now or as soon as NATS is there. `stands` is told why there is no connection, and of none when there is one.
    pub(super) async fn connect(
        &self,
        who: &str,
        stands: impl Fn(Option<&str>) + Send + Sync + 'static,
    ) -> anyhow::Result<Client> {
        let told = Arc::new(Told {
            url: self.url.clone(),
            cause: Mutex::default(),
            stands: Box::new(stands),
        });
        let asked = Arc::clone(&told);
        let options = self
            .options(who)
            .await?
            .retry_on_initial_connect()
            .max_reconnects(None)
            .reconnect_delay_callback(|tries| {
                LONGEST_PAUSE.min(Duration::from_millis(100 << tries.min(6)))
            })
            // Asked for the next server to try, it knows why the last try failed, which events leave out; the choice stays the client's.
            .reconnect_to_server_callback(move |servers, _| {
                let cause = servers.into_iter().find_map(|server| server.last_error);
                if let Some(cause) = cause {
                    asked.unreachable(&cause);
                }
                std::future::ready(None)
            })
            .event_callback(move |event| {
                let told = Arc::clone(&told);
                async move { told.tell(&event) }
            });
        let connected = options.connect(&self.url).await;
        connected.with_context(|| format!("connecting to NATS at {}", self.url))
    }

    /// By which name and key, and whom it trusts.
    pub(super) async fn options(&self, who: &str) -> anyhow::Result<ConnectOptions> {
        let mut options = ConnectOptions::new()
            .name(who)
            .custom_inbox_prefix(Names::of(&self.name)?.inbox(who))
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

/// Is told why there is no connection, or of none.
type Tells = dyn Fn(Option<&str>) + Send + Sync;

/// What the log was told of a connection.
struct Told {
    url: String,
    /// Why it could not be had, as it was told last: the log is told of a change, not of every try.
    cause: Mutex<String>,
    stands: Box<Tells>,
}

impl Told {
    fn tell(&self, event: &Event) {
        let url = &self.url;
        match event {
            Event::Connected => {
                self.cause_is("");
                (self.stands)(None);
                tracing::info!(url, "connected to NATS");
            }
            Event::Disconnected => {
                (self.stands)(Some(&format!("there is no connection to {url}")));
                tracing::warn!(
                    url,
                    "no connection to NATS; trying again until there is one"
                );
            }
            // In more detail before the next try, if more is known.
            Event::ClientError(error) if self.is_well() => self.unreachable(&error.to_string()),
            Event::ClientError(error) => tracing::debug!(url, %error, "NATS cannot be reached"),
            Event::ServerError(error) => tracing::error!(url, %error, "NATS refuses"),
            other => tracing::info!(url, event = %other, "NATS"),
        }
    }

    fn unreachable(&self, cause: &str) {
        if !self.cause_is(cause) {
            return;
        }
        let url = &self.url;
        (self.stands)(Some(&format!("{url}: {cause}")));
        if cause.contains("certificate") {
            tracing::error!(
                url,
                cause,
                "NATS cannot be reached: its certificate is not believed; nats.ca_file names the authority that signed it"
            );
        } else {
            tracing::warn!(
                url,
                cause,
                "NATS cannot be reached; trying again until it can"
            );
        }
    }

    /// Was the log told of no cause since there was last a connection?
    fn is_well(&self) -> bool {
        let told = self.cause.lock().unwrap_or_else(PoisonError::into_inner);
        told.is_empty()
    }

    /// Is this another cause than before?
    fn cause_is(&self, cause: &str) -> bool {
        let mut told = self.cause.lock().unwrap_or_else(PoisonError::into_inner);
        let is_new = *told != cause;
        cause.clone_into(&mut told);
        is_new
    }
}
