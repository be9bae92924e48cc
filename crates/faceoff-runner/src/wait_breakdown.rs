//! The wait for an agent's answer, divided into the agent's time and *host interference* (other load on the machine).

use std::{fmt, time::Duration};

/// Breakdown of the wait for an answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WaitBreakdown {
    /// From right before the evaluator wrote the question to the answer's last byte.
    pub wall: Duration,
    /// Host interference in this time.
    pub host_interference: Duration,
    /// CPU time of the agent's process tree between its last answer and this question. It counts as the agent's time.
    pub early_cpu_time: Duration,
    /// CPU time of the agent's process tree since its last answer, in seconds, if the host reports it.
    pub cpu_time_s: Option<f64>,
}

impl WaitBreakdown {
    /// The time that the agent used, by which its answer is judged.
    pub(crate) fn agent_time(&self) -> Duration {
        self.wall.saturating_sub(self.host_interference) + self.early_cpu_time
    }
}

impl fmt::Display for WaitBreakdown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ms = |time: Duration| 1e3 * time.as_secs_f64();
        write!(
            f,
            "waited {:.1} ms, including {:.1} ms of host interference",
            ms(self.wall),
            ms(self.host_interference)
        )?;
        if ms(self.early_cpu_time) >= 0.05 {
            write!(
                f,
                "; {:.1} ms of CPU time before the question are added",
                ms(self.early_cpu_time)
            )?;
        }
        match self.cpu_time_s {
            Some(cpu_s) => write!(f, "; the agent's processes ran {:.1} ms", 1e3 * cpu_s),
            None => Ok(()),
        }
    }
}
