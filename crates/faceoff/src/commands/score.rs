//! `faceoff score`: computes boards and tournament standings from files. A *board* ranks teams by their results in the tasks,
//! *standings* rank them by their games.

mod lines;
mod scored_tournament;
pub(super) mod table;
mod tournament;

use crate::competition::{competition, parse_weights};
use crate::terminal;
use anyhow::{Context as _, bail, ensure};
use clap::{Args, Subcommand};
use faceoff_scoring::{QualifyingScores, tournament::PlayedGame};
use faceoff_types::{TaskWeights, TierBounds};
use lines::write_line;
use serde::de::DeserializeOwned;
use std::io::{IsTerminal as _, Read, Write};
use tournament::TournamentArgs;

/// Far more than the results of any competition; the limit keeps a wrong file from filling the memory.
const INPUT_LIMIT_BYTES: u64 = 64 << 20;

/// Scores results from a file: a qualifying board or a tournament.
#[derive(Debug, Args)]
pub struct ScoreCommand {
    #[command(subcommand)]
    kind: Kind,
}

#[derive(Debug, Clone, Subcommand)]
enum Kind {
    /// Read tasks.json from standard input and print the board, one JSON object per row, best first
    ///
    /// Input: {"TEAM": {"hit": {"success_rate": 0.549, "penalty_points": 327.5}, "defend": {…},
    /// "prepare": {…}}, …}. Rates are fractions. "episodes" is optional, default 1000. The tasks of a
    /// results.json can be used unchanged. Teams with equal results keep the sequence of the file.
    Qualifying {
        /// Weights of hit, defend and prepare [default: 0.4,0.4,0.2]
        #[arg(long, value_name = "WEIGHTS", value_parser = parse_weights)]
        weights: Option<TaskWeights>,
        /// Penalty points per episode up to which a team is deployable and improvable [default: 0.5,1.5]
        #[arg(long, value_name = "BOUNDS")]
        tier_bounds: Option<TierBounds>,
    },
    /// Read games.json from standard input and print winners with reasons, standings, head-to-head records and
    /// ratings, as one JSON object or as tables
    ///
    /// Input: [{"round": 1, "home": "A", "away": "B", "goals": [10, 0], "fouls": [0, 0],
    /// "penalty_points": [62.0, 384.0]}, …], or the final "score" instead of "fouls". Optional fields:
    /// "windows", default 90; "forfeit": [null, "faults"] (or "time"), the side that forfeited;
    /// "submissions": ["v1", "v3"], the submissions, which are rated separately; "pair": 7, the number of the
    /// mirrored pair that the game belongs to.
    Tournament(TournamentArgs),
}

impl ScoreCommand {
    /// Scores the data on standard input.
    ///
    /// # Errors
    /// If the input violates the rules (the error names team or game and field), or reading or writing fails.
    pub fn run(self) -> anyhow::Result<()> {
        let stdin = std::io::stdin();
        ensure!(
            !stdin.is_terminal(),
            "expected {} on standard input, as in `faceoff score {} < {}`",
            self.kind.file(),
            self.kind.name(),
            self.kind.file()
        );
        let mut out = terminal::stdout();
        self.kind
            .score(stdin.lock(), &mut out, &mut terminal::stderr())?;
        out.flush().context("standard output")
    }
}

impl Kind {
    const fn name(&self) -> &'static str {
        match self {
            Self::Qualifying { .. } => "qualifying",
            Self::Tournament(_) => "tournament",
        }
    }

    const fn file(&self) -> &'static str {
        match self {
            Self::Qualifying { .. } => "tasks.json",
            Self::Tournament(_) => "games.json",
        }
    }

    fn score(
        self,
        input: impl Read,
        out: &mut impl Write,
        warnings: &mut impl Write,
    ) -> anyhow::Result<()> {
        let file = self.file();
        let input = read_all(input, file)?;
        match self {
            Self::Qualifying {
                weights,
                tier_bounds,
            } => {
                let scores: QualifyingScores = parse(&input, file)?;
                let weights = weights.unwrap_or_else(|| competition().weights(&Default::default()));
                ensure!(
                    tier_bounds.is_none() || competition().tiers.is_some(),
                    "--tier-bounds: the competition has no tiers; leave it out"
                );
                let board = scores.board(&weights, tier_bounds.or(competition().tiers));
                for row in board.with_context(|| file)? {
                    write_line(out, &row)?;
                }
            }
            Self::Tournament(args) => {
                let games: Vec<PlayedGame> = parse(&input, file)?;
                args.score(&games, out, warnings)?;
            }
        }
        Ok(())
    }
}

fn read_all(input: impl Read, file: &str) -> anyhow::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    input
        .take(INPUT_LIMIT_BYTES + 1)
        .read_to_end(&mut bytes)
        .context("standard input")?;
    ensure!(
        bytes.len() as u64 <= INPUT_LIMIT_BYTES,
        "{file}: expected at most {INPUT_LIMIT_BYTES} bytes, got more"
    );
    if bytes.iter().all(u8::is_ascii_whitespace) {
        bail!("{file}: expected JSON on standard input, got nothing");
    }
    Ok(bytes)
}

/// Parses JSON; an error names team or game, field, line and column.
fn parse<T: DeserializeOwned>(json: &[u8], file: &str) -> anyhow::Result<T> {
    let mut deserializer = serde_json::Deserializer::from_slice(json);
    let value = serde_path_to_error::deserialize(&mut deserializer)
        .map_err(|error| anyhow::anyhow!("{file}: {error}"))?;
    deserializer
        .end()
        .with_context(|| format!("{file}: after the end of the data"))?;
    Ok(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    const QUALIFYING: Kind = Kind::Qualifying {
        weights: None,
        tier_bounds: None,
    };

    const TOURNAMENT: Kind = Kind::Tournament(TournamentArgs::JSON);

    /// Scores the input; returns the outcome, the printed rows and the warnings.
    fn score(kind: Kind, input: &str) -> (anyhow::Result<()>, Vec<Value>, String) {
        let (mut out, mut warnings) = (Vec::new(), Vec::new());
        let outcome = kind.score(input.as_bytes(), &mut out, &mut warnings);
        let lines = String::from_utf8(out).unwrap();
        let rows = lines
            .lines()
            .map(|line| serde_json::from_str(line).unwrap())
            .collect();
        (outcome, rows, String::from_utf8(warnings).unwrap())
    }

    fn error(kind: Kind, input: &str) -> String {
        let (outcome, rows, _) = score(kind, input);
        assert_eq!(rows, Vec::<Value>::new(), "no partial board is printed");
        format!("{:#}", outcome.unwrap_err())
    }

    /// The tasks of a team with this success rate and penalty points in the task hit.
    fn tasks(hit_rate: f64, penalty_points: f64) -> Value {
        let other = json!({"success_rate": 0.5, "penalty_points": 0});
        let hit = json!({"success_rate": hit_rate, "penalty_points": penalty_points});
        json!({"hit": hit, "defend": other, "prepare": other})
    }

    #[test]
    fn board_is_one_json_object_per_row_by_rank() {
        let input = json!({"A": tasks(0.9, 501.0), "B": tasks(0.1, 0.0), "C": tasks(0.2, 10.0)});
        let (outcome, rows, _) = score(QUALIFYING, &input.to_string());
        outcome.unwrap();
        let brief: Vec<_> = rows
            .iter()
            .map(|row| json!([row["rank"], row["team"], row["tier"], row["score"]]))
            .collect();
        assert_eq!(
            Value::from(brief),
            json!([
                [1, "C", "deployable", 38.0],
                [2, "B", "deployable", 34.0],
                [3, "A", "improvable", 66.0]
            ])
        );
        let task = &rows[2]["tasks"]["hit"];
        assert_eq!(
            (&task["success_rate"], &task["penalty_points"]),
            (&json!(0.9), &json!(501.0))
        );
        assert_eq!(
            (&task["tier"], &task["rank"]),
            (&json!("improvable"), &json!(3))
        );
    }

    #[test]
    fn custom_weights_and_bounds_apply() {
        let input = json!({"A": tasks(0.9, 501.0), "B": tasks(0.1, 0.0)}).to_string();
        let kind = Kind::Qualifying {
            weights: Some(parse_weights("1,0,0").unwrap()),
            tier_bounds: Some("0.6,0.7".parse().unwrap()),
        };
        let (outcome, rows, _) = score(kind, &input);
        outcome.unwrap();
        let brief: Vec<_> = rows
            .iter()
            .map(|row| json!([row["team"], row["tier"], row["score"]]))
            .collect();
        assert_eq!(
            Value::from(brief),
            json!([["A", "deployable", 90.0], ["B", "deployable", 10.0]])
        );
    }

    #[test]
    fn tournament_is_one_object_with_games_and_standings() {
        let game = json!({"round": 1, "home": "A", "away": "B", "goals": [1, 4], "fouls": [0, 9],
            "penalty_points": [136.0, 12]});
        let (outcome, rows, warnings) = score(TOURNAMENT, &json!([game, game]).to_string());
        outcome.unwrap();
        assert_eq!(rows.len(), 1);
        assert_eq!(rows[0]["games"][0]["winner"], "B");
        assert_eq!(rows[0]["games"][1]["score"], json!([4, 4]));
        assert_eq!(rows[0]["standings"][0]["team"], "B");
        assert_eq!(rows[0]["standings"][0]["points_per_round"], json!([6]));
        let reason = json!([
            rows[0]["games"][0]["won_by"],
            rows[0]["games"][0]["winner_led"]
        ]);
        assert_eq!(reason, json!(["tier", false]));
        let record = json!({"teams": ["A", "B"], "wins": [0, 2], "draws": 0, "goals": [2, 8]});
        assert_eq!(rows[0]["head_to_head"], json!([record]));
        let best = &rows[0]["ratings"]["results"][0]["ratings"][0];
        assert_eq!((&best["team"], &best["games"]), (&json!("B"), &json!(2)));
        assert_eq!(
            warnings,
            "warning: A and B meet 2 times in round 1; every game counts\n"
        );
    }

    #[test]
    fn error_names_file_place_and_value() {
        let wrong = json!({"Alpha": tasks(54.9, 0.0)}).to_string();
        let got = error(QUALIFYING, &wrong);
        assert!(
            got.starts_with("tasks.json: Alpha.hit: success_rate: expected"),
            "{got}"
        );
        assert!(got.contains("got 54.9"), "{got}");
        for (kind, input, expected) in [
            (
                QUALIFYING,
                "",
                "tasks.json: expected JSON on standard input, got nothing",
            ),
            (
                TOURNAMENT,
                " \n",
                "games.json: expected JSON on standard input, got nothing",
            ),
            (
                QUALIFYING,
                "{} {}",
                "tasks.json: after the end of the data: trailing",
            ),
            (QUALIFYING, "{\"A\"", "tasks.json: "),
            (
                TOURNAMENT,
                "{}",
                "games.json: invalid type: map, expected a sequence",
            ),
            (
                TOURNAMENT,
                "\u{0}\u{1}",
                "games.json: expected value at line 1 column 1",
            ),
        ] {
            let got = error(kind, input);
            assert!(got.starts_with(expected), "{input:?}: {got}");
        }
        let deep = "[".repeat(100_000);
        assert!(error(TOURNAMENT, &deep).starts_with("games.json: "));
        let not_utf8 = error_of_bytes(b"{\"\xff\": 1}");
        assert!(not_utf8.starts_with("tasks.json: "), "{not_utf8}");
    }

    fn error_of_bytes(input: &[u8]) -> String {
        let outcome = QUALIFYING.score(input, &mut Vec::new(), &mut Vec::new());
        format!("{:#}", outcome.unwrap_err())
    }

    #[test]
    fn endless_input_is_refused() {
        let endless = std::io::repeat(b' ');
        let outcome = QUALIFYING.score(endless, &mut Vec::new(), &mut Vec::new());
        assert!(format!("{:#}", outcome.unwrap_err()).contains("at most 67108864 bytes"));
    }

    #[test]
    fn empty_input_is_an_empty_board() {
        let (outcome, rows, _) = score(QUALIFYING, "{}");
        outcome.unwrap();
        assert_eq!(rows, Vec::<Value>::new());
        let (outcome, rows, _) = score(TOURNAMENT, "[]");
        outcome.unwrap();
        let prior = json!({"mean": 1500.0, "sd": 350.0});
        let ratings = json!({"prior": prior, "resamples": 1000, "results": [], "goals": []});
        assert_eq!(
            rows,
            [json!({"games": [], "standings": [], "head_to_head": [], "ratings": ratings})]
        );
    }
}
