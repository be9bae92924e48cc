//! Rate limits of requests, by address and by token.

use crate::{
    network::Network,
    problem::{Problem, ProblemKind},
};
use faceoff_types::TokenId;
use governor::{
    DefaultKeyedRateLimiter, Quota, RateLimiter,
    clock::{Clock as _, DefaultClock},
};
use std::{
    hash::Hash,
    net::IpAddr,
    num::NonZeroU32,
    sync::atomic::{AtomicU32, Ordering},
};

/// A mean rate, and a burst.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RateLimit {
    /// Mean number of requests per second.
    pub per_s: NonZeroU32,
    /// Requests at once, after a pause.
    pub burst: NonZeroU32,
}

/// The rate limits of the server; `None`: unlimited.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct RateLimits {
    /// Per IPv4 address or IPv6 network of 64 bits. The address of a trusted proxy is not limited.
    pub address: Option<RateLimit>,
    /// Per token or session, from any address.
    pub token: Option<RateLimit>,
}

/// Every so many requests, clients with a full allowance are dropped from memory.
const CLEANUP_INTERVAL: u32 = 4096;

/// Counts recent requests.
#[derive(Debug)]
pub struct RequestLimiter {
    addresses: Option<KeyedLimiter<Network>>,
    tokens: Option<KeyedLimiter<TokenId>>,
}

impl RequestLimiter {
    /// A limiter without recorded requests.
    pub fn new(limits: RateLimits) -> Self {
        Self {
            addresses: limits.address.map(KeyedLimiter::new),
            tokens: limits.token.map(KeyedLimiter::new),
        }
    }

    /// Counts a request from an address.
    ///
    /// # Errors
    /// [`ProblemKind::TooManyRequests`].
    pub fn check_address(&self, from: IpAddr) -> Result<(), Problem> {
        match &self.addresses {
            Some(counted) => counted.check(&Network::from_address(from), "an address"),
            None => Ok(()),
        }
    }

    /// Counts a request with a valid token. Invalid ones are never counted, so they cannot fill the memory.
    ///
    /// # Errors
    /// [`ProblemKind::TooManyRequests`].
    pub(crate) fn check_token(&self, token: TokenId) -> Result<(), Problem> {
        match &self.tokens {
            Some(counted) => counted.check(&token, "a token"),
            None => Ok(()),
        }
    }
}

#[derive(Debug)]
struct KeyedLimiter<K: Hash + Eq + Clone> {
    rate: RateLimit,
    limiter: DefaultKeyedRateLimiter<K>,
    since_cleanup: AtomicU32,
}

impl<K: Hash + Eq + Clone> KeyedLimiter<K> {
    fn new(rate: RateLimit) -> Self {
        let quota = Quota::per_second(rate.per_s).allow_burst(rate.burst);
        Self {
            rate,
            limiter: RateLimiter::keyed(quota),
            since_cleanup: AtomicU32::new(0),
        }
    }

    fn check(&self, client: &K, kind: &str) -> Result<(), Problem> {
        if self.since_cleanup.fetch_add(1, Ordering::Relaxed) >= CLEANUP_INTERVAL {
            self.since_cleanup.store(0, Ordering::Relaxed);
            self.limiter.retain_recent();
        }
        self.limiter.check_key(client).map_err(|early| {
            let wait = early.wait_time_from(DefaultClock::default().now());
            let RateLimit { per_s, burst } = self.rate;
            Problem::new(
                ProblemKind::TooManyRequests,
                format!(
                    "{kind} may make {per_s} requests per second on average, and {burst} at once; wait, and poll less often: \
                     follow the event stream (GET /api/v1/events/stream) instead"
                ),
            )
            .with("limit_per_s", per_s.get())
            .retry_after(wait.as_secs() + 1)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn network_shares_one_rate_limit() {
        let rate = RateLimit {
            per_s: NonZeroU32::MIN,
            burst: NonZeroU32::new(1000).unwrap(),
        };
        let limiter = RequestLimiter::new(RateLimits {
            address: Some(rate),
            token: None,
        });
        let check = |from: &str| limiter.check_address(from.parse().unwrap());
        // The loop takes much less than the thousand seconds after which a burst is available again.
        let refused = (0..1500).filter(|_| check("2001:db8::1").is_err()).count();
        assert!((1..=500).contains(&refused), "{refused}");
        assert!(check("2001:db8::2").is_err(), "the same network");
        assert!(check("2001:db8:0:1::1").is_ok());
        assert!(check("192.0.2.1").is_ok());
        let problem = check("2001:db8::1").unwrap_err();
        assert_eq!(problem.kind(), ProblemKind::TooManyRequests);
    }
}
