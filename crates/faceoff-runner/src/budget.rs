//! How long an agent may take in all (RULES, "Real time is the rule"): a limit per answer alone would
//! let it hold a slot for days.

use faceoff_sim::model::CONTROL_STEP_S;
use faceoff_types::{AgentFaultKind, Phase, TimeLimits};

/// What the answers of one episode may add up to.
#[derive(Debug)]
pub(crate) struct EpisodeBudget<'a> {
    time: &'a TimeLimits,
    used_s: f64,
    steps: u32,
}

impl<'a> EpisodeBudget<'a> {
    pub fn new(time: &'a TimeLimits) -> Self {
        Self {
            time,
            used_s: 0.0,
            steps: 0,
        }
    }

    /// Counts an answer.
    ///
    /// # Errors
    /// The agent has used up the time of all steps so far.
    pub fn spend(&mut self, answer_s: f64) -> Result<(), AgentFaultKind> {
        self.used_s += answer_s;
        self.steps += 1;
        let control_s = f64::from(self.steps) * CONTROL_STEP_S;
        let limit_s = self.time.episode_control_times * control_s + self.time.episode_extra_s;
        within(Phase::Step, self.used_s, limit_s)
    }
}

/// What the answers to `reset` of all episodes of a shard may add up to.
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

    /// Counts an answer, or a wait for one that did not come.
    pub fn spend(&mut self, wait_s: f64) {
        self.used_s += wait_s;
    }

    /// Is there time for resets?
    ///
    /// # Errors
    /// The agent has used up that of all.
    pub fn check(&self) -> Result<(), AgentFaultKind> {
        within(Phase::Reset, self.used_s, self.limit_s)
    }
}

fn within(phase: Phase, used_s: f64, limit_s: f64) -> Result<(), AgentFaultKind> {
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

    /// How many answers of `answer_s` are taken.
    fn taken(answer_s: f64) -> u32 {
        let time = TimeLimits::default();
        let mut budget = EpisodeBudget::new(&time);
        (0..500)
            .find(|_| budget.spend(answer_s).is_err())
            .unwrap_or(500)
    }

    #[test]
    fn an_episode_may_take_twice_its_control_time_and_two_seconds() {
        assert_eq!(taken(0.04), 500);
        assert_eq!(taken(0.07), 66, "66 · 0.07 s < 66 · 0.04 s + 2 s");
        assert_eq!(taken(0.9), 2);
    }

    #[test]
    fn resets_share_a_budget_that_grows_with_the_shard() {
        let mut budget = ResetBudget::new(&TimeLimits::default(), 50);
        for _ in 0..4 {
            budget.spend(10.0);
            assert_eq!(budget.check(), Ok(()));
        }
        budget.spend(0.5);
        assert_eq!(
            budget.check(),
            Err(AgentFaultKind::TimeBudget {
                phase: Phase::Reset,
                used_s: 40.5,
                limit_s: 40.0
            })
        );
    }
}
