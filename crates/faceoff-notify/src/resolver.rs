//! Names of webhooks, looked up by us: what is connected to is what was checked, whatever the name means a moment later.

use crate::address::{NotPublic, WebhookRules};
use reqwest::dns::{Addrs, Name, Resolve, Resolving};
use std::{net::SocketAddr, sync::Arc};

/// Why a name leads nowhere.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ResolveError {
    #[error("the name is not known")]
    Unknown(#[source] std::io::Error),
    #[error("the name leads to {0}, and must lead to the Internet")]
    NotPublic(NotPublic),
}

/// Looks names up and checks every address of each.
#[derive(Debug, Clone)]
pub(crate) struct CheckedResolver(pub(crate) Arc<WebhookRules>);

impl Resolve for CheckedResolver {
    fn resolve(&self, name: Name) -> Resolving {
        let rules = Arc::clone(&self.0);
        Box::pin(async move {
            let found = tokio::net::lookup_host((name.as_str(), 0)).await;
            let found: Vec<SocketAddr> = found.map_err(ResolveError::Unknown)?.collect();
            // One that is not public is enough: whoever names it wants us to reach it.
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
