//! Rulesets: numbered versions of the simulator and of the scoring. `docs/rules.md` has the current one in full.

use faceoff_types::Ruleset;

/// The rules and the simulator behaviour that a published score refers to.
///
/// A change of behaviour (a constant of the simulator, the version of the contact detection library, a bound of a tier)
/// needs a new ruleset. Recordings and running evaluations keep the ruleset that they started with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AirHockeyRuleset {
    /// Numbers in actions must be finite, and velocities are unbounded.
    First,
    /// Adds the daily cutoff (the moment at which submissions are frozen), bounds on numbers and on the simulated world, and
    /// time budgets. The clock of a step starts at the first attempt to write the protocol's `step` line to the agent.
    Second,
    /// Changes the timing of steps; the simulation is the one of the second ruleset.
    ///
    /// * The clock of a step starts before the evaluator touches anything that it shares with the agent.
    /// * Of the evaluator's own time within a step, only its thread's wait for a CPU is subtracted from the step's time.
    /// * CPU time that an agent uses between its answer and the next observation counts for the next step. In a
    ///   game on shared CPUs, an agent that has answered is frozen until then.
    /// * Host interference is time that other load took from the agent, and is not charged to it. A wait on the agent's CPUs
    ///   counts as such only for threads that then contributed to the answer.
    Third,
}

impl AirHockeyRuleset {
    /// All rulesets, oldest first.
    pub const ALL: [Self; 3] = [Self::First, Self::Second, Self::Third];

    /// The ruleset of new runs.
    pub const CURRENT: Self = Self::Third;

    /// The name in files and in the database.
    #[must_use]
    pub const fn name(self) -> Ruleset {
        Ruleset::new(match self {
            Self::First => "airhockey-2023.1",
            Self::Second => "airhockey-2023.2",
            Self::Third => "airhockey-2023.3",
        })
    }

    /// The ruleset of this name.
    #[must_use]
    pub fn find(name: Ruleset) -> Option<Self> {
        Self::ALL.into_iter().find(|ruleset| ruleset.name() == name)
    }

    /// Does it support games? The first ruleset predates them.
    #[must_use]
    pub const fn has_games(self) -> bool {
        !matches!(self, Self::First)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rulesets_are_found_by_name() {
        for ruleset in AirHockeyRuleset::ALL {
            assert_eq!(AirHockeyRuleset::find(ruleset.name()), Some(ruleset));
        }
        let newest = AirHockeyRuleset::ALL.last();
        assert_eq!(newest, Some(&AirHockeyRuleset::CURRENT));
        let other = AirHockeyRuleset::find(Ruleset::new("airhockey-1999"));
        assert_eq!(other, None);
    }
}
