//! How many connections each address has.

use faceoff_service::network::Network;
use std::{
    collections::HashMap,
    net::IpAddr,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

/// The connections that are open, by whom.
#[derive(Debug)]
pub(super) struct Addresses {
    most: usize,
    exempt: Vec<IpAddr>,
    open: Mutex<HashMap<Network, usize>>,
}

/// An open connection, until it is dropped.
#[derive(Debug)]
pub(super) struct Seat {
    /// Where it is counted; that of an exempt address is not.
    counted: Option<(Arc<Addresses>, Network)>,
}

impl Addresses {
    pub(super) fn new(most: usize, exempt: Vec<IpAddr>) -> Self {
        Self {
            most,
            exempt,
            open: Mutex::default(),
        }
    }

    /// A seat, if the address has one left.
    pub(super) fn enter(self: &Arc<Self>, from: IpAddr) -> Option<Seat> {
        if self.exempt.contains(&from.to_canonical()) {
            return Some(Seat { counted: None });
        }
        let network = Network::of(from);
        let mut open = self.open();
        let of_network = open.entry(network).or_default();
        if *of_network >= self.most {
            return None;
        }
        *of_network += 1;
        Some(Seat {
            counted: Some((Arc::clone(self), network)),
        })
    }

    /// A number is whole whatever panicked beside it.
    fn open(&self) -> MutexGuard<'_, HashMap<Network, usize>> {
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        let Some((addresses, network)) = self.counted.take() else {
            return;
        };
        let mut open = addresses.open();
        if let Some(of_network) = open.get_mut(&network) {
            *of_network -= 1;
            if *of_network == 0 {
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
    fn an_address_and_an_ipv6_network_have_a_share() {
        let addresses = Arc::new(Addresses::new(2, vec![address("10.0.0.9")]));
        let enter = |text| addresses.enter(address(text));
        let held = [enter("10.0.0.1"), enter("::ffff:10.0.0.1")];
        assert!(held.iter().all(Option::is_some));
        assert!(enter("10.0.0.1").is_none());
        assert!(enter("10.0.0.2").is_some());
        let network = [enter("2001:db8:0:1::1"), enter("2001:db8:0:1:ffff::2")];
        assert!(network.iter().all(Option::is_some));
        assert!(enter("2001:db8:0:1::3").is_none(), "the same /64");
        assert!(enter("2001:db8:0:2::1").is_some(), "another /64");
        let exempt: Vec<_> = (0..10).map(|_| enter("10.0.0.9")).collect();
        assert!(exempt.iter().all(Option::is_some));
        drop((held, network));
        assert!(enter("10.0.0.1").is_some());
        assert!(addresses.open().is_empty(), "nobody is remembered");
    }
}
