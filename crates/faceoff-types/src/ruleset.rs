use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// The rules and the simulator behaviour that a published score refers to.
///
/// A change of behaviour (a constant of the simulator, the pinned contact finder, a bound of a tier)
/// is a new ruleset. Recordings of earlier ones are verified, and runs under way finished, by their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Ruleset {
    /// Numbers of an action are only finite, and a world may move however fast.
    #[serde(rename = "airhockey-2023.1")]
    First,
    /// With the day's cut, the clock's start at the first attempt to write, bounded numbers, a bounded
    /// world and time budgets.
    #[serde(rename = "airhockey-2023.2")]
    Second,
    /// The clock of a step begins before the evaluator touches anything that it shares with the agent. Of the
    /// evaluator's own calls nothing is excused but its thread's wait to run. CPU time that an agent uses between
    /// its answer and the next question counts as the next step's; in a game on shared CPUs, an agent that has
    /// answered is frozen meanwhile. Of the agent's CPUs, only the wait of a thread that then ran towards the answer
    /// counts as the host's. The simulation is the second ruleset's.
    #[serde(rename = "airhockey-2023.3")]
    Third,
}

impl Ruleset {
    /// All, the earlier first.
    pub const ALL: [Self; 3] = [Self::First, Self::Second, Self::Third];

    /// What new runs are played by.
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

    /// Are there games of it? The first ruleset is older than games.
    #[must_use]
    pub const fn has_games(self) -> bool {
        !matches!(self, Self::First)
    }

    /// The names of all, for messages.
    fn names() -> String {
        Self::ALL.map(Self::as_str).join(", ")
    }
}

impl fmt::Display for Ruleset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

/// Rules that this version does not know.
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

/// The largest magnitude of a number in an answer's action, whatever its unit: rad, rad/s or rad/s².
/// No robot can follow commands near it, and nothing overflows that is computed of them.
pub const ACTION_LIMIT: f64 = 1e4;

/// Control steps of a window, the tournament's equivalent of an episode: the same violation counts once
/// in each (paper §2.2).
pub const WINDOW_STEPS: u32 = 500;

/// Windows of a game: 45,000 control steps, 15 minutes (paper §2.2).
pub const GAME_WINDOWS: u32 = 90;

/// Every so many fouls of a robot give its opponent one point (reference implementation).
pub const FOULS_PER_POINT: u32 = 3;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ruleset_names_are_read_as_they_are_written() {
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
