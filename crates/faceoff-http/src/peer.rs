//! Who is at the other end of a request, as far as an address tells.

use axum::http::HeaderMap;
use std::{net::IpAddr, sync::Arc};

/// Where a proxy writes who asked it: a list, to whose end each proxy adds one.
const FORWARDED_FOR: &str = "x-forwarded-for";

/// The other end of a connection.
#[derive(Debug, Clone)]
pub(crate) struct Peer {
    pub(crate) address: IpAddr,
    /// Addresses of proxies of ours, whose word for others' addresses is taken.
    pub(crate) proxies: Arc<[IpAddr]>,
}

impl Peer {
    /// Who asks: the peer, or the one for whom a proxy of ours says it asks. None: the proxy's own host, or somebody of whom
    /// the proxy says nothing.
    pub(crate) fn asks(&self, headers: &HeaderMap) -> Option<IpAddr> {
        let is_ours = |address: &IpAddr| self.proxies.contains(&address.to_canonical());
        if !is_ours(&self.address) {
            return Some(self.address);
        }
        // What stands before the last proxy of ours is the visitor's own word, and may be anything.
        let told = headers.get_all(FORWARDED_FOR).iter();
        let told: Vec<&[u8]> = told
            .flat_map(|value| value.as_bytes().split(|byte| *byte == b','))
            .collect();
        let address = |told: &[u8]| {
            std::str::from_utf8(told)
                .ok()?
                .trim()
                .parse::<IpAddr>()
                .ok()
        };
        for told in told.into_iter().rev() {
            match address(told) {
                Some(address) if is_ours(&address) => {}
                Some(address) => return Some(address),
                // A proxy that says something else asks for somebody; all of these share its own address.
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

    fn asks(peer: &str, forwarded: &[&str]) -> Option<String> {
        let peer = Peer {
            address: peer.parse().unwrap(),
            proxies: ["127.0.0.1", "10.0.0.9"]
                .map(|address| address.parse().unwrap())
                .into(),
        };
        let mut headers = HeaderMap::new();
        for value in forwarded {
            let value = HeaderValue::from_bytes(value.as_bytes()).unwrap();
            headers.append(FORWARDED_FOR, value);
        }
        peer.asks(&headers).map(|address| address.to_string())
    }

    #[test]
    fn a_proxy_of_ours_is_believed_and_nobody_else() {
        let found = |address: &str| Some(address.to_owned());
        assert_eq!(asks("192.0.2.1", &[]), found("192.0.2.1"));
        assert_eq!(asks("192.0.2.1", &["192.0.2.7"]), found("192.0.2.1"));
        assert_eq!(asks("127.0.0.1", &[]), None);
        assert_eq!(asks("::ffff:127.0.0.1", &["192.0.2.7"]), found("192.0.2.7"));
        // The visitor said 192.0.2.7, which is not to be believed.
        assert_eq!(
            asks("127.0.0.1", &["192.0.2.7, 192.0.2.8"]),
            found("192.0.2.8")
        );
        assert_eq!(
            asks("127.0.0.1", &["192.0.2.7", "192.0.2.8"]),
            found("192.0.2.8")
        );
        // Two proxies of ours, one behind the other.
        assert_eq!(
            asks("127.0.0.1", &["192.0.2.8, 10.0.0.9"]),
            found("192.0.2.8")
        );
        // What is no address ends what is believed.
        assert_eq!(
            asks("127.0.0.1", &["192.0.2.8, unknown"]),
            found("127.0.0.1")
        );
        // What the visitor wrote before it may be no text at all.
        assert_eq!(
            asks("127.0.0.1", &["\u{ff}, 192.0.2.8"]),
            found("192.0.2.8")
        );
    }
}
