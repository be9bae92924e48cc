//! Rulesets: versions of the simulator and of the scoring, and the constants that all of them share.

use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// The rules and the simulator behaviour that a published score refers to.
///
/// A change of behaviour (a constant of the simulator, the version of the contact detection library, a bound of a tier)
/// needs a new ruleset. Recordings and running evaluations keep the ruleset that they started with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Ruleset {
    /// Numbers in actions must be finite, and velocities are unbounded.
    #[serde(rename = "airhockey-2023.1")]
    First,
    /// Adds the daily cutoff, bounds on numbers and on the simulated world, and time budgets. The clock of a
    /// step starts at the first attempt to write the `step` line.
    #[serde(rename = "airhockey-2023.2")]
    Second,
    /// Changes the timing of steps; the simulation is the one of the second ruleset.
    ///
    /// * The clock of a step starts before the evaluator touches anything that it shares with the agent.
    /// * Of the evaluator's own time, only its thread's wait for a CPU is subtracted.
    /// * CPU time that an agent uses between its answer and the next observation counts for the next step. In a
    ///   game on shared CPUs, an agent that has answered is frozen until then.
    /// * On the agent's CPUs, a wait counts as host interference only for threads that then contributed to the
    ///   answer.
    #[serde(rename = "airhockey-2023.3")]
    Third,
}

impl Ruleset {
    /// All rulesets, oldest first.
    pub const ALL: [Self; 3] = [Self::First, Self::Second, Self::Third];

    /// The ruleset of new runs.
    pub const CURRENT: Self = Self::Third;

    /// The name in files and tables.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::First => "airhockey-2023.1",
            Self::Second => "airhockey-2023.2",
            Self::Third => "airhockey-2023.3",
        }
    }

    /// The largest magnitude of a number in a recorded action.
    #[must_use]
    pub const fn action_limit(self) -> f64 {
        match self {
            Self::First => f64::MAX,
            Self::Second | Self::Third => ACTION_LIMIT,
        }
    }

    /// Does it support games? The first ruleset predates them.
    #[must_use]
    pub const fn has_games(self) -> bool {
        !matches!(self, Self::First)
    }

    /// All names, for error messages.
    fn names() -> String {
        Self::ALL.map(Self::as_str).join(", ")
    }
}

impl fmt::Display for Ruleset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

/// A ruleset that this version does not know.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown ruleset {0:?}: this version knows {known}", known = Ruleset::names())]
pub struct UnknownRuleset(pub String);

impl FromStr for Ruleset {
    type Err = UnknownRuleset;
    fn from_str(name: &str) -> Result<Self, UnknownRuleset> {
        Self::ALL
            .into_iter()
            .find(|ruleset| ruleset.as_str() == name)
            .ok_or_else(|| UnknownRuleset(name.to_owned()))
    }
}

/// Name of the current ruleset.
pub const RULESET: &str = Ruleset::CURRENT.as_str();

/// The largest magnitude of a number in an action, in rad, rad/s or rad/s².
/// It is far beyond what a robot can follow, and small enough that no computation overflows.
pub const ACTION_LIMIT: f64 = 1e4;

/// Control steps of a window, the equivalent of an episode in games: each violation counts at most once per window
/// (paper §2.2).
pub const WINDOW_STEPS: u32 = 500;

/// Windows of a game: 45,000 control steps, 15 minutes (paper §2.2).
pub const GAME_WINDOWS: u32 = 90;

/// Number of fouls of a robot that give its opponent one point (reference implementation).
pub const FOULS_PER_POINT: u32 = 3;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ruleset_names_round_trip() {
        for ruleset in Ruleset::ALL {
            let json = serde_json::to_string(&ruleset).unwrap();
            assert_eq!(json, format!("\"{ruleset}\""));
            assert_eq!(serde_json::from_str::<Ruleset>(&json).unwrap(), ruleset);
            assert_eq!(ruleset.as_str().parse::<Ruleset>(), Ok(ruleset));
        }
        assert_eq!(Ruleset::ALL.last(), Some(&Ruleset::CURRENT));
    }

    #[test]
    fn unknown_ruleset_error_lists_all_known_names() {
        let unknown = "airhockey-1999".parse::<Ruleset>().unwrap_err();
        assert_eq!(
            unknown.to_string(),
            "unknown ruleset \"airhockey-1999\": this version knows airhockey-2023.1, airhockey-2023.2, \
             airhockey-2023.3"
        );
    }
}
