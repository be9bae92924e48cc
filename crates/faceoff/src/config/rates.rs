//! `[rates]`: how many requests an address or a token, and how many changes a team may send.

use faceoff_http::{RateLimit, RateLimits};
use serde::{Deserialize, Serialize};
use std::num::NonZeroU32;

/// `[rates]`: limits of requests. 0 requests per second means no limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RatesConfig {
    /// Mean number of requests per second of one address or IPv6 network of 64 bits.
    pub address_per_s: u32,
    /// Largest burst: requests at once after a pause.
    pub address_burst: NonZeroU32,
    /// Mean number of requests per second with one token or session.
    pub token_per_s: u32,
    /// Largest burst.
    pub token_burst: NonZeroU32,
    /// Number of changes (requests other than reads) that a team may make per UTC day; 0: no limit.
    pub team_changes_per_day: u32,
}

impl Default for RatesConfig {
    fn default() -> Self {
        const BURST: NonZeroU32 = NonZeroU32::new(1000).expect("1000 is not 0");
        Self {
            address_per_s: 100,
            address_burst: BURST,
            token_per_s: 100,
            token_burst: BURST,
            team_changes_per_day: 2000,
        }
    }
}

impl RatesConfig {
    /// The limits for the HTTP server.
    #[must_use]
    pub fn limits(&self) -> RateLimits {
        let rate = |per_s, burst| NonZeroU32::new(per_s).map(|per_s| RateLimit { per_s, burst });
        RateLimits {
            address: rate(self.address_per_s, self.address_burst),
            token: rate(self.token_per_s, self.token_burst),
            team_changes_per_day: NonZeroU32::new(self.team_changes_per_day),
        }
    }
}
