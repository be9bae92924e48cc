//! How often somebody may ask.

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

/// So many requests in the mean, and so many at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rate {
    /// Requests per second, in the mean.
    pub per_s: NonZeroU32,
    /// Requests at once, of somebody who has asked for nothing for long.
    pub burst: NonZeroU32,
}

/// How often somebody may ask; none: as often as they like.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct RateLimits {
    /// Whoever has one address, or IPv6 network of 64 bits. A proxy's own host is not counted.
    pub address: Option<Rate>,
    /// Whoever has one token, or session, from wherever.
    pub token: Option<Rate>,
}

/// After so many requests those are forgotten who may ask as much as anybody again.
const FORGET_EVERY: u32 = 4096;

/// Who has asked how often of late.
#[derive(Debug)]
pub struct Rates {
    addresses: Option<Counted<Network>>,
    tokens: Option<Counted<TokenId>>,
}

impl Rates {
    /// With nobody counted yet.
    pub fn new(limits: RateLimits) -> Self {
        Self {
            addresses: limits.address.map(Counted::new),
            tokens: limits.token.map(Counted::new),
        }
    }

    /// Counts a request from an address.
    ///
    /// # Errors
    /// [`ProblemKind::TooManyRequests`].
    pub fn check_address(&self, from: IpAddr) -> Result<(), Problem> {
        match &self.addresses {
            Some(counted) => counted.check(&Network::of(from), "an address"),
            None => Ok(()),
        }
    }

    /// Counts a request with a token, which is a good one: strangers cannot fill the memory with others.
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
struct Counted<K: Hash + Eq + Clone> {
    rate: Rate,
    limiter: DefaultKeyedRateLimiter<K>,
    since_forgotten: AtomicU32,
}

impl<K: Hash + Eq + Clone> Counted<K> {
    fn new(rate: Rate) -> Self {
        let quota = Quota::per_second(rate.per_s).allow_burst(rate.burst);
        Self {
            rate,
            limiter: RateLimiter::keyed(quota),
            since_forgotten: AtomicU32::new(0),
        }
    }

    fn check(&self, who: &K, whose: &str) -> Result<(), Problem> {
        if self.since_forgotten.fetch_add(1, Ordering::Relaxed) >= FORGET_EVERY {
            self.since_forgotten.store(0, Ordering::Relaxed);
            self.limiter.retain_recent();
        }
        self.limiter.check_key(who).map_err(|early| {
            let wait = early.wait_time_from(DefaultClock::default().now());
            let Rate { per_s, burst } = self.rate;
            Problem::new(
                ProblemKind::TooManyRequests,
                format!(
                    "{whose} may make {per_s} requests per second in the mean, and {burst} at once; wait, and ask less often: \
                     follow events instead of asking again and again"
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
    fn each_address_has_its_own_share_and_a_network_is_one() {
        let rate = Rate {
            per_s: NonZeroU32::MIN,
            burst: NonZeroU32::new(1000).unwrap(),
        };
        let rates = Rates::new(RateLimits {
            address: Some(rate),
            token: None,
        });
        let ask = |from: &str| rates.check_address(from.parse().unwrap());
        // Whatever passes meanwhile, it is less than the thousand seconds that a burst takes to come back.
        let refused = (0..1500).filter(|_| ask("2001:db8::1").is_err()).count();
        assert!((1..=500).contains(&refused), "{refused}");
        assert!(ask("2001:db8::2").is_err(), "the same network");
        assert!(ask("2001:db8:0:1::1").is_ok());
        assert!(ask("192.0.2.1").is_ok());
        let problem = ask("2001:db8::1").unwrap_err();
        assert_eq!(problem.kind(), ProblemKind::TooManyRequests);
    }
}
