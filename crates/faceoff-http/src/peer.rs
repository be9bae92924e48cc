//! The other end of a connection, which may be a proxy.

use crate::proxies::TrustedProxies;
use axum::http::HeaderMap;
use std::{net::IpAddr, sync::Arc};

/// The other end of a connection.
#[derive(Debug, Clone)]
pub(crate) struct Peer {
    pub(crate) address: IpAddr,
    pub(crate) proxies: Arc<TrustedProxies>,
}

impl Peer {
    /// The address of the client; `None` if a trusted proxy names none.
    pub(crate) fn client_address(&self, headers: &HeaderMap) -> Option<IpAddr> {
        self.proxies.client_address(self.address, headers)
    }
}
