//! The address of a server, and the HTTP client that connects to it.

use anyhow::{Context, bail};
use faceoff_types::url_without_password;
use reqwest::redirect::Policy;
use rustls::ClientConfig;
use std::{net::IpAddr, path::Path, time::Duration};

/// A server's address and the certificate authorities that may vouch for it.
#[derive(Debug, Clone)]
pub(super) struct Address {
    /// Without a trailing slash.
    pub base: String,
    tls: ClientConfig,
}

impl Address {
    /// # Errors
    /// If `server` is no address, its scheme is neither `http` nor `https`, or no certificate authority is available.
    pub(super) fn new(server: &str, ca_file: Option<&Path>) -> anyhow::Result<Self> {
        let base = server_address(server);
        let url = reqwest::Url::parse(&base).with_context(|| {
            format!(
                "{:?} is not an address; expected e.g. https://faceoff.example.org or http://127.0.0.1:8080",
                url_without_password(server)
            )
        })?;
        let tls = match url.scheme() {
            "https" => super::tls::tls_client_config(ca_file)?,
            "http" => super::tls::plain_client_config(),
            other => bail!(
                "{}: expected http:// or https://, got {other}://",
                url_without_password(server)
            ),
        };
        Ok(Self { base, tls })
    }

    /// An HTTP client that gives up after a silence of `read_timeout`.
    pub(super) fn http(&self, read_timeout: Duration) -> anyhow::Result<reqwest::Client> {
        let url = reqwest::Url::parse(&self.base).context("the server's address")?;
        let mut builder = reqwest::Client::builder();
        // A proxy in the environment (`HTTPS_PROXY` and so on) is meant for other machines.
        if url.host_str().is_some_and(is_this_machine) {
            builder = builder.no_proxy();
        }
        builder
            .user_agent(concat!("faceoff/", env!("CARGO_PKG_VERSION")))
            .connect_timeout(Duration::from_secs(10))
            .read_timeout(read_timeout)
            // A redirect would turn a POST into a GET and drop the token; the user gets an error instead.
            .redirect(Policy::none())
            .tls_backend_preconfigured(self.tls.clone())
            .build()
            .context("setting up the HTTP client")
    }
}

/// The address of a server from a text that a user has copied: without the path of a page, brackets and quotation marks, and with a
/// scheme if it had none.
pub fn server_address(text: &str) -> String {
    let text = text.trim().trim_matches(['<', '>', '"', '\'']);
    let with_scheme = if text.contains("://") {
        text.to_owned()
    } else {
        let parsed = reqwest::Url::parse(&format!("http://{text}")).ok();
        let is_local = parsed.is_some_and(|url| url.host_str().is_some_and(is_this_machine));
        let scheme = if is_local { "http" } else { "https" };
        format!("{scheme}://{text}")
    };
    match reqwest::Url::parse(&with_scheme) {
        Ok(mut url) => {
            url.set_path("");
            url.set_query(None);
            url.set_fragment(None);
            url.as_str().trim_end_matches('/').to_owned()
        }
        // The caller reports the error.
        Err(_) => text.to_owned(),
    }
}

/// Whether a host of an address is this machine.
pub fn is_this_machine(host: &str) -> bool {
    let address = host.trim_matches(['[', ']']).parse::<IpAddr>();
    host == "localhost" || address.is_ok_and(|address| address.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn server_address_is_found_in_every_form() {
        for (text, address) in [
            ("https://faceoff.example.org", "https://faceoff.example.org"),
            (
                "https://faceoff.example.org/",
                "https://faceoff.example.org",
            ),
            (
                "https://faceoff.example.org/board?stage=final#top",
                "https://faceoff.example.org",
            ),
            (
                " <https://Faceoff.Example.org> ",
                "https://faceoff.example.org",
            ),
            ("faceoff.example.org", "https://faceoff.example.org"),
            (
                "faceoff.example.org:8443/board",
                "https://faceoff.example.org:8443",
            ),
            ("localhost:8080", "http://localhost:8080"),
            ("127.0.0.1:8080", "http://127.0.0.1:8080"),
            ("[::1]:8080/board", "http://[::1]:8080"),
            (
                "localhost:8080@192.0.2.1",
                "https://localhost:8080@192.0.2.1",
            ),
            ("http://[::1]:8080/", "http://[::1]:8080"),
            ("https://größe.example", "https://xn--gre-6ka8i.example"),
        ] {
            assert_eq!(server_address(text), address, "{text:?}");
        }
        assert!(Address::new("no address", None).is_err());
    }
}
