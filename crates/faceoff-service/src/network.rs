//! The network of an IP address: limits per client count all addresses of a network together.

use axum::{extract::FromRequestParts, http::request::Parts};
use std::{
    convert::Infallible,
    net::{IpAddr, Ipv4Addr},
};

/// The network of the client that sent a request; `None` if a trusted proxy does not name the client.
#[derive(Debug, Clone, Copy)]
pub struct ClientNetwork(pub Option<Network>);

/// Addresses that count as one client. A client with one IPv6 address can usually use all 2⁶⁴ addresses of its network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Network {
    /// A single IPv4 address.
    V4(Ipv4Addr),
    /// The first 64 bits of an IPv6 address, in groups of 16 bits.
    V6([u16; 4]),
}

impl<S: Send + Sync> FromRequestParts<S> for ClientNetwork {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Infallible> {
        Ok(Self(parts.extensions.get::<Network>().copied()))
    }
}

impl Network {
    /// The network that an address belongs to.
    pub fn from_address(address: IpAddr) -> Self {
        match address.to_canonical() {
            IpAddr::V4(address) => Self::V4(address),
            IpAddr::V6(address) => {
                let [a, b, c, d, ..] = address.segments();
                Self::V6([a, b, c, d])
            }
        }
    }
}
