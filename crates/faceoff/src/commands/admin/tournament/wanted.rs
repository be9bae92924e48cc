use anyhow::Context;
use clap::{Args, ValueEnum};
use faceoff_types::{Profile, Publishes};
use serde_json::{Map, Value, json};

/// How a tournament is to be; what is left out stays as it is, or is as the challenge had it.
#[derive(Debug, Args)]
pub(in crate::commands::admin) struct Wanted {
    /// Who meets whom: everybody everybody in each round; drawn groups and a final among their best; Swiss
    #[arg(long, value_name = "FORMAT")]
    format: Option<Format>,
    /// How many rounds, of round-robin (2 unless given) and swiss
    #[arg(long, value_name = "N", requires = "format")]
    rounds: Option<u32>,
    /// How many groups
    #[arg(long, value_name = "N", requires = "format")]
    groups: Option<u32>,
    /// How many of each group reach the final (1 unless given)
    #[arg(long, value_name = "N", requires = "format")]
    advance: Option<u32>,
    /// Control steps of a game; 45000 are 15 minutes
    #[arg(long, value_name = "N")]
    steps: Option<u32>,
    /// Perturbation profile
    #[arg(long)]
    profile: Option<Profile>,
    /// Is each meeting a mirrored pair: two games of one seed, sides swapped?
    #[arg(long, value_name = "true|false")]
    mirrored: Option<bool>,
    /// Further rules as the API has them, e.g. '{"game_limits":{"max_faults":5}}'
    #[arg(long, value_name = "JSON", value_parser = object)]
    rules: Option<Map<String, Value>>,
    /// Games that do not count which a team may ask for on a UTC day
    #[arg(long, value_name = "N")]
    free_games: Option<u32>,
    /// When both sides' recordings are there for everybody: never, at_close or at_release (of their round)
    #[arg(long, value_name = "WHEN")]
    publishes: Option<Publishes>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    RoundRobin,
    Groups,
    Swiss,
}

impl Wanted {
    /// What of the rules was given.
    pub(super) fn rules(&self) -> anyhow::Result<Option<Map<String, Value>>> {
        let mut rules = self.rules.clone().unwrap_or_default();
        let given = [
            ("format", self.format()?),
            ("steps", self.steps.map(|steps| json!(steps))),
            ("profile", self.profile.map(|profile| json!(profile))),
            ("mirrored", self.mirrored.map(|mirrored| json!(mirrored))),
        ];
        for (name, value) in given {
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
        let refused = |given: Option<u32>, option: &str| match given {
            Some(_) => anyhow::bail!("--{option} says nothing of this --format; leave it out"),
            None => Ok(()),
        };
        Ok(Some(match format {
            Format::Groups => {
                refused(self.rounds, "rounds")?;
                let groups = self.groups.context("how many groups? --groups N")?;
                let advance = self.advance.unwrap_or(1);
                json!({"kind": "groups", "groups": groups, "advance": advance})
            }
            Format::RoundRobin | Format::Swiss => {
                refused(self.groups, "groups")?;
                refused(self.advance, "advance")?;
                if format == Format::RoundRobin {
                    json!({"kind": "round_robin", "rounds": self.rounds.unwrap_or(2)})
                } else {
                    let rounds = self.rounds.context("how many rounds? --rounds N")?;
                    json!({"kind": "swiss", "rounds": rounds})
                }
            }
        }))
    }

    /// What of the settings was given.
    pub(super) fn settings(&self) -> Option<Map<String, Value>> {
        let given = [
            (
                "free_games_per_day",
                self.free_games.map(|many| json!(many)),
            ),
            ("publishes", self.publishes.map(|when| json!(when))),
        ];
        let settings: Map<String, Value> = given
            .into_iter()
            .filter_map(|(name, value)| Some((name.to_owned(), value?)))
            .collect();
        Some(settings).filter(|settings| !settings.is_empty())
    }
}

fn object(text: &str) -> Result<Map<String, Value>, String> {
    serde_json::from_str(text).map_err(|error| format!("expected a JSON object: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Debug, Parser)]
    struct Line {
        #[command(flatten)]
        wanted: Wanted,
    }

    fn wanted(args: &[&str]) -> Wanted {
        let args = ["open"].iter().chain(args);
        Line::try_parse_from(args).unwrap().wanted
    }

    #[test]
    fn options_are_fields_of_the_rules_that_a_tournament_can_have() {
        let rules = |args: &[&str]| wanted(args).rules().unwrap().unwrap();
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
            let rules: faceoff_types::TournamentRules =
                serde_json::from_value(Value::Object(rules)).unwrap();
            assert_eq!(rules.check(), Ok(()));
        }
        assert_eq!(wanted(&[]).rules().unwrap(), None);
        assert_eq!(wanted(&[]).settings(), None);
        let settings = wanted(&["--free-games", "2", "--publishes", "at_release"]);
        let settings = Value::Object(settings.settings().unwrap());
        let read: faceoff_types::TournamentSettings =
            serde_json::from_value(settings.clone()).unwrap();
        assert_eq!(json!(read), settings);
    }

    #[test]
    fn what_a_format_lacks_or_does_not_have_is_named() {
        for (args, words) in [
            (&["--format", "groups"][..], "--groups N"),
            (&["--format", "swiss"], "--rounds N"),
            (
                &["--format", "swiss", "--groups", "2"],
                "--groups says nothing",
            ),
            (
                &["--format", "groups", "--groups", "2", "--rounds", "2"],
                "--rounds says nothing",
            ),
        ] {
            let error = wanted(args).rules().unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
        assert!(Line::try_parse_from(["open", "--rules", "[]"]).is_err());
        assert!(Line::try_parse_from(["open", "--rounds", "2"]).is_err());
    }
}
