//! Mean and maximum of the computation times of an agent's answers.

use faceoff_types::ComputationTime;

/// Sum, maximum and number of computation times.
#[derive(Debug, Clone, Copy, Default)]
pub struct TimeSum {
    sum_s: f64,
    max_s: f64,
    count: u32,
}

impl TimeSum {
    /// Adds one answer's time, in seconds.
    pub fn add(&mut self, time_s: f64) {
        self.sum_s += time_s;
        self.max_s = self.max_s.max(time_s);
        self.count += 1;
    }

    /// Mean and maximum; zeros without an answer.
    #[must_use]
    pub fn summary(&self) -> ComputationTime {
        let mean_s = match self.count {
            0 => 0.0,
            count => self.sum_s / f64::from(count),
        };
        ComputationTime {
            mean_s,
            max_s: self.max_s,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_sum_has_mean_and_maximum() {
        let mut times = TimeSum::default();
        assert_eq!(times.summary(), ComputationTime::default());
        times.add(0.03);
        times.add(0.01);
        let (mean_s, max_s) = (0.02, 0.03);
        assert_eq!(times.summary(), ComputationTime { mean_s, max_s });
    }
}
