//! Resolution of webhooks' host names. The client connects to exactly the addresses that were checked, even if the name
//! resolves to others a moment later.

use crate::address::{NotPublic, WebhookRules};
use reqwest::dns::{Addrs, Name, Resolve, Resolving};
use std::{error::Error as _, net::SocketAddr, sync::Arc};

/// Why a host name is rejected. The message is the same for all causes: the webhook's owner could find out which names exist in the
/// operator's network. The cause is in the server's log.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ResolveError {
    #[error("the host name has no address on the Internet")]
    Unknown(#[source] std::io::Error),
    #[error("the host name has no address on the Internet")]
    NotPublic(#[source] NotPublic),
}

async fn resolve(rules: &WebhookRules, name: &str) -> Result<Vec<SocketAddr>, ResolveError> {
    let addresses = tokio::net::lookup_host((name, 0)).await;
    let addresses: Vec<SocketAddr> = addresses.map_err(ResolveError::Unknown)?.collect();
    // One private address is enough to refuse: the name's owner may want the server to connect to a private network.
    for address in &addresses {
        rules
            .check_address(address.ip())
            .map_err(ResolveError::NotPublic)?;
    }
    Ok(addresses)
}

/// Resolves host names and checks all their addresses.
#[derive(Debug, Clone)]
pub(crate) struct CheckedResolver(pub(crate) Arc<WebhookRules>);

impl Resolve for CheckedResolver {
    fn resolve(&self, name: Name) -> Resolving {
        let rules = Arc::clone(&self.0);
        Box::pin(async move {
            let addresses = resolve(&rules, name.as_str()).await.inspect_err(|error| {
                let cause = error.source().map(ToString::to_string);
                tracing::info!(
                    name = name.as_str(),
                    cause,
                    "the host of a webhook is refused"
                );
            })?;
            let addresses: Addrs = Box::new(addresses.into_iter());
            Ok(addresses)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn refusal_does_not_say_whether_a_name_exists() {
        let rules = WebhookRules::default();
        let private = resolve(&rules, "localhost").await.unwrap_err();
        assert!(matches!(private, ResolveError::NotPublic(_)), "{private:?}");
        // Refused without a question to a name server.
        let unknown = resolve(&rules, "no host name").await.unwrap_err();
        assert!(matches!(unknown, ResolveError::Unknown(_)), "{unknown:?}");
        assert_eq!(private.to_string(), unknown.to_string());
    }
}
