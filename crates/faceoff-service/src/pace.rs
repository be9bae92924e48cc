//! Who moves too little for too long is let go, whoever was meant to move it.

use std::time::Duration;

/// The least that a peer must move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeastRate {
    /// In the mean, in bytes per second.
    pub bytes_per_s: u64,
    /// How long the peer may be behind that: at the start, and again after it has caught up.
    pub grace: Duration,
}

/// How far behind its least rate a peer is. Only the time counts in which we waited for the peer: waiting
/// spends the grace, and each byte earns back what it may take, up to the whole grace. So a pause costs as
/// much as a trickle of the same mean, and what we do meanwhile costs nothing.
#[derive(Debug)]
pub struct Pace {
    rate: LeastRate,
    left: Duration,
}

impl Pace {
    /// With all of the grace.
    pub const fn new(rate: LeastRate) -> Self {
        Self {
            rate,
            left: rate.grace,
        }
    }

    /// How much longer we wait if nothing moves.
    pub const fn left(&self) -> Duration {
        self.left
    }

    /// We have waited for the peer.
    pub fn waited(&mut self, time: Duration) {
        self.left = self.left.saturating_sub(time);
    }

    /// The peer has moved something.
    pub fn moved(&mut self, bytes: usize) {
        let earned = bytes as f64 / self.rate.bytes_per_s.max(1) as f64;
        let grace = self.rate.grace;
        let earned = Duration::try_from_secs_f64(earned).unwrap_or(grace);
        self.left = self.left.saturating_add(earned).min(grace);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE: LeastRate = LeastRate {
        bytes_per_s: 1000,
        grace: Duration::from_secs(30),
    };

    /// Seconds until a peer is let go that moves so many bytes every so many seconds; `None` if it may stay.
    fn let_go(bytes: usize, every_s: u64) -> Option<u64> {
        let mut pace = Pace::new(RATE);
        let every = Duration::from_secs(every_s);
        for round in 0..10_000 {
            if pace.left() < every {
                return Some(round * every_s + pace.left().as_secs());
            }
            pace.waited(every);
            pace.moved(bytes);
        }
        None
    }

    #[test]
    fn the_mean_decides_whether_it_comes_evenly_or_in_bursts() {
        assert_eq!(let_go(0, 1), Some(30), "nothing at all");
        let dribble = let_go(1, 20);
        assert!(
            dribble.is_some_and(|s| s <= 31),
            "a byte in 20 s: {dribble:?}"
        );
        let half = let_go(500, 1);
        assert!(
            half.is_some_and(|s| (58..=62).contains(&s)),
            "half the rate: {half:?}"
        );
        assert_eq!(let_go(1001, 1), None);
        assert_eq!(let_go(21_000, 20), None, "in bursts");
        assert!(let_go(1 << 30, 31).is_some(), "a pause beyond the grace");
    }

    #[test]
    fn what_was_quick_earns_no_more_than_the_grace() {
        let mut pace = Pace::new(RATE);
        pace.moved(usize::MAX);
        assert_eq!(pace.left(), RATE.grace);
        let none = LeastRate {
            bytes_per_s: 0,
            ..RATE
        };
        let mut pace = Pace::new(none);
        pace.waited(RATE.grace);
        pace.moved(1);
        assert_eq!(pace.left(), Duration::from_secs(1));
    }
}
