//! Rulesets: versions of a competition's simulator and of its scoring.

use crate::short_name::short_name;

short_name! {
    /// The name of the rules and the simulator behaviour that a published score refers to. Recordings and running evaluations keep the
    /// ruleset that they started with. [`Competition`](crate::Competition) defines which rulesets exist.
    Ruleset, "a ruleset", with_dots
}

/// The largest magnitude of a number in an action that an agent may send, in the units of the action.
/// It is far beyond what a robot can follow, and small enough that no computation overflows. Larger numbers are agent faults.
pub const ACTION_LIMIT: f64 = 1e4;

/// A ruleset that the competition does not have.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown ruleset {name:?}: this version knows {}", known.join(", "))]
pub struct UnknownRuleset {
    name: String,
    known: Vec<String>,
}

impl UnknownRuleset {
    /// `known` are the rulesets of the competition.
    pub(crate) fn new(name: &str, known: impl Iterator<Item = Ruleset>) -> Self {
        Self {
            name: name.to_owned(),
            known: known.map(|ruleset| ruleset.to_string()).collect(),
        }
    }
}
