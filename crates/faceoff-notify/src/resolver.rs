//! Resolution of webhooks' host names. The client connects to exactly the addresses that were checked, even if the name
//! resolves to others a moment later.

use crate::address::{NotPublic, WebhookRules};
use reqwest::dns::{Addrs, Name, Resolve, Resolving};
use std::{net::SocketAddr, sync::Arc};

/// Why a host name is rejected.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ResolveError {
    #[error("the host name cannot be resolved")]
    Unknown(#[source] std::io::Error),
    #[error("the host name resolves to {0}, expected an address on the Internet")]
    NotPublic(NotPublic),
}

/// Resolves host names and checks all their addresses.
#[derive(Debug, Clone)]
pub(crate) struct CheckedResolver(pub(crate) Arc<WebhookRules>);

impl Resolve for CheckedResolver {
    fn resolve(&self, name: Name) -> Resolving {
        let rules = Arc::clone(&self.0);
        Box::pin(async move {
            let addresses = tokio::net::lookup_host((name.as_str(), 0)).await;
            let addresses: Vec<SocketAddr> = addresses.map_err(ResolveError::Unknown)?.collect();
            // One private address is enough to refuse: the name's owner may want the server to connect to a private network.
            for address in &addresses {
                rules
                    .check_address(address.ip())
                    .map_err(ResolveError::NotPublic)?;
            }
            let addresses: Addrs = Box::new(addresses.into_iter());
            Ok(addresses)
        })
    }
}
