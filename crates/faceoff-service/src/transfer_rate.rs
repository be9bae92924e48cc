//! Minimum transfer rate of a peer: a connection that is too slow for too long is closed.

use std::time::Duration;

/// The minimum transfer rate of a peer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MinTransferRate {
    /// Mean rate in bytes per second.
    pub bytes_per_s: u64,
    /// How long the peer may fall behind the mean: at the start, and again after it has caught up.
    pub grace: Duration,
}

/// Measures how far a peer is behind its minimum rate. Only the time counts in which the server waits for the peer.
/// Waiting uses up the grace; each byte adds the time that it may take, up to the whole grace. So a pause costs as much
/// as a trickle with the same mean, and the server's own work costs nothing.
#[derive(Debug)]
pub struct TransferRateGuard {
    rate: MinTransferRate,
    remaining: Duration,
}

impl TransferRateGuard {
    /// A guard with the whole grace.
    pub const fn new(rate: MinTransferRate) -> Self {
        Self {
            rate,
            remaining: rate.grace,
        }
    }

    /// Remaining time if the peer transfers nothing.
    pub const fn remaining(&self) -> Duration {
        self.remaining
    }

    /// Subtracts time in which the server waited for the peer.
    pub fn record_wait(&mut self, time: Duration) {
        self.remaining = self.remaining.saturating_sub(time);
    }

    /// Adds the time that these bytes may take.
    pub fn transferred(&mut self, bytes: usize) {
        let earned = bytes as f64 / self.rate.bytes_per_s.max(1) as f64;
        let grace = self.rate.grace;
        let earned = Duration::try_from_secs_f64(earned).unwrap_or(grace);
        self.remaining = self.remaining.saturating_add(earned).min(grace);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE: MinTransferRate = MinTransferRate {
        bytes_per_s: 1000,
        grace: Duration::from_secs(30),
    };

    /// Seconds until a peer that transfers `bytes` every `every_s` seconds is disconnected; `None` if it never is.
    fn seconds_until_disconnect(bytes: usize, every_s: u64) -> Option<u64> {
        let mut guard = TransferRateGuard::new(RATE);
        let every = Duration::from_secs(every_s);
        for round in 0..10_000 {
            if guard.remaining() < every {
                return Some(round * every_s + guard.remaining().as_secs());
            }
            guard.record_wait(every);
            guard.transferred(bytes);
        }
        None
    }

    #[test]
    fn mean_rate_decides_for_even_and_bursty_peers() {
        assert_eq!(seconds_until_disconnect(0, 1), Some(30), "nothing at all");
        let trickle = seconds_until_disconnect(1, 20);
        assert!(
            trickle.is_some_and(|s| s <= 31),
            "a byte in 20 s: {trickle:?}"
        );
        let half = seconds_until_disconnect(500, 1);
        assert!(
            half.is_some_and(|s| (58..=62).contains(&s)),
            "half the rate: {half:?}"
        );
        assert_eq!(seconds_until_disconnect(1001, 1), None);
        assert_eq!(seconds_until_disconnect(21_000, 20), None, "in bursts");
        assert!(
            seconds_until_disconnect(1 << 30, 31).is_some(),
            "a pause beyond the grace"
        );
    }

    #[test]
    fn fast_transfer_earns_at_most_the_grace() {
        let mut guard = TransferRateGuard::new(RATE);
        guard.transferred(usize::MAX);
        assert_eq!(guard.remaining(), RATE.grace);
        let none = MinTransferRate {
            bytes_per_s: 0,
            ..RATE
        };
        let mut guard = TransferRateGuard::new(none);
        guard.record_wait(RATE.grace);
        guard.transferred(1);
        assert_eq!(guard.remaining(), Duration::from_secs(1));
    }
}
