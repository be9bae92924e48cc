/// Name of the rules and of the simulator behaviour that every published score refers to.
///
/// A change of behaviour (a constant of the simulator, the pinned contact finder, a bound of a tier)
/// is a new ruleset.
pub const RULESET: &str = "airhockey-2023.1";

/// Control steps of a window, the tournament's equivalent of an episode: the same violation counts once
/// in each (paper §2.2).
pub const WINDOW_STEPS: u32 = 500;

/// Windows of a game: 45,000 control steps, 15 minutes (paper §2.2).
pub const GAME_WINDOWS: u32 = 90;

/// Every so many fouls of a robot give its opponent one point (reference implementation).
pub const FOULS_PER_POINT: u32 = 3;
