//! Who counts as one, where somebody's share is counted.

use std::net::{IpAddr, Ipv4Addr};

/// Whoever has one IPv6 address has all 2⁶⁴ of its network, so these count as one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Network {
    /// All of an address of version 4.
    V4(Ipv4Addr),
    /// The first half of an address of version 6.
    V6([u16; 4]),
}

impl Network {
    /// Where an address is.
    pub fn of(address: IpAddr) -> Self {
        match address.to_canonical() {
            IpAddr::V4(address) => Self::V4(address),
            IpAddr::V6(address) => {
                let [a, b, c, d, ..] = address.segments();
                Self::V6([a, b, c, d])
            }
        }
    }
}
