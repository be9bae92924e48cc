//! Time budgets over many answers, in addition to the limit of each answer (`docs/rules.md`, "Real time is the rule"). With only a limit
//! per answer, an agent could occupy a worker's slot for days.

use faceoff_types::{AgentFaultKind, Phase, TimeLimits};

/// Budget for the sum of the answer times of one episode.
#[derive(Debug)]
pub(crate) struct EpisodeBudget<'a> {
    time: &'a TimeLimits,
    /// Duration of a control step, in seconds.
    control_step_s: f64,
    used_s: f64,
    steps: u32,
}

impl<'a> EpisodeBudget<'a> {
    pub fn new(time: &'a TimeLimits, control_step_s: f64) -> Self {
        Self {
            time,
            control_step_s,
            used_s: 0.0,
            steps: 0,
        }
    }

    /// Counts an answer.
    ///
    /// # Errors
    /// When the agent has used up the time of all steps so far.
    pub fn spend(&mut self, answer_s: f64) -> Result<(), AgentFaultKind> {
        self.used_s += answer_s;
        self.steps += 1;
        let simulated_s = f64::from(self.steps) * self.control_step_s;
        let limit_s =
            self.time.episode_control_time_factor * simulated_s + self.time.episode_extra_s;
        check_limit(Phase::Step, self.used_s, limit_s)
    }
}

/// Budget for the sum of the answer times to `reset` in all episodes of a shard.
#[derive(Debug)]
pub(crate) struct ResetBudget {
    limit_s: f64,
    used_s: f64,
}

impl ResetBudget {
    pub fn new(time: &TimeLimits, episodes: u32) -> Self {
        Self {
            limit_s: time.resets_extra_s + time.reset_mean_s * f64::from(episodes),
            used_s: 0.0,
        }
    }

    /// Counts the time of an answer, or of a wait without an answer.
    pub fn spend(&mut self, wait_s: f64) {
        self.used_s += wait_s;
    }

    /// Checks the budget.
    ///
    /// # Errors
    /// When the agent has used up the time of all resets.
    pub fn check(&self) -> Result<(), AgentFaultKind> {
        check_limit(Phase::Reset, self.used_s, self.limit_s)
    }
}

fn check_limit(phase: Phase, used_s: f64, limit_s: f64) -> Result<(), AgentFaultKind> {
    if used_s <= limit_s {
        return Ok(());
    }
    Err(AgentFaultKind::TimeBudget {
        phase,
        used_s,
        limit_s,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Number of answers of `answer_s` that the budget allows.
    fn allowed_answers(answer_s: f64) -> u32 {
        let time = TimeLimits::default();
        let mut budget = EpisodeBudget::new(&time, 0.02);
        (0..500)
            .find(|_| budget.spend(answer_s).is_err())
            .unwrap_or(500)
    }

    #[test]
    fn episode_budget_is_twice_the_control_time_plus_two_seconds() {
        assert_eq!(allowed_answers(0.04), 500);
        assert_eq!(allowed_answers(0.07), 66, "66 · 0.07 s < 66 · 0.04 s + 2 s");
        assert_eq!(allowed_answers(0.9), 2);
    }

    #[test]
    fn reset_budget_grows_with_the_shard() {
        // 30 s, and 0.2 s per episode.
        for (episodes, limit_s) in [(50, 40.0), (100, 50.0)] {
            let mut budget = ResetBudget::new(&TimeLimits::default(), episodes);
            budget.spend(limit_s);
            assert_eq!(budget.check(), Ok(()));
            budget.spend(0.5);
            assert_eq!(
                budget.check(),
                Err(AgentFaultKind::TimeBudget {
                    phase: Phase::Reset,
                    used_s: limit_s + 0.5,
                    limit_s
                })
            );
        }
    }
}
