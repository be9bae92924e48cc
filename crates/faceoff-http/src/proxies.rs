//! Trusted proxies: their networks, and the header in which they name their clients.

use axum::http::{HeaderMap, HeaderName};
use ipnet::IpNet;
use serde::{Deserialize, Serialize};
use std::{
    fmt,
    net::{IpAddr, SocketAddr},
    str::FromStr,
    sync::atomic::{AtomicBool, Ordering},
};

/// The header of RFC 7239, whose entries have names.
const FORWARDED: HeaderName = HeaderName::from_static("forwarded");

/// An address such as `10.0.0.1`, or a network such as `10.0.0.0/8`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct ProxyNetwork(IpNet);

impl From<IpAddr> for ProxyNetwork {
    fn from(address: IpAddr) -> Self {
        Self(address.to_canonical().into())
    }
}

impl FromStr for ProxyNetwork {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Ok(address) = text.parse::<IpAddr>() {
            return Ok(address.into());
        }
        text.parse().map(Self).map_err(|_| {
            format!("expected an address like 10.0.0.1 or a network like 10.0.0.0/8, got {text:?}")
        })
    }
}

impl TryFrom<String> for ProxyNetwork {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<ProxyNetwork> for String {
    fn from(network: ProxyNetwork) -> Self {
        network.to_string()
    }
}

impl fmt::Display for ProxyNetwork {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.prefix_len() == self.0.max_prefix_len() {
            return self.0.addr().fmt(f);
        }
        self.0.fmt(f)
    }
}

impl ProxyNetwork {
    /// Whether one of the networks contains the address.
    pub(crate) fn any_contains(networks: &[Self], address: IpAddr) -> bool {
        let address = address.to_canonical();
        networks.iter().any(|network| network.0.contains(&address))
    }
}

/// The trusted proxies.
#[derive(Debug)]
pub(crate) struct TrustedProxies {
    networks: Vec<ProxyNetwork>,
    /// The header in which each proxy appends the address that it was called from.
    header: HeaderName,
    /// An entry that is no address was logged.
    has_warned: AtomicBool,
}

impl TrustedProxies {
    pub(crate) fn new(networks: Vec<ProxyNetwork>, header: HeaderName) -> Self {
        Self {
            networks,
            header,
            has_warned: AtomicBool::new(false),
        }
    }

    /// The address of the client: the peer's, or the one for which a trusted proxy forwards the request. `None` if a trusted
    /// proxy names no client: the header is absent, or lists only trusted proxies.
    pub(crate) fn client_address(&self, peer: IpAddr, headers: &HeaderMap) -> Option<IpAddr> {
        let is_trusted = |address: IpAddr| ProxyNetwork::any_contains(&self.networks, address);
        if !is_trusted(peer) {
            return Some(peer);
        }
        // Entries before the last trusted proxy's come from the client, and may be forged.
        let entries = headers.get_all(&self.header).iter();
        let entries: Vec<&[u8]> = entries
            .flat_map(|value| value.as_bytes().split(|byte| *byte == b','))
            .collect();
        for entry in entries.into_iter().rev() {
            match self.parse_entry(entry) {
                Some(address) if is_trusted(address) => {}
                Some(address) => return Some(address),
                // All clients with such an entry are counted under the proxy's address.
                None => {
                    self.warn_once(peer, entry);
                    return Some(peer);
                }
            }
        }
        None
    }

    /// The address of an entry: `192.0.2.1`, `192.0.2.1:4711`, `2001:db8::1`, `[2001:db8::1]`, `[2001:db8::1]:4711`, each with or
    /// without quotes; in `Forwarded` as the value of `for`.
    fn parse_entry(&self, entry: &[u8]) -> Option<IpAddr> {
        let mut text = std::str::from_utf8(entry).ok()?.trim();
        if self.header == FORWARDED {
            let is_client = |pair: &&str| {
                let (name, _) = pair.split_once('=').unwrap_or_default();
                name.trim().eq_ignore_ascii_case("for")
            };
            text = text.split(';').find(is_client)?.split_once('=')?.1.trim();
        }
        let text = text.trim_matches('"').trim();
        let without_brackets = text
            .strip_prefix('[')
            .and_then(|text| text.strip_suffix(']'));
        without_brackets
            .unwrap_or(text)
            .parse()
            .ok()
            .or_else(|| text.parse::<SocketAddr>().ok().map(|address| address.ip()))
    }

    fn warn_once(&self, proxy: IpAddr, entry: &[u8]) {
        if !self.has_warned.swap(true, Ordering::Relaxed) {
            tracing::warn!(
                %proxy,
                header = %self.header,
                entry = %String::from_utf8_lossy(&entry[..entry.len().min(100)]).escape_debug(),
                "a trusted proxy names a client by something that is no address, so its clients share the limits of one address; \
                 further ones are not logged"
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderValue;

    fn client_address(header: &'static str, peer: &str, forwarded: &[&str]) -> Option<String> {
        let networks = ["127.0.0.1", "10.0.0.0/24", "fd00::/8"];
        let networks = networks.map(|network| network.parse().unwrap());
        let proxies = TrustedProxies::new(networks.into(), HeaderName::from_static(header));
        let mut headers = HeaderMap::new();
        for value in forwarded {
            let value = HeaderValue::from_bytes(value.as_bytes()).unwrap();
            headers.append(header, value);
        }
        let address = proxies.client_address(peer.parse().unwrap(), &headers);
        address.map(|address| address.to_string())
    }

    #[test]
    fn only_trusted_proxies_are_believed() {
        let expected = |address: &str| Some(address.to_owned());
        for (peer, forwarded, client) in [
            ("192.0.2.1", &[][..], expected("192.0.2.1")),
            ("192.0.2.1", &["192.0.2.7"], expected("192.0.2.1")),
            ("127.0.0.1", &[], None),
            ("::ffff:127.0.0.1", &["192.0.2.7"], expected("192.0.2.7")),
            ("fd12::1", &["192.0.2.7"], expected("192.0.2.7")),
            // 192.0.2.7 comes from the client, and is not believed.
            (
                "127.0.0.1",
                &["192.0.2.7, 192.0.2.8"],
                expected("192.0.2.8"),
            ),
            (
                "127.0.0.1",
                &["192.0.2.7", "192.0.2.8"],
                expected("192.0.2.8"),
            ),
            // Two trusted proxies, one behind the other.
            ("127.0.0.1", &["192.0.2.8, 10.0.0.9"], expected("192.0.2.8")),
            // An entry that is no address ends the search.
            ("127.0.0.1", &["192.0.2.8, unknown"], expected("127.0.0.1")),
            // Entries of the client need not be valid text.
            ("127.0.0.1", &["\u{ff}, 192.0.2.8"], expected("192.0.2.8")),
        ] {
            let found = client_address("x-forwarded-for", peer, forwarded);
            assert_eq!(found, client, "{peer} {forwarded:?}");
        }
    }

    #[test]
    fn addresses_are_read_in_all_forms_of_proxies() {
        for (header, entry, client) in [
            ("x-forwarded-for", "192.0.2.8:4711", "192.0.2.8"),
            ("x-forwarded-for", "2001:db8::8", "2001:db8::8"),
            ("x-forwarded-for", "[2001:db8::8]", "2001:db8::8"),
            ("x-forwarded-for", "\"[2001:db8::8]:4711\"", "2001:db8::8"),
            ("x-real-ip", "192.0.2.8", "192.0.2.8"),
            ("forwarded", "for=192.0.2.8;proto=https", "192.0.2.8"),
            (
                "forwarded",
                "by=10.0.0.1; For=\"[2001:db8::8]:4711\"",
                "2001:db8::8",
            ),
            (
                "forwarded",
                "for=192.0.2.1, for=\"192.0.2.8:80\"",
                "192.0.2.8",
            ),
            // The proxy hides its client, or writes something else.
            ("forwarded", "for=_hidden", "127.0.0.1"),
            ("forwarded", "192.0.2.8", "127.0.0.1"),
            ("x-forwarded-for", "for=192.0.2.8", "127.0.0.1"),
        ] {
            let found = client_address(header, "127.0.0.1", &[entry]);
            assert_eq!(found.as_deref(), Some(client), "{header}: {entry}");
        }
    }

    #[test]
    fn networks_are_written_as_they_were_read() {
        for text in ["127.0.0.1", "::1", "10.0.0.0/8", "fd00::/8"] {
            assert_eq!(text.parse::<ProxyNetwork>().unwrap().to_string(), text);
        }
        for text in ["", "10.0.0.1/33", "proxy", "10.0.0"] {
            assert!(text.parse::<ProxyNetwork>().is_err(), "{text}");
        }
    }
}
