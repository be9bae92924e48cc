use crate::{
    GAME_WINDOWS, GameLimits, InvalidLimit, InvalidPerturbation, PerturbationSettings, Profile,
    Publishes, Ruleset, Runtimes, StageLimits, TournamentFormat, WINDOW_STEPS,
};
use serde::{Deserialize, Serialize};

/// The longest game, in control steps.
pub const MAX_GAME_STEPS: u32 = 10 * GAME_WINDOWS * WINDOW_STEPS;
/// The most games that do not count which a team may ask for on a day.
pub const MAX_FREE_GAMES: u32 = 1000;

/// What the results of a tournament depend on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(default, deny_unknown_fields)]
pub struct TournamentRules {
    /// The simulator and the scoring.
    #[cfg_attr(feature = "openapi", schema(value_type = String, example = "airhockey-2023.3"))]
    pub ruleset: Ruleset,
    /// Who meets whom.
    pub format: TournamentFormat,
    /// Control steps of a game; the last window of 500 may be shorter.
    pub steps: u32,
    /// The perturbations.
    pub profile: Profile,
    /// Is each meeting two games of one seed, with sides swapped?
    pub mirrored: bool,
    /// What each side is held to beside the limits of single answers.
    pub game_limits: GameLimits,
    /// Magnitudes of what the profile switches on; absent: the ruleset's.
    #[serde(skip_serializing_if = "is_the_rulesets")]
    pub perturbations: Box<PerturbationSettings>,
    /// What agents are held to otherwise than by the server's configuration; absent if all is the server's.
    #[serde(skip_serializing_if = "StageLimits::is_none")]
    pub limits: Box<StageLimits>,
    /// The runtimes that its agents may use; absent: all that the server offers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub runtimes: Option<Runtimes>,
}

/// How a tournament goes on, without a result depending on it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(default, deny_unknown_fields)]
pub struct TournamentSettings {
    /// Games that do not count, against the baseline or another team, which a team may ask for on a UTC day.
    pub free_games_per_day: u32,
    /// When both sides' recordings are there for everybody: never, when the round is over (`at_release`), or when the
    /// tournament is closed.
    pub publishes: Publishes,
}

/// A tournament that could not be played.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InvalidTournament {
    /// No steps, or more than are ever played.
    #[error("steps: expected 1 to {MAX_GAME_STEPS}, got {0}")]
    Steps(u32),
    /// A format that nobody could play.
    #[error("format.{field}: expected at least {least}, got {got}")]
    Format {
        field: &'static str,
        least: u32,
        got: u32,
    },
    /// A budget that nobody could keep.
    #[error("game_limits.{field}: expected {expected}, got {got}")]
    GameLimits {
        field: &'static str,
        /// What it may be.
        expected: &'static str,
        got: f64,
    },
    /// Magnitudes that no world has.
    #[error("perturbations.{0}")]
    Perturbations(#[from] InvalidPerturbation),
    /// Limits that no agent can live by.
    #[error("limits.{0}")]
    Limits(InvalidLimit),
    /// Runtimes that no agent can have.
    #[error("runtimes: {0}")]
    Runtimes(#[from] crate::InvalidRuntimes),
    /// A quota that is none.
    #[error("free_games_per_day: expected 0 to {MAX_FREE_GAMES}, got {0}")]
    FreeGames(u32),
}

impl Default for TournamentRules {
    fn default() -> Self {
        Self {
            ruleset: Ruleset::CURRENT,
            format: TournamentFormat::default(),
            steps: GAME_WINDOWS * WINDOW_STEPS,
            profile: Profile::Evaluation,
            mirrored: false,
            game_limits: GameLimits::default(),
            perturbations: Box::default(),
            limits: Box::default(),
            runtimes: None,
        }
    }
}

impl TournamentRules {
    /// Can games be played by them?
    ///
    /// # Errors
    /// What cannot be.
    pub fn check(&self) -> Result<(), InvalidTournament> {
        if !(1..=MAX_GAME_STEPS).contains(&self.steps) {
            return Err(InvalidTournament::Steps(self.steps));
        }
        if let TournamentFormat::Groups { groups, advance } = self.format {
            for (field, got) in [("groups", groups), ("advance", advance)] {
                if got == 0 {
                    let least = 1;
                    return Err(InvalidTournament::Format { field, least, got });
                }
            }
        }
        let GameLimits {
            in_time_s,
            total_s,
            restart_s,
            max_faults: _,
        } = self.game_limits;
        for (field, got, most, expected) in [
            ("in_time_s", in_time_s, 1.0, "above 0, at most 1"),
            ("total_s", total_s, 86_400.0, "above 0, at most 86400"),
            ("restart_s", restart_s, 600.0, "above 0, at most 600"),
        ] {
            // Written so that NaN is refused.
            if !(got > 0.0 && got <= most) {
                return Err(InvalidTournament::GameLimits {
                    field,
                    expected,
                    got,
                });
            }
        }
        self.perturbations.check()?;
        if let Some(runtimes) = &self.runtimes {
            runtimes.check()?;
        }
        self.limits.check().map_err(InvalidTournament::Limits)
    }
}

impl Default for TournamentSettings {
    fn default() -> Self {
        Self {
            free_games_per_day: 5,
            publishes: Publishes::AtClose,
        }
    }
}

impl TournamentSettings {
    /// Can a tournament go on so?
    ///
    /// # Errors
    /// What is out of bounds.
    pub const fn check(&self) -> Result<(), InvalidTournament> {
        if self.free_games_per_day > MAX_FREE_GAMES {
            return Err(InvalidTournament::FreeGames(self.free_games_per_day));
        }
        Ok(())
    }
}

fn is_the_rulesets(perturbations: &PerturbationSettings) -> bool {
    *perturbations == PerturbationSettings::default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rules(json: &str) -> TournamentRules {
        serde_json::from_str(json).unwrap()
    }

    #[test]
    fn what_is_left_out_is_as_the_challenge_had_it() {
        let rules = rules("{}");
        assert_eq!(rules, TournamentRules::default());
        assert_eq!(rules.format.last_round().get(), 2);
        assert_eq!(rules.steps, 45_000);
        assert_eq!(rules.check(), Ok(()));
        let text = serde_json::to_string(&rules).unwrap();
        assert_eq!(
            serde_json::from_str::<TournamentRules>(&text).unwrap(),
            rules
        );
        assert_eq!(TournamentSettings::default().check(), Ok(()));
    }

    #[test]
    fn what_cannot_be_played_is_named() {
        for (json, words) in [
            (r#"{"steps":0}"#, "steps: expected 1 to 450000, got 0"),
            (
                r#"{"format":{"kind":"groups","groups":0,"advance":1}}"#,
                "format.groups",
            ),
            (
                r#"{"format":{"kind":"groups","groups":2,"advance":0}}"#,
                "format.advance",
            ),
            (r#"{"game_limits":{"total_s":0.0}}"#, "game_limits.total_s"),
            (
                r#"{"game_limits":{"in_time_s":2.0}}"#,
                "game_limits.in_time_s",
            ),
            (r#"{"limits":{"pids":1}}"#, "limits.pids"),
        ] {
            let error = rules(json).check().unwrap_err().to_string();
            assert!(error.contains(words), "{json}: {error}");
        }
        for json in [
            r#"{"step":1}"#,
            r#"{"format":{"kind":"knockout"}}"#,
            r#"{"format":{"kind":"swiss","rounds":0}}"#,
            r#"{"format":{"kind":"swiss","rounds":3,"groups":1}}"#,
        ] {
            assert!(
                serde_json::from_str::<TournamentRules>(json).is_err(),
                "{json}"
            );
        }
        let many = TournamentSettings {
            free_games_per_day: MAX_FREE_GAMES + 1,
            ..TournamentSettings::default()
        };
        assert_eq!(many.check(), Err(InvalidTournament::FreeGames(1001)));
    }
}
