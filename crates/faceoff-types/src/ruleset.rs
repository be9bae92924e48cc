/// Name of the rules and of the simulator behaviour that every published score refers to.
///
/// A change of behaviour (a constant of the simulator, the pinned contact finder, a bound of a tier)
/// is a new ruleset.
pub const RULESET: &str = "airhockey-2023.1";
