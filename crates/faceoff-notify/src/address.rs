//! Addresses that webhooks may have: public ones on the Internet, and those that the operator of the server allows. All
//! others are refused, so that a webhook cannot be used to attack the operator's network through the server.

use ipnet::{IpNet, Ipv4Net, Ipv6Net};
use reqwest::Url;
use serde::{Deserialize, Serialize};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};

const MAX_URL_BYTES: usize = 1000;

/// Permitted addresses of webhooks.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WebhookRules {
    /// Whether webhooks are sent at all.
    pub enabled: bool,
    /// Whether plain HTTP is allowed.
    pub allow_http: bool,
    /// Allowed ports; empty: any.
    pub ports: Vec<u16>,
    /// Private networks that are allowed nevertheless.
    pub allow_private: Vec<IpNet>,
}

impl Default for WebhookRules {
    fn default() -> Self {
        Self {
            enabled: true,
            allow_http: false,
            ports: vec![443, 8443],
            allow_private: Vec::new(),
        }
    }
}

/// Why an address is not public.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NotPublic {
    #[error("a loopback address")]
    Loopback,
    /// In the operator's or a neighbouring network.
    #[error("an address of a private network")]
    Private,
    /// Local to a network segment: routers, cloud metadata.
    #[error("a link-local address")]
    LinkLocal,
    #[error("a multicast or broadcast address")]
    Multicast,
    /// Not assigned, or reserved for documentation, benchmarks or address translation.
    #[error("an address that is not assigned to any host on the Internet")]
    Reserved,
}

/// The network `a.b.c.0/prefix_bits`.
const fn v4(a: u8, b: u8, c: u8, prefix_bits: u8) -> Ipv4Net {
    Ipv4Net::new_assert(Ipv4Addr::new(a, b, c, 0), prefix_bits)
}

/// The network `a:b::/prefix_bits`.
const fn v6(a: u16, b: u16, prefix_bits: u8) -> Ipv6Net {
    Ipv6Net::new_assert(Ipv6Addr::new(a, b, 0, 0, 0, 0, 0, 0), prefix_bits)
}

/// Entries of the registry of special-purpose IPv4 addresses (RFC 6890 and later) that are not globally reachable.
const SPECIAL_V4: [(Ipv4Net, NotPublic); 16] = [
    (v4(0, 0, 0, 8), NotPublic::Reserved),
    (v4(10, 0, 0, 8), NotPublic::Private),
    (v4(100, 64, 0, 10), NotPublic::Private), // carrier-grade NAT
    (v4(127, 0, 0, 8), NotPublic::Loopback),
    (v4(169, 254, 0, 16), NotPublic::LinkLocal),
    (v4(172, 16, 0, 12), NotPublic::Private),
    (v4(192, 0, 0, 24), NotPublic::Reserved),
    (v4(192, 0, 2, 24), NotPublic::Reserved), // documentation
    (v4(192, 88, 99, 24), NotPublic::Reserved), // former 6to4 relays
    (v4(192, 168, 0, 16), NotPublic::Private),
    (v4(198, 18, 0, 15), NotPublic::Private), // benchmarks
    (v4(198, 51, 100, 24), NotPublic::Reserved), // documentation
    (v4(203, 0, 113, 24), NotPublic::Reserved), // documentation
    (v4(224, 0, 0, 4), NotPublic::Multicast),
    (v4(255, 255, 255, 24), NotPublic::Multicast),
    (v4(240, 0, 0, 4), NotPublic::Reserved),
];

/// Special-purpose IPv6 networks. Outside of 2000::/3 nothing is public.
const SPECIAL_V6: [(Ipv6Net, NotPublic); 7] = [
    (v6(0xfc00, 0, 7), NotPublic::Private),
    (v6(0xfe80, 0, 10), NotPublic::LinkLocal),
    (v6(0xff00, 0, 8), NotPublic::Multicast),
    (v6(0x2001, 0, 23), NotPublic::Reserved), // Teredo and other protocols
    (v6(0x2001, 0xdb8, 32), NotPublic::Reserved), // documentation
    (v6(0x2002, 0, 16), NotPublic::Reserved), // 6to4: contains an IPv4 address
    (v6(0x3fff, 0, 20), NotPublic::Reserved), // documentation
];

/// Global unicast addresses of IPv6.
const GLOBAL_UNICAST_V6: Ipv6Net = v6(0x2000, 0, 3);

fn check_public(address: IpAddr) -> Result<(), NotPublic> {
    match address {
        IpAddr::V4(address) => SPECIAL_V4
            .iter()
            .find(|(net, _)| net.contains(&address))
            .map_or(Ok(()), |(_, reason)| Err(*reason)),
        IpAddr::V6(Ipv6Addr::LOCALHOST) => Err(NotPublic::Loopback),
        IpAddr::V6(address) => {
            let found = SPECIAL_V6.iter().find(|(net, _)| net.contains(&address));
            match found {
                Some((_, reason)) => Err(*reason),
                None if GLOBAL_UNICAST_V6.contains(&address) => Ok(()),
                None => Err(NotPublic::Reserved),
            }
        }
    }
}

impl WebhookRules {
    /// Checks that messages may be sent to an address.
    ///
    /// # Errors
    /// If the address is not public and not allowed by the operator.
    pub fn check_address(&self, address: IpAddr) -> Result<(), NotPublic> {
        // An IPv4-mapped IPv6 address leads to the same host.
        let address = address.to_canonical();
        if self.allow_private.iter().any(|net| net.contains(&address)) {
            return Ok(());
        }
        check_public(address)
    }

    /// Parses and checks a webhook's URL. Host names are resolved only when a message is sent.
    ///
    /// # Errors
    /// A text with what was expected and what came.
    pub fn check_url(&self, text: &str) -> Result<Url, String> {
        if text.len() > MAX_URL_BYTES {
            return Err(format!(
                "expected at most {MAX_URL_BYTES} bytes, got {}",
                text.len()
            ));
        }
        let url = Url::parse(text).map_err(|error| {
            format!("expected a URL as https://example.org/faceoff, got {text:?}: {error}")
        })?;
        match url.scheme() {
            "https" => {}
            "http" if self.allow_http => {}
            other => {
                return Err(format!(
                    "expected a URL that begins with https://, got {other}:"
                ));
            }
        }
        if !url.username().is_empty() || url.password().is_some() {
            return Err(
                "expected no name and password in the URL: the signature identifies the sender"
                    .into(),
            );
        }
        if url.fragment().is_some() {
            return Err("expected no fragment (#…), which is never sent".into());
        }
        let port = url.port_or_known_default().unwrap_or_default();
        let has_default_port = url.port().is_none();
        if !has_default_port && !self.ports.is_empty() && !self.ports.contains(&port) {
            return Err(format!(
                "expected one of the ports {:?}, got {port}",
                self.ports
            ));
        }
        if let Some(address) = ip_address(&url) {
            self.check_address(address).map_err(|reason| {
                format!("expected an address on the Internet, got {reason}: {address}")
            })?;
        }
        Ok(url)
    }
}

/// The IP address in a URL, unless its host is a name.
pub(crate) fn ip_address(url: &Url) -> Option<IpAddr> {
    let host = url.host_str()?;
    let host = host.strip_prefix('[').unwrap_or(host);
    host.strip_suffix(']').unwrap_or(host).parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn special_purpose_addresses_are_not_public() {
        for public in [
            "1.1.1.1",
            "8.8.8.8",
            "100.63.255.255",
            "100.128.0.1",
            "172.15.0.1",
            "172.32.0.1",
            "192.0.1.1",
            "198.20.0.1",
            "223.255.255.255",
            "2606:4700:4700::1111",
            "2a00:1450::1",
            "::ffff:1.1.1.1",
        ] {
            let address = public.parse().unwrap();
            let checked = WebhookRules::default().check_address(address);
            assert_eq!(checked, Ok(()), "{public}");
        }
        for (private, reason) in [
            ("0.0.0.0", NotPublic::Reserved),
            ("0.1.2.3", NotPublic::Reserved),
            ("10.0.0.1", NotPublic::Private),
            ("100.64.0.1", NotPublic::Private),
            ("100.127.255.255", NotPublic::Private),
            ("127.0.0.1", NotPublic::Loopback),
            ("127.255.255.254", NotPublic::Loopback),
            ("169.254.169.254", NotPublic::LinkLocal),
            ("172.16.0.1", NotPublic::Private),
            ("172.31.255.255", NotPublic::Private),
            ("192.0.0.1", NotPublic::Reserved),
            ("192.0.2.1", NotPublic::Reserved),
            ("192.88.99.1", NotPublic::Reserved),
            ("192.168.1.1", NotPublic::Private),
            ("198.18.0.1", NotPublic::Private),
            ("198.19.255.255", NotPublic::Private),
            ("198.51.100.1", NotPublic::Reserved),
            ("203.0.113.1", NotPublic::Reserved),
            ("224.0.0.1", NotPublic::Multicast),
            ("239.255.255.255", NotPublic::Multicast),
            ("240.0.0.1", NotPublic::Reserved),
            ("255.255.255.255", NotPublic::Multicast),
            ("::", NotPublic::Reserved),
            ("::1", NotPublic::Loopback),
            ("::ffff:127.0.0.1", NotPublic::Loopback),
            ("::ffff:10.0.0.1", NotPublic::Private),
            ("::7f00:1", NotPublic::Reserved),
            ("64:ff9b::7f00:1", NotPublic::Reserved),
            ("100::1", NotPublic::Reserved),
            ("2001::1", NotPublic::Reserved),
            ("2001:db8::1", NotPublic::Reserved),
            ("2002:7f00:1::", NotPublic::Reserved),
            ("3fff::1", NotPublic::Reserved),
            ("fc00::1", NotPublic::Private),
            ("fdff::1", NotPublic::Private),
            ("fe80::1", NotPublic::LinkLocal),
            ("fec0::1", NotPublic::Reserved),
            ("ff02::1", NotPublic::Multicast),
        ] {
            let address = private.parse().unwrap();
            let checked = WebhookRules::default().check_address(address);
            assert_eq!(checked, Err(reason), "{private}");
        }
    }

    #[test]
    fn networks_allowed_by_the_operator_are_accepted() {
        let rules = WebhookRules {
            allow_private: vec!["10.1.0.0/16".parse().unwrap()],
            ..WebhookRules::default()
        };
        for (address, allowed) in [
            ("10.1.2.3", true),
            ("::ffff:10.1.2.3", true),
            ("10.2.0.1", false),
        ] {
            let checked = rules.check_address(address.parse().unwrap());
            assert_eq!(checked.is_ok(), allowed, "{address}");
        }
    }

    #[test]
    fn private_address_in_any_spelling_of_a_url_is_refused() {
        let rules = WebhookRules::default();
        for valid in [
            "https://example.org/faceoff?a=b",
            "https://example.org:8443/",
            "https://1.1.1.1/",
            "https://localhost/", // resolved when a message is sent
        ] {
            rules.check_url(valid).unwrap();
        }
        for (invalid, word) in [
            ("example.org", "https://example.org"),
            ("http://example.org/", "https"),
            ("ftp://example.org/", "https"),
            ("file:///etc/passwd", "https"),
            ("https://a:b@example.org/", "password"),
            ("https://example.org/#x", "fragment"),
            ("https://example.org:22/", "ports"),
            ("https://127.0.0.1/", "loopback"),
            ("https://127.1/", "loopback"),
            ("https://2130706433/", "loopback"),
            ("https://0x7f.0.0.1/", "loopback"),
            ("https://0177.0.0.1/", "loopback"),
            ("https://[::1]/", "loopback"),
            ("https://[::ffff:127.0.0.1]/", "loopback"),
            ("https://[fe80::1]/", "link-local"),
            ("https://169.254.169.254/latest/meta-data", "link-local"),
            ("https://0.0.0.0/", "not assigned"),
        ] {
            let error = rules.check_url(invalid).unwrap_err();
            assert!(error.contains(word), "{invalid}: {error}");
        }
        let long = format!("https://example.org/{}", "a".repeat(MAX_URL_BYTES));
        assert!(rules.check_url(&long).unwrap_err().contains("at most"));
        let http_rules = WebhookRules {
            allow_http: true,
            ..rules
        };
        http_rules.check_url("http://example.org/").unwrap();
    }
}
