//! Conversion of measured times between seconds and the tables' nanoseconds.

use std::time::Duration;

/// A measured time in whole nanoseconds, as in the tables, where it takes a third of the space of the same time in seconds. Clocks
/// have nanosecond resolution, so [`seconds`] returns the original number.
pub(crate) fn nanoseconds(time_s: f64) -> i64 {
    // Saturates after 292 years.
    (time_s * 1e9).round() as i64
}

/// The time in seconds, as in scores.
pub(crate) fn seconds(time_ns: i64) -> f64 {
    Duration::from_nanos(time_ns.unsigned_abs()).as_secs_f64()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nanoseconds_round_trip_clock_times() {
        let mut nanos: u64 = 1;
        for _ in 0..2000 {
            // Pseudo-random times up to an hour, from Knuth's linear congruential generator.
            nanos = nanos
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let time_s = Duration::from_nanos(nanos % 3_600_000_000_000).as_secs_f64();
            assert_eq!(seconds(nanoseconds(time_s)).to_bits(), time_s.to_bits());
        }
        assert_eq!(nanoseconds(0.02), 20_000_000);
    }
}
