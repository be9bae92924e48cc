//! Minimum transfer rate of a connection: if the peer (the client) is too slow for too long, the connection is closed.

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
/// Waiting uses up the grace; each byte adds the time that it may take, up to the whole grace. So a slow trickle is treated
/// like a pause followed by a burst if their mean rate is the same.
#[derive(Debug)]
pub struct TransferRateGuard {
    rate: MinTransferRate,
    /// The part of the grace that is not used up.
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

    /// How long the server still waits if the peer transfers nothing.
    pub const fn remaining(&self) -> Duration {
        self.remaining
    }

    /// Subtracts the time in which the server waited for the peer.
    pub fn record_wait(&mut self, time: Duration) {
        self.remaining = self.remaining.saturating_sub(time);
    }

    /// Adds the time that these bytes may take at the minimum rate.
    pub fn record_bytes(&mut self, bytes: usize) {
        let earned = bytes as f64 / self.rate.bytes_per_s.max(1) as f64;
        let grace = self.rate.grace;
        let earned = Duration::try_from_secs_f64(earned).unwrap_or(grace);
        self.remaining = self.remaining.saturating_add(earned).min(grace);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // The expected seconds below follow from these values.
    const RATE: MinTransferRate = MinTransferRate {
        bytes_per_s: 1000,
        grace: Duration::from_secs(30),
    };

    /// Seconds until a peer that transfers `bytes` at once every `interval_s` seconds is disconnected; `None` if it never is.
    fn seconds_until_disconnect(bytes: usize, interval_s: u64) -> Option<u64> {
        let mut guard = TransferRateGuard::new(RATE);
        let interval = Duration::from_secs(interval_s);
        for round in 0..10_000 {
            if guard.remaining() < interval {
                return Some(round * interval_s + guard.remaining().as_secs());
            }
            guard.record_wait(interval);
            guard.record_bytes(bytes);
        }
        None
    }

    #[test]
    fn mean_rate_decides_for_even_and_bursty_peers() {
        assert_eq!(seconds_until_disconnect(0, 1), Some(30), "nothing at all");
        let trickle = seconds_until_disconnect(1, 20);
        assert!(
            trickle.is_some_and(|seconds| seconds <= 31),
            "a byte in 20 s: {trickle:?}"
        );
        let half = seconds_until_disconnect(500, 1);
        assert!(
            half.is_some_and(|seconds| (58..=62).contains(&seconds)),
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
        guard.record_bytes(usize::MAX);
        assert_eq!(guard.remaining(), RATE.grace);
    }

    #[test]
    fn zero_rate_counts_as_one_byte_per_second() {
        // Divided by zero, each byte would earn the whole grace.
        let zero_rate = MinTransferRate {
            bytes_per_s: 0,
            ..RATE
        };
        let mut guard = TransferRateGuard::new(zero_rate);
        guard.record_wait(RATE.grace);
        guard.record_bytes(1);
        assert_eq!(guard.remaining(), Duration::from_secs(1));
    }
}
