//! Rate limits: how many requests per second one network address and one token may make. A costly request counts as several.

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
    num::NonZeroU32,
    sync::atomic::{AtomicU32, Ordering},
};
use uuid::Uuid;

/// A mean rate of requests, and how many may arrive at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RateLimit {
    /// Mean number of requests per second.
    pub per_s: NonZeroU32,
    /// Largest number of requests at once, after a pause.
    pub burst: NonZeroU32,
}

/// The rate limits of the server; `None`: unlimited.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct RateLimits {
    /// For each IPv4 address or IPv6 network of 64 bits. Callers whose tokens were verified recently have this limit each for themselves:
    /// the students of a class may share an address. The address of a trusted proxy is not limited.
    pub address: Option<RateLimit>,
    /// Per token or session, from any address.
    pub token: Option<RateLimit>,
    /// Changes of a team per UTC day.
    pub team_changes_per_day: Option<NonZeroU32>,
}

/// Number of requests after which clients without recent requests are removed from memory.
const CLEANUP_INTERVAL: u32 = 4096;

/// Whose requests are counted together, before the request is authenticated.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum RequestSource {
    Network(Network),
    /// A user or team with a token that was verified recently; `None`: the operator.
    Caller(Option<Uuid>),
}

/// Counts recent requests by network and by token.
#[derive(Debug)]
pub struct RequestLimiter {
    sources: Option<KeyedLimiter<RequestSource>>,
    tokens: Option<KeyedLimiter<TokenId>>,
}

impl RequestLimiter {
    /// A limiter without recorded requests.
    pub fn new(limits: RateLimits) -> Self {
        Self {
            sources: limits.address.map(KeyedLimiter::new),
            tokens: limits.token.map(KeyedLimiter::new),
        }
    }

    /// Counts a request, as `cost` requests.
    ///
    /// # Errors
    /// [`ProblemKind::TooManyRequests`].
    pub fn check_source(&self, source: &RequestSource, cost: NonZeroU32) -> Result<(), Problem> {
        let name = match source {
            RequestSource::Network(_) => "an address",
            RequestSource::Caller(_) => "a signed-in caller",
        };
        match &self.sources {
            Some(limiter) => limiter.check(source, cost, name),
            None => Ok(()),
        }
    }

    /// Counts a request with a valid token. Invalid ones are never counted, so they cannot fill the memory.
    ///
    /// # Errors
    /// [`ProblemKind::TooManyRequests`].
    pub(crate) fn check_token(&self, token: TokenId) -> Result<(), Problem> {
        match &self.tokens {
            Some(limiter) => limiter.check(&token, NonZeroU32::MIN, "a token"),
            None => Ok(()),
        }
    }
}

/// A limiter with a separate count for each client `K`.
#[derive(Debug)]
struct KeyedLimiter<K: Hash + Eq + Clone> {
    rate: RateLimit,
    limiter: DefaultKeyedRateLimiter<K>,
    /// Number of requests since clients were last removed from memory.
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

    /// Counts a request as `cost` requests, at most as many as are allowed at once; `client_kind` names the client in the message
    /// of a refusal.
    fn check(&self, client: &K, cost: NonZeroU32, client_kind: &str) -> Result<(), Problem> {
        if self.since_cleanup.fetch_add(1, Ordering::Relaxed) >= CLEANUP_INTERVAL {
            self.since_cleanup.store(0, Ordering::Relaxed);
            self.limiter.retain_recent();
        }
        let RateLimit { per_s, burst } = self.rate;
        let checked = self.limiter.check_key_n(client, cost.min(burst));
        let checked = checked.expect("the cost is at most the burst");
        checked.map_err(|rejection| {
            let wait = rejection.wait_time_from(DefaultClock::default().now());
            Problem::new(
                ProblemKind::TooManyRequests,
                format!(
                    "{client_kind} may make {per_s} requests per second on average, and {burst} at once (costly ones count as several); \
                     wait, and poll less often: follow the event stream (GET /api/v1/events/stream) instead"
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

    fn network(address: &str) -> RequestSource {
        RequestSource::Network(Network::from_address(address.parse().unwrap()))
    }

    #[test]
    fn network_shares_one_rate_limit() {
        let rate = RateLimit {
            per_s: NonZeroU32::MIN,
            burst: NonZeroU32::new(1000).unwrap(),
        };
        let limiter = RequestLimiter::new(RateLimits {
            address: Some(rate),
            ..RateLimits::default()
        });
        let check = |address: &str| limiter.check_source(&network(address), NonZeroU32::MIN);
        // The loop takes much less than the thousand seconds after which a burst is available again.
        let refused = (0..1500).filter(|_| check("2001:db8::1").is_err()).count();
        assert!((1..=500).contains(&refused), "{refused}");
        assert!(check("2001:db8::2").is_err(), "the same network");
        assert!(check("2001:db8:0:1::1").is_ok());
        assert!(check("192.0.2.1").is_ok());
        let problem = check("2001:db8::1").unwrap_err();
        assert_eq!(problem.kind(), ProblemKind::TooManyRequests);
        // A costly request counts as several, and one that costs more than the burst can still be made.
        for (address, cost, expected) in [("192.0.2.2", 10, 50..=150), ("192.0.2.3", 5000, 1..=2)] {
            let cost = NonZeroU32::new(cost).unwrap();
            let source = network(address);
            let made = (0..1500).filter(|_| limiter.check_source(&source, cost).is_ok());
            let made = made.count();
            assert!(expected.contains(&made), "{address} made {made}");
        }
    }
}
