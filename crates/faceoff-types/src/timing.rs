use serde::{Deserialize, Serialize};

/// Round trips to an agent that answers at once, in seconds: what a slot adds to every answer.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct RoundTrips {
    /// How many were measured.
    pub count: u32,
    /// Median (nearest rank).
    pub p50: f64,
    /// 99th percentile (nearest rank).
    pub p99: f64,
    /// Maximum.
    pub max: f64,
}

impl RoundTrips {
    /// The worse of two slots, value by value.
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

/// How evenly a slot kept time, measured by the platform's own calibration agent on the agent's CPUs.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct SlotTiming {
    /// Round trips before the first episode, in seconds.
    pub before_s: RoundTrips,
    /// Round trips between the episodes, in seconds.
    pub during_s: RoundTrips,
    /// The most that the host took of one answer's time, in seconds; 0 when no answer was late by it.
    pub longest_stall_s: f64,
    /// Tries of episodes that were dropped and played again because the host kept the agent from answering.
    pub host_noise_reruns: u32,
    /// How often episodes were begun again from a shard's first because something of ours broke; absent
    /// if never.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub platform_retries: u32,
}

const fn is_zero(count: &u32) -> bool {
    *count == 0
}

impl SlotTiming {
    /// The worse of two slots, value by value; re-runs and retries add up.
    #[must_use]
    pub fn worse(self, other: Self) -> Self {
        Self {
            before_s: self.before_s.worse(other.before_s),
            during_s: self.during_s.worse(other.during_s),
            longest_stall_s: self.longest_stall_s.max(other.longest_stall_s),
            host_noise_reruns: self
                .host_noise_reruns
                .saturating_add(other.host_noise_reruns),
            platform_retries: self.platform_retries.saturating_add(other.platform_retries),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_two_slots_the_worse_values_count_and_reruns_add_up() {
        let trips = |p50, max| RoundTrips {
            count: 10,
            p50,
            p99: max,
            max,
        };
        let slot = |before_s, during_s, longest_stall_s, host_noise_reruns| SlotTiming {
            before_s,
            during_s,
            longest_stall_s,
            host_noise_reruns,
            platform_retries: 2 * host_noise_reruns,
        };
        let worse = slot(trips(1.0, 9.0), trips(4.0, 5.0), 0.1, 1).worse(slot(
            trips(2.0, 3.0),
            trips(1.0, 8.0),
            0.3,
            2,
        ));
        let both = |p50, max| RoundTrips {
            count: 20,
            ..trips(p50, max)
        };
        assert_eq!(worse, slot(both(2.0, 9.0), both(4.0, 8.0), 0.3, 3));
    }
}
