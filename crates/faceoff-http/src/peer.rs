//! The client address of a request, also behind trusted proxies.

use axum::http::HeaderMap;
use std::{net::IpAddr, sync::Arc};

/// The header in which proxies list client addresses: each proxy appends the address that it was called from.
const FORWARDED_FOR: &str = "x-forwarded-for";

/// The other end of a connection.
#[derive(Debug, Clone)]
pub(crate) struct Peer {
    pub(crate) address: IpAddr,
    /// Addresses of our own proxies, whose `X-Forwarded-For` is believed.
    pub(crate) trusted_proxies: Arc<[IpAddr]>,
}

impl Peer {
    /// The address of the client: the peer's, or the one for which a trusted proxy forwards the request. `None` if a trusted
    /// proxy names no client: the header is absent, or lists only trusted proxies.
    pub(crate) fn client_address(&self, headers: &HeaderMap) -> Option<IpAddr> {
        let is_trusted_proxy =
            |address: &IpAddr| self.trusted_proxies.contains(&address.to_canonical());
        if !is_trusted_proxy(&self.address) {
            return Some(self.address);
        }
        // Entries before the last trusted proxy's come from the client, and may be forged.
        let entries = headers.get_all(FORWARDED_FOR).iter();
        let entries: Vec<&[u8]> = entries
            .flat_map(|value| value.as_bytes().split(|byte| *byte == b','))
            .collect();
        let address = |entry: &[u8]| {
            std::str::from_utf8(entry)
                .ok()?
                .trim()
                .parse::<IpAddr>()
                .ok()
        };
        for entry in entries.into_iter().rev() {
            match address(entry) {
                Some(address) if is_trusted_proxy(&address) => {}
                Some(address) => return Some(address),
                // The entry is no address. All clients with such an entry are counted under the proxy's address.
                None => return Some(self.address),
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderValue;

    fn client_address(peer: &str, forwarded: &[&str]) -> Option<String> {
        let peer = Peer {
            address: peer.parse().unwrap(),
            trusted_proxies: ["127.0.0.1", "10.0.0.9"]
                .map(|address| address.parse().unwrap())
                .into(),
        };
        let mut headers = HeaderMap::new();
        for value in forwarded {
            let value = HeaderValue::from_bytes(value.as_bytes()).unwrap();
            headers.append(FORWARDED_FOR, value);
        }
        peer.client_address(&headers)
            .map(|address| address.to_string())
    }

    #[test]
    fn only_trusted_proxies_are_believed() {
        let expected = |address: &str| Some(address.to_owned());
        assert_eq!(client_address("192.0.2.1", &[]), expected("192.0.2.1"));
        assert_eq!(
            client_address("192.0.2.1", &["192.0.2.7"]),
            expected("192.0.2.1")
        );
        assert_eq!(client_address("127.0.0.1", &[]), None);
        assert_eq!(
            client_address("::ffff:127.0.0.1", &["192.0.2.7"]),
            expected("192.0.2.7")
        );
        // 192.0.2.7 comes from the client, and is not believed.
        assert_eq!(
            client_address("127.0.0.1", &["192.0.2.7, 192.0.2.8"]),
            expected("192.0.2.8")
        );
        assert_eq!(
            client_address("127.0.0.1", &["192.0.2.7", "192.0.2.8"]),
            expected("192.0.2.8")
        );
        // Two trusted proxies, one behind the other.
        assert_eq!(
            client_address("127.0.0.1", &["192.0.2.8, 10.0.0.9"]),
            expected("192.0.2.8")
        );
        // An entry that is no address ends the search.
        assert_eq!(
            client_address("127.0.0.1", &["192.0.2.8, unknown"]),
            expected("127.0.0.1")
        );
        // Entries of the client need not be valid text.
        assert_eq!(
            client_address("127.0.0.1", &["\u{ff}, 192.0.2.8"]),
            expected("192.0.2.8")
        );
    }
}
