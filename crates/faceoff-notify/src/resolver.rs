//! Resolution of webhooks' host names. The client connects to the addresses that were checked, even if the name resolves
//! otherwise a moment later.

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
            let found = tokio::net::lookup_host((name.as_str(), 0)).await;
            let found: Vec<SocketAddr> = found.map_err(ResolveError::Unknown)?.collect();
            // One private address is enough to refuse: the owner may want the server to reach it.
            for address in &found {
                rules
                    .check_address(address.ip())
                    .map_err(ResolveError::NotPublic)?;
            }
            let found: Addrs = Box::new(found.into_iter());
            Ok(found)
        })
    }
}
