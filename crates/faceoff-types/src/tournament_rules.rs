//! Rules and settings of a tournament, in which the agents of two teams play each game. Rules affect the results;
//! settings do not.

use crate::{
    DepartureKind, ForfeitScore, GAME_WINDOWS, GameLimits, InvalidLimit, InvalidMagnitude,
    Magnitudes, Profile, Publication, Ruleset, Runtimes, StageLimits, TournamentFormat,
    UnknownProfile, UnknownRuleset, WINDOW_STEPS,
};
use serde::{Deserialize, Serialize};

/// The longest game, in control steps: ten times that of the original challenge. A game is divided into *windows* of 500 steps, and
/// penalty points are counted for each.
pub const MAX_GAME_STEPS: u32 = 10 * GAME_WINDOWS * WINDOW_STEPS;
/// Maximum number of test games and friendly games per team and day.
pub const MAX_TEST_AND_FRIENDLY_GAMES: u32 = 1000;

/// The rules on which the results of a tournament depend.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct TournamentRules {
    /// Version of the simulator and of the scoring.
    #[cfg_attr(feature = "openapi", schema(value_type = String, example = "airhockey-2023.3"))]
    pub ruleset: Ruleset,
    /// Format, which decides the pairings.
    #[serde(default)]
    pub format: TournamentFormat,
    /// Control steps per game; its last window (penalty points are counted per window of 500 steps) may be shorter.
    #[serde(default = "default_steps")]
    pub steps: u32,
    /// Perturbation profile.
    pub profile: Profile,
    /// Does each pairing consist of two games with the same seed and swapped sides?
    #[serde(default)]
    pub mirrored: bool,
    /// What a forfeited game counts; absent: 10 : 0.
    #[serde(default, skip_serializing_if = "ForfeitScore::is_legacy")]
    pub forfeit_score: ForfeitScore,
    /// When a withdrawal takes effect; absent: at once.
    #[serde(default, skip_serializing_if = "Withdrawals::is_legacy")]
    pub withdrawals: Withdrawals,
    /// Limits of each side, in addition to those of single answers.
    #[serde(default)]
    pub game_limits: GameLimits,
    /// Magnitudes of the profile's perturbations; absent: the ruleset's.
    #[serde(default, skip_serializing_if = "Magnitudes::is_empty")]
    pub perturbations: Magnitudes,
    /// Limits of agents that differ from the server's configuration; absent if none do.
    #[serde(default, skip_serializing_if = "StageLimits::is_empty")]
    pub limits: Box<StageLimits>,
    /// Runtimes that agents may use; absent: all that the server offers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub runtimes: Option<Runtimes>,
}

/// When the withdrawal of a team takes effect. A disqualification takes effect at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum Withdrawals {
    /// None of its games of the round under way counts, not even those already played. The rule of tournaments that earlier versions
    /// opened.
    #[default]
    AtOnce,
    /// Its games of the round under way are played and count, so that a withdrawal cannot choose which of its opponents keep their
    /// points.
    AfterRound,
}

impl Withdrawals {
    /// Is it the rule of earlier versions, which is left out of JSON?
    #[must_use]
    pub const fn is_legacy(&self) -> bool {
        matches!(self, Self::AtOnce)
    }
}

/// Settings of a tournament that do not affect results.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(default, deny_unknown_fields)]
pub struct TournamentSettings {
    /// Test games (against a baseline) and friendly games (against another team) that a team may request per UTC day.
    #[serde(rename = "free_games_per_day")]
    pub test_and_friendly_games_per_day: u32,
    /// When the recordings of both sides become public: never, after the round (`at_release`), or when the tournament
    /// closes (`at_close`).
    pub publishes: Publication,
}

/// Invalid rules or settings of a tournament.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InvalidTournament {
    #[error("steps: expected 1 to {MAX_GAME_STEPS}, got {0}")]
    Steps(u32),
    #[error("format.{field}: expected at least {least}, got {got}")]
    Format {
        field: &'static str,
        least: u32,
        got: u32,
    },
    #[error("game_limits.{field}: expected {expected}, got {got}")]
    GameLimits {
        field: &'static str,
        expected: &'static str,
        got: f64,
    },
    #[error("the competition has no games of two agents")]
    NoGames,
    #[error("ruleset: {0}")]
    UnknownRuleset(#[from] UnknownRuleset),
    #[error("profile: {0}")]
    UnknownProfile(#[from] UnknownProfile),
    #[error("perturbations.{0}")]
    Perturbations(#[from] InvalidMagnitude),
    #[error("limits.{0}")]
    Limits(InvalidLimit),
    #[error("runtimes: {0}")]
    Runtimes(#[from] crate::InvalidRuntimes),
    #[error("free_games_per_day: expected 0 to {MAX_TEST_AND_FRIENDLY_GAMES}, got {0}")]
    TestAndFriendlyGames(u32),
}

const fn default_steps() -> u32 {
    GAME_WINDOWS * WINDOW_STEPS
}

impl TournamentRules {
    /// The rules of the original challenge, with a ruleset and a profile of the competition. Forfeits and withdrawals have the newer
    /// rules of this platform.
    #[must_use]
    pub fn new(ruleset: Ruleset, profile: Profile) -> Self {
        Self {
            ruleset,
            format: TournamentFormat::default(),
            steps: default_steps(),
            profile,
            mirrored: false,
            forfeit_score: ForfeitScore::TenOrLead,
            withdrawals: Withdrawals::AfterRound,
            game_limits: GameLimits::default(),
            perturbations: Magnitudes::default(),
            limits: Box::default(),
            runtimes: None,
        }
    }

    /// Does a team that leaves in this way play the round under way to its end?
    #[must_use]
    pub fn finishes_round(&self, departure: DepartureKind) -> bool {
        departure == DepartureKind::Withdrawn && self.withdrawals == Withdrawals::AfterRound
    }

    /// Checks that games are possible under these rules.
    ///
    /// # Errors
    /// The first invalid field.
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
            max_answer_s,
            total_s,
            restart_s,
            max_faults: _,
        } = self.game_limits;
        for (field, got, most, expected) in [
            // The name of `max_answer_s` in JSON.
            ("in_time_s", max_answer_s, 1.0, "above 0, at most 1"),
            ("total_s", total_s, 86_400.0, "above 0, at most 86400"),
            ("restart_s", restart_s, 600.0, "above 0, at most 600"),
        ] {
            // The negation also refuses NaN.
            if !(got > 0.0 && got <= most) {
                return Err(InvalidTournament::GameLimits {
                    field,
                    expected,
                    got,
                });
            }
        }
        if let Some(runtimes) = &self.runtimes {
            runtimes.check()?;
        }
        self.limits.check().map_err(InvalidTournament::Limits)
    }
}

impl Default for TournamentSettings {
    fn default() -> Self {
        Self {
            test_and_friendly_games_per_day: 5,
            publishes: Publication::AtClose,
        }
    }
}

impl TournamentSettings {
    /// Checks that all settings are in range.
    ///
    /// # Errors
    /// The first setting that is out of range.
    pub const fn check(&self) -> Result<(), InvalidTournament> {
        if self.test_and_friendly_games_per_day > MAX_TEST_AND_FRIENDLY_GAMES {
            return Err(InvalidTournament::TestAndFriendlyGames(
                self.test_and_friendly_games_per_day,
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rules as stored in JSON: these fields, ruleset and profile; all others are absent.
    fn rules(json: &str) -> Result<TournamentRules, serde_json::Error> {
        let mut fields: serde_json::Map<String, serde_json::Value> = serde_json::from_str(json)?;
        fields.insert("ruleset".to_owned(), "airhockey-2023.3".into());
        fields.insert("profile".to_owned(), "evaluation".into());
        serde_json::from_value(fields.into())
    }

    #[test]
    fn absent_rules_are_those_of_the_challenge() {
        let rules = rules("{}").unwrap();
        let new = TournamentRules::new(rules.ruleset, rules.profile);
        // Rules stored by earlier versions do not have these two fields. So without them, the rules of those versions hold.
        let earlier = TournamentRules {
            forfeit_score: ForfeitScore::Ten,
            withdrawals: Withdrawals::AtOnce,
            ..new.clone()
        };
        assert_eq!(rules, earlier);
        let text = serde_json::to_string(&new).unwrap();
        assert!(
            text.contains(r#""forfeit_score":"ten_or_lead","withdrawals":"after_round""#),
            "{text}"
        );
        assert_eq!(serde_json::from_str::<TournamentRules>(&text).unwrap(), new);

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
    fn invalid_tournament_rules_are_refused_by_name() {
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
            let error = rules(json).unwrap().check().unwrap_err().to_string();
            assert!(error.contains(words), "{json}: {error}");
        }
        for json in [
            r#"{"step":1}"#,
            r#"{"format":{"kind":"knockout"}}"#,
            r#"{"format":{"kind":"swiss","rounds":0}}"#,
            r#"{"format":{"kind":"swiss","rounds":3,"groups":1}}"#,
        ] {
            assert!(rules(json).is_err(), "{json}");
        }
        let many = TournamentSettings {
            test_and_friendly_games_per_day: MAX_TEST_AND_FRIENDLY_GAMES + 1,
            ..TournamentSettings::default()
        };
        assert_eq!(
            many.check(),
            Err(InvalidTournament::TestAndFriendlyGames(1001))
        );
    }
}
