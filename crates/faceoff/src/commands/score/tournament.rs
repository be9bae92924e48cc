//! Scores a tournament from its games: results with reasons, standings, head-to-head records and ratings.

use super::{lines::write_line, scored_tournament::ScoredTournament, table};
use anyhow::ensure;
use clap::Args;
use faceoff_scoring::tournament::{
    Bye, Departure, DepartureKind, Departures, PlayedGame, RoundNumber, head_to_head,
    rating::{RatingError, rate},
    score_tournament_with,
};
use faceoff_types::TeamName;
use std::{
    io::{IsTerminal as _, Write},
    str::FromStr,
};

#[derive(Debug, Clone, Default, Args)]
pub struct TournamentArgs {
    /// A team that withdrew, and the first round whose games do not count, such as Alpha=3
    #[arg(long, value_name = "TEAM=ROUND")]
    withdrawn: Vec<TeamAndRound>,
    /// A disqualified team, and the first round whose games do not count; the team is ranked below all others
    #[arg(long, value_name = "TEAM=ROUND")]
    disqualified: Vec<TeamAndRound>,
    /// A round in which a team had a bye, which counts as a win, as in Swiss tournaments
    #[arg(long = "bye", value_name = "TEAM=ROUND")]
    byes: Vec<TeamAndRound>,
    /// Print JSON [default if standard output is not a terminal]
    #[arg(long, conflicts_with = "table")]
    json: bool,
    /// Print tables [default if standard output is a terminal]
    #[arg(long)]
    table: bool,
}

#[derive(Debug, Clone)]
struct TeamAndRound {
    team: TeamName,
    round: RoundNumber,
}

impl FromStr for TeamAndRound {
    type Err = String;
    fn from_str(s: &str) -> Result<Self, String> {
        // Names of teams have no equals sign.
        let (team, round) = s
            .split_once('=')
            .ok_or("expected a team and a round, as in \"AJoy=2\"")?;
        let number: u32 = round
            .parse()
            .map_err(|_| format!("round: expected a number, got {round:?}"))?;
        Ok(Self {
            team: team.parse().map_err(|error| format!("{error}"))?,
            round: number
                .try_into()
                .map_err(|error| format!("round: {error}"))?,
        })
    }
}

impl TournamentArgs {
    /// Scores the games and prints the results.
    ///
    /// # Errors
    /// If a team leaves twice or has no game, a mirrored pair is invalid, or writing fails.
    pub fn score(
        self,
        games: &[PlayedGame],
        out: &mut impl Write,
        warnings: &mut impl Write,
    ) -> anyhow::Result<()> {
        let as_table = self.table || (!self.json && std::io::stdout().is_terminal());
        let byes: Vec<Bye> = self
            .byes
            .iter()
            .map(|bye| Bye {
                team: bye.team.clone(),
                round: bye.round,
            })
            .collect();
        let departures = self.departures(games)?;
        let ratings = match rate(departures.counting_games(games)) {
            Ok(ratings) => Some(ratings),
            Err(RatingError::Pair(invalid)) => return Err(invalid.into()),
            Err(too_many @ RatingError::TooMany(_)) => {
                writeln!(warnings, "warning: no ratings: {too_many}")?;
                None
            }
        };
        let scored = ScoredTournament {
            tournament: score_tournament_with(games, &departures, &byes),
            head_to_head: head_to_head(departures.counting_games(games)),
            ratings,
        };
        for repeated in &scored.tournament.repeated_pairings {
            let [a, b] = &repeated.teams;
            writeln!(
                warnings,
                "warning: {a} and {b} meet {} times in round {}; every game counts",
                repeated.games, repeated.round
            )?;
        }
        if as_table {
            table::write(out, &scored)
        } else {
            write_line(out, &scored)
        }
    }

    fn departures(self, games: &[PlayedGame]) -> anyhow::Result<Departures> {
        let list = |teams: Vec<TeamAndRound>, kind| {
            teams
                .into_iter()
                .map(move |TeamAndRound { team, round }| Departure {
                    team,
                    kind,
                    from_round: round,
                })
        };
        let departures = Departures::new(
            list(self.withdrawn, DepartureKind::Withdrawn)
                .chain(list(self.disqualified, DepartureKind::Disqualified)),
        )?;
        for team in departures.teams() {
            ensure!(
                games.iter().any(|game| game.teams().contains(&team)),
                "{team} is named as withdrawn or disqualified, but has no game; check the name"
            );
        }
        Ok(departures)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    impl TournamentArgs {
        /// `--json`, without departures and byes.
        pub const JSON: Self = Self {
            withdrawn: Vec::new(),
            disqualified: Vec::new(),
            byes: Vec::new(),
            json: true,
            table: false,
        };
    }

    fn games(games: &Value) -> Vec<PlayedGame> {
        serde_json::from_value(games.clone()).unwrap()
    }

    /// Scores the games; returns standard output and the warnings.
    fn score(args: TournamentArgs, input: &Value) -> anyhow::Result<(String, String)> {
        let (mut out, mut warnings) = (Vec::new(), Vec::new());
        args.score(&games(input), &mut out, &mut warnings)?;
        Ok((String::from_utf8(out)?, String::from_utf8(warnings)?))
    }

    /// `--table`, with departures as `TEAM=ROUND`.
    fn table(withdrawn: &[&str], disqualified: &[&str]) -> TournamentArgs {
        let list = |teams: &[&str]| teams.iter().map(|team| team.parse().unwrap()).collect();
        TournamentArgs {
            withdrawn: list(withdrawn),
            disqualified: list(disqualified),
            byes: Vec::new(),
            json: false,
            table: true,
        }
    }

    /// A game that the home side wins whatever the score: with more than 135 penalty points the away side is non-deployable.
    fn game(round: u32, home: &str, away: &str, goals: [u32; 2]) -> Value {
        json!({"round": round, "home": home, "away": away, "goals": goals, "fouls": [4, 0],
               "penalty_points": [20, 140.5]})
    }

    #[test]
    fn tables_show_reasons_and_games_that_do_not_count() {
        let mut unfinished = game(2, "Ajax", "Zed", [3, 4]);
        unfinished["submissions"] = json!(["v1", "v2"]);
        let input = json!([game(1, "Zed", "Ajax", [0, 2]), unfinished]);
        let (out, warnings) = score(table(&["Zed=2"], &[]), &input).unwrap();
        assert_eq!(warnings, "");
        let lines: Vec<Vec<&str>> = out
            .lines()
            .map(|line| line.split_whitespace().collect())
            .collect();
        let words = |line: usize| lines[line].join(" ");
        assert_eq!(
            words(0),
            "round home away score goals fouls penalty points winner reason"
        );
        assert_eq!(
            words(1),
            "1 Zed Ajax 0-3 0-2 4-0 20.0 / 140.5 Zed the other side is non-deployable; the winner did not lead"
        );
        assert_eq!(
            words(2),
            "2 Ajax Zed 3-5 3-4 4-0 20.0 / 140.5 Ajax the other side is non-deployable; the winner did not lead \
             (does not count: Zed left)"
        );
        assert_eq!(words(5), "1 Zed 3 1 0 0 0-2 20.0 3 + 0 (withdrawn)");
        assert_eq!(words(6), "2 Ajax 0 0 0 1 2-0 140.5 0 + 0");
        assert_eq!(words(9), "Ajax Zed 0 0 1 2-0");
        assert_eq!(words(11), "ratings by results");
        assert_eq!(words(13), "Zed 1630 unknown 1");
    }

    #[test]
    fn submissions_are_rated_separately() {
        let labelled = |round, goals: [u32; 2], label: &str| {
            json!({"round": round, "home": "Ajax", "away": "Zed", "goals": goals, "fouls": [0, 0],
                   "penalty_points": [0, 0], "submissions": [label, label]})
        };
        let input = json!([
            labelled(1, [1, 0], "v1"),
            labelled(2, [2, 0], "v1"),
            labelled(3, [0, 1], "v2")
        ]);
        let (out, _) = score(table(&[], &[]), &input).unwrap();
        assert!(
            out.contains(
                "ratings by results, pool 1 of 2 (the pools have no games against each other)"
            ),
            "{out}"
        );
        let row = out
            .lines()
            .find(|line| line.starts_with("Ajax (v1)"))
            .unwrap();
        assert!(row.contains("above 16"), "{row}");
        assert!(out.contains("below 1"), "{out}");
        assert!(out.contains("Zed (v2)"), "{out}");
        assert!(out.contains("prior 1500 ± 350"), "{out}");
    }

    #[test]
    fn disqualified_team_is_ranked_last() {
        // Zed wins by the tiers.
        let input = json!([game(1, "Zed", "Ajax", [0, 2])]);
        let (out, _) = score(table(&[], &["Zed=2"]), &input).unwrap();
        let position = |text: &str| out.find(text).unwrap();
        assert!(position("   1  Ajax") < position("   2  Zed "), "{out}");
        assert!(out.contains("(disqualified)"), "{out}");
    }

    #[test]
    fn departure_without_team_or_round_is_refused() {
        for (text, expected) in [
            ("Zed", "expected a team and a round, as in \"AJoy=2\""),
            ("Zed=two", "round: expected a number, got \"two\""),
            ("Zed=0", "round: expected 1 to 100, got 0"),
            (
                "<b>=1",
                "a team name has letters and digits of any script, spaces and . _ - ' & + · only, not '<'",
            ),
        ] {
            assert_eq!(text.parse::<TeamAndRound>().unwrap_err(), expected);
        }
        let input = json!([game(1, "Zed", "Ajax", [0, 2])]);
        let error = |args| format!("{:#}", score(args, &input).unwrap_err());
        assert_eq!(
            error(table(&["Zde=1"], &[])),
            "Zde is named as withdrawn or disqualified, but has no game; check the name"
        );
        assert_eq!(
            error(table(&["Zed=1"], &["Zed=2"])),
            "Zed has two departures; keep the one that counts"
        );
    }

    #[test]
    fn too_many_teams_are_scored_without_ratings() {
        let chain: Vec<Value> = (0..200)
            .map(|n| game(1, &format!("T{n}"), &format!("T{}", n + 1), [1, 0]))
            .collect();
        let (out, warnings) = score(TournamentArgs::JSON, &json!(chain)).unwrap();
        let out: Value = serde_json::from_str(&out).unwrap();
        assert_eq!(out["standings"].as_array().unwrap().len(), 201);
        assert_eq!(out.get("ratings"), None);
        assert!(
            warnings.starts_with("warning: no ratings: ratings are for at most 200"),
            "{warnings}"
        );
    }

    #[test]
    fn invalid_mirrored_pair_is_refused() {
        let mut half = game(1, "Zed", "Ajax", [0, 2]);
        half["pair"] = json!(1);
        let error = score(TournamentArgs::JSON, &json!([half, half])).unwrap_err();
        assert!(error.to_string().contains("sides swapped"), "{error}");
    }
}
