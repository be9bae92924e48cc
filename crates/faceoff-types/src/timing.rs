//! The timing quality of slots. A *slot* is the place in a worker that runs one job at a time.

use serde::{Deserialize, Serialize};

/// Round-trip times to an agent that answers at once, in seconds: the overhead of a slot in every answer time.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct RoundTrips {
    /// Number of measurements.
    pub count: u32,
    /// Median (nearest rank).
    pub p50: f64,
    /// 99th percentile (nearest rank).
    pub p99: f64,
    /// Maximum.
    pub max: f64,
}

impl RoundTrips {
    /// The worse value of two slots for each field; counts add up.
    #[must_use]
    pub fn worse(self, other: Self) -> Self {
        Self {
            count: self.count.saturating_add(other.count),
            p50: self.p50.max(other.p50),
            p99: self.p99.max(other.p99),
            max: self.max.max(other.max),
        }
    }
}

/// Timing quality of a slot. It is measured on the agent's CPUs with the platform's calibration agent, which answers at once.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct SlotTiming {
    /// Round trips before the first episode, in seconds.
    pub before_s: RoundTrips,
    /// Round trips between the episodes, in seconds.
    pub during_s: RoundTrips,
    /// Longest delay of one answer by host interference, in seconds; 0 if there was none.
    #[serde(rename = "longest_stall_s")]
    pub max_host_interference_s: f64,
    /// Number of times that an episode was discarded and repeated because of host interference.
    #[serde(rename = "host_noise_reruns")]
    pub host_interference_reruns: u32,
    /// Number of times that a shard was restarted from its first episode because of a platform fault; absent
    /// if 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub platform_retries: u32,
}

const fn is_zero(count: &u32) -> bool {
    *count == 0
}

impl SlotTiming {
    /// The worse value of two slots for each field; repetitions and retries add up.
    #[must_use]
    pub fn worse(self, other: Self) -> Self {
        Self {
            before_s: self.before_s.worse(other.before_s),
            during_s: self.during_s.worse(other.during_s),
            max_host_interference_s: self
                .max_host_interference_s
                .max(other.max_host_interference_s),
            host_interference_reruns: self
                .host_interference_reruns
                .saturating_add(other.host_interference_reruns),
            platform_retries: self.platform_retries.saturating_add(other.platform_retries),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn worse_timing_takes_maxima_and_adds_reruns() {
        let round_trips = |p50, max| RoundTrips {
            count: 10,
            p50,
            p99: max,
            max,
        };
        let slot =
            |before_s, during_s, max_host_interference_s, host_interference_reruns| SlotTiming {
                before_s,
                during_s,
                max_host_interference_s,
                host_interference_reruns,
                platform_retries: 2 * host_interference_reruns,
            };
        let worse = slot(round_trips(1.0, 9.0), round_trips(4.0, 5.0), 0.1, 1).worse(slot(
            round_trips(2.0, 3.0),
            round_trips(1.0, 8.0),
            0.3,
            2,
        ));
        let both = |p50, max| RoundTrips {
            count: 20,
            ..round_trips(p50, max)
        };
        assert_eq!(worse, slot(both(2.0, 9.0), both(4.0, 8.0), 0.3, 3));
    }
}
