use std::{fmt, time::Duration};

/// Whose time a wait was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Waited {
    /// From right before the evaluator turned to the agent, to the answer's last byte.
    pub wall: Duration,
    /// What the host took of that.
    pub host: Duration,
    /// CPU time that the agent's process tree had used since its last answer, before it was asked.
    pub head_start: Duration,
    /// CPU time that the agent's process tree used since its last answer, in seconds, where the host tells.
    pub cpu_time_s: Option<f64>,
}

impl Waited {
    pub(crate) fn of_the_agent(&self) -> Duration {
        self.wall.saturating_sub(self.host) + self.head_start
    }
}

impl fmt::Display for Waited {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ms = |time: Duration| 1e3 * time.as_secs_f64();
        write!(
            f,
            "waited {:.1} ms, of which the host took {:.1} ms",
            ms(self.wall),
            ms(self.host)
        )?;
        if ms(self.head_start) >= 0.05 {
            write!(
                f,
                "; {:.1} ms of CPU time that it used before it was asked count as well",
                ms(self.head_start)
            )?;
        }
        match self.cpu_time_s {
            Some(cpu_s) => write!(f, "; the agent's processes ran {:.1} ms", 1e3 * cpu_s),
            None => Ok(()),
        }
    }
}
