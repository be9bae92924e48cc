//! How long it takes until a time, as text. `live.js` keeps it current.

use jiff::Timestamp;

const MINUTES_PER_HOUR: i64 = 60;
const MINUTES_PER_DAY: i64 = 24 * MINUTES_PER_HOUR;

/// The time from `now` until `at` in its two largest units, such as “in 3 h 20 min”; the last minute counts as one.
pub(super) fn until(at: Timestamp, now: Timestamp) -> String {
    let seconds = at.as_second() - now.as_second();
    if seconds <= 0 {
        return "now".to_owned();
    }
    let minutes = (seconds + 59) / 60;
    let (days, hours) = (minutes / MINUTES_PER_DAY, minutes / MINUTES_PER_HOUR);
    match (days, hours) {
        (0, 0) => format!("in {minutes} min"),
        (0, _) => format!("in {hours} h {} min", minutes % MINUTES_PER_HOUR),
        (1, _) => format!("in 1 day {} h", hours % 24),
        _ => format!("in {days} days {} h", hours % 24),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn countdown_has_the_two_largest_units() {
        let now: Timestamp = "2026-03-01T10:00:00Z".parse().unwrap();
        for (at, expected) in [
            ("2026-03-01T09:59:59Z", "now"),
            ("2026-03-01T10:00:00Z", "now"),
            ("2026-03-01T10:00:01Z", "in 1 min"),
            ("2026-03-01T10:59:00Z", "in 59 min"),
            ("2026-03-01T13:20:00Z", "in 3 h 20 min"),
            ("2026-03-02T10:00:00Z", "in 1 day 0 h"),
            ("2026-03-04T13:59:30Z", "in 3 days 4 h"),
        ] {
            assert_eq!(until(at.parse().unwrap(), now), expected, "{at}");
        }
    }
}
