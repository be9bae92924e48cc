use anyhow::{Context, bail};
use reqwest::redirect::Policy;
use rustls::ClientConfig;
use std::{path::Path, time::Duration};

/// A server's address, and whom to believe that they are it.
#[derive(Debug, Clone)]
pub(super) struct Address {
    /// Without a slash at its end.
    pub base: String,
    tls: ClientConfig,
}

impl Address {
    /// # Errors
    /// If it is none, or names a way that this program does not speak, or nobody could be believed.
    pub(super) fn new(server: &str, ca_file: Option<&Path>) -> anyhow::Result<Self> {
        let url = reqwest::Url::parse(server).with_context(|| {
            format!("{server:?} is no address; expected e.g. https://faceoff.example.org or http://127.0.0.1:8080")
        })?;
        let tls = match url.scheme() {
            "https" => super::tls::trusting(ca_file)?,
            "http" => super::tls::none(),
            other => bail!("{server}: expected http:// or https://, got {other}://"),
        };
        Ok(Self {
            base: server.trim_end_matches('/').to_owned(),
            tls,
        })
    }

    /// What speaks to it, and waits so long for a silent one.
    pub(super) fn http(&self, patience: Duration) -> anyhow::Result<reqwest::Client> {
        reqwest::Client::builder()
            .user_agent(concat!("faceoff/", env!("CARGO_PKG_VERSION")))
            .connect_timeout(Duration::from_secs(10))
            .read_timeout(patience)
            // The server is named by the user; a proxy of the environment is meant for other hosts.
            .no_proxy()
            // A redirection would make a POST a GET, and leave the token behind; the user is told instead.
            .redirect(Policy::none())
            .tls_backend_preconfigured(self.tls.clone())
            .build()
            .context("setting up the HTTP client")
    }
}
