//! Limits the open connections of each client network: one IPv4 address, or one IPv6 /64.

use crate::proxies::ProxyNetwork;
use faceoff_service::network::Network;
use std::{
    collections::HashMap,
    net::IpAddr,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

/// Counts the open connections of each network.
#[derive(Debug)]
pub(super) struct ConnectionQuota {
    max_per_network: usize,
    exempt: Vec<ProxyNetwork>,
    open: Mutex<HashMap<Network, usize>>,
}

/// An open connection, until it is dropped.
#[derive(Debug)]
pub(super) struct ConnectionPermit {
    /// The quota and network that count it. `None` for an exempt address.
    counted_in: Option<(Arc<ConnectionQuota>, Network)>,
}

impl ConnectionQuota {
    pub(super) fn new(max_per_network: usize, exempt: Vec<ProxyNetwork>) -> Self {
        Self {
            max_per_network,
            exempt,
            open: Mutex::default(),
        }
    }

    /// A permit for one connection of the address, or `None` if its network has reached the limit.
    pub(super) fn acquire(self: &Arc<Self>, address: IpAddr) -> Option<ConnectionPermit> {
        if ProxyNetwork::any_contains(&self.exempt, address) {
            return Some(ConnectionPermit { counted_in: None });
        }
        let network = Network::from_address(address);
        let mut open = self.lock_open();
        let count = open.entry(network).or_default();
        if *count >= self.max_per_network {
            return None;
        }
        *count += 1;
        Some(ConnectionPermit {
            counted_in: Some((Arc::clone(self), network)),
        })
    }

    /// Ignores poisoning: the counts are consistent even after a panic.
    fn lock_open(&self) -> MutexGuard<'_, HashMap<Network, usize>> {
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for ConnectionPermit {
    fn drop(&mut self) {
        let Some((quota, network)) = self.counted_in.take() else {
            return;
        };
        let mut open = quota.lock_open();
        if let Some(count) = open.get_mut(&network) {
            *count -= 1;
            if *count == 0 {
                open.remove(&network);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(text: &str) -> IpAddr {
        text.parse().expect("a test's address")
    }

    #[test]
    fn connections_are_limited_per_address_and_ipv6_network() {
        let quota = Arc::new(ConnectionQuota::new(2, vec![address("10.0.0.9").into()]));
        let acquire = |text| quota.acquire(address(text));
        let permits = [acquire("10.0.0.1"), acquire("::ffff:10.0.0.1")];
        assert!(permits.iter().all(Option::is_some));
        assert!(acquire("10.0.0.1").is_none());
        assert!(acquire("10.0.0.2").is_some());
        let network = [acquire("2001:db8:0:1::1"), acquire("2001:db8:0:1:ffff::2")];
        assert!(network.iter().all(Option::is_some));
        assert!(acquire("2001:db8:0:1::3").is_none(), "the same /64");
        assert!(acquire("2001:db8:0:2::1").is_some(), "another /64");
        let exempt: Vec<_> = (0..10).map(|_| acquire("10.0.0.9")).collect();
        assert!(exempt.iter().all(Option::is_some));
        drop((permits, network));
        assert!(acquire("10.0.0.1").is_some());
        assert!(
            quota.lock_open().is_empty(),
            "closed connections are not counted"
        );
    }
}
