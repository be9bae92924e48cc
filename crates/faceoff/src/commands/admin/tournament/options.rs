//! Options of `faceoff admin tournament open` and `change`, and the JSON of the API's rules and settings that they stand for.

use crate::competition::parse_profile;
use anyhow::Context;
use clap::{Args, ValueEnum};
use faceoff_types::{Profile, Publication};
use serde_json::{Map, Value, json};

/// Rules and settings of a tournament. An option that is left out keeps its value; in a new tournament it has the value of the
/// Robot Air Hockey Challenge 2023.
#[derive(Debug, Args)]
pub(in crate::commands::admin) struct TournamentOptions {
    /// Pairing: round robin; drawn groups and a final of their best teams; Swiss system
    #[arg(long, value_name = "FORMAT")]
    format: Option<Format>,
    /// Number of rounds, of round-robin (default 2) and swiss
    #[arg(long, value_name = "N", requires = "format")]
    rounds: Option<u32>,
    /// Number of groups
    #[arg(long, value_name = "N", requires = "format")]
    groups: Option<u32>,
    /// Teams of each group that reach the final (default 1)
    #[arg(long, value_name = "N", requires = "format")]
    advance: Option<u32>,
    /// Control steps per game; 45000 are 15 minutes
    #[arg(long, value_name = "N")]
    steps: Option<u32>,
    /// Perturbation profile
    #[arg(long, value_parser = parse_profile)]
    profile: Option<Profile>,
    /// Play each meeting as a mirrored pair: two games on one seed with swapped sides
    #[arg(long, value_name = "true|false")]
    mirrored: Option<bool>,
    /// Further rules in the API's format, e.g. '{"game_limits":{"max_faults":5}}'
    #[arg(long, value_name = "JSON", value_parser = parse_object)]
    rules: Option<Map<String, Value>>,
    /// Friendly and test games that a team may request per UTC day
    #[arg(long, value_name = "N")]
    free_games: Option<u32>,
    /// When the recordings of games are published: never, at_close or at_release (of their round)
    #[arg(long, value_name = "TIME")]
    publishes: Option<Publication>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    RoundRobin,
    Groups,
    Swiss,
}

impl TournamentOptions {
    /// The rules that the options set.
    pub(super) fn rules(&self) -> anyhow::Result<Option<Map<String, Value>>> {
        let mut rules = self.rules.clone().unwrap_or_default();
        let option_values = [
            ("format", self.format()?),
            ("steps", self.steps.map(|steps| json!(steps))),
            ("profile", self.profile.map(|profile| json!(profile))),
            ("mirrored", self.mirrored.map(|mirrored| json!(mirrored))),
        ];
        for (name, value) in option_values {
            if let Some(value) = value {
                rules.insert(name.to_owned(), value);
            }
        }
        Ok(Some(rules).filter(|rules| !rules.is_empty()))
    }

    fn format(&self) -> anyhow::Result<Option<Value>> {
        let Some(format) = self.format else {
            return Ok(None);
        };
        let refuse_value = |value: Option<u32>, option: &str| match value {
            Some(_) => anyhow::bail!("--{option} does not apply to this --format; leave it out"),
            None => Ok(()),
        };
        Ok(Some(match format {
            Format::Groups => {
                refuse_value(self.rounds, "rounds")?;
                let groups = self.groups.context("--format groups needs --groups N")?;
                let advance = self.advance.unwrap_or(1);
                json!({"kind": "groups", "groups": groups, "advance": advance})
            }
            Format::RoundRobin | Format::Swiss => {
                refuse_value(self.groups, "groups")?;
                refuse_value(self.advance, "advance")?;
                if format == Format::RoundRobin {
                    json!({"kind": "round_robin", "rounds": self.rounds.unwrap_or(2)})
                } else {
                    let rounds = self.rounds.context("--format swiss needs --rounds N")?;
                    json!({"kind": "swiss", "rounds": rounds})
                }
            }
        }))
    }

    /// The settings that the options set.
    pub(super) fn settings(&self) -> Option<Map<String, Value>> {
        let option_values = [
            (
                "free_games_per_day",
                self.free_games.map(|games| json!(games)),
            ),
            ("publishes", self.publishes.map(|when| json!(when))),
        ];
        let settings: Map<String, Value> = option_values
            .into_iter()
            .filter_map(|(name, value)| Some((name.to_owned(), value?)))
            .collect();
        Some(settings).filter(|settings| !settings.is_empty())
    }
}

fn parse_object(text: &str) -> Result<Map<String, Value>, String> {
    serde_json::from_str(text).map_err(|error| format!("expected a JSON object: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Debug, Parser)]
    struct TestCommand {
        #[command(flatten)]
        options: TournamentOptions,
    }

    fn options(args: &[&str]) -> TournamentOptions {
        let args = ["open"].iter().chain(args);
        TestCommand::try_parse_from(args).unwrap().options
    }

    #[test]
    fn options_become_valid_rules_and_settings() {
        let rules = |args: &[&str]| options(args).rules().unwrap().unwrap();
        // Of `--steps` and "steps" in `--rules`, the option counts.
        let all = rules(&[
            "--format",
            "groups",
            "--groups",
            "2",
            "--steps",
            "1500",
            "--mirrored",
            "true",
            "--rules",
            r#"{"game_limits":{"max_faults":5},"steps":7}"#,
        ]);
        assert_eq!(
            Value::Object(all.clone()),
            json!({"format": {"kind": "groups", "groups": 2, "advance": 1}, "steps": 1500, "mirrored": true,
                   "game_limits": {"max_faults": 5}})
        );
        for rules in [
            all,
            rules(&["--format", "round-robin"]),
            rules(&["--format", "swiss", "--rounds", "3", "--profile", "ideal"]),
        ] {
            let defaults = crate::competition::competition().tournament_rules();
            let mut merged = json!(defaults);
            merged.as_object_mut().unwrap().extend(rules);
            let rules: faceoff_types::TournamentRules = serde_json::from_value(merged).unwrap();
            assert_eq!(rules.check(), Ok(()));
        }
        assert_eq!(options(&[]).rules().unwrap(), None);
        assert_eq!(options(&[]).settings(), None);
        let settings = options(&["--free-games", "2", "--publishes", "at_release"]);
        let settings = Value::Object(settings.settings().unwrap());
        let parsed: faceoff_types::TournamentSettings =
            serde_json::from_value(settings.clone()).unwrap();
        assert_eq!(json!(parsed), settings);
    }

    #[test]
    fn missing_or_inapplicable_option_is_named() {
        for (args, expected) in [
            (&["--format", "groups"][..], "--groups N"),
            (&["--format", "swiss"], "--rounds N"),
            (
                &["--format", "swiss", "--groups", "2"],
                "--groups does not apply",
            ),
            (
                &["--format", "groups", "--groups", "2", "--rounds", "2"],
                "--rounds does not apply",
            ),
        ] {
            let error = options(args).rules().unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
        assert!(TestCommand::try_parse_from(["open", "--rules", "[]"]).is_err());
        assert!(TestCommand::try_parse_from(["open", "--rounds", "2"]).is_err());
    }
}
