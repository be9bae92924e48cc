//! `faceoff replay` of a recorded game: its page, pictures, summary and refusals.

use crate::program::{LONG_TIME_LIMITS, SEED, agent, command, faceoff, hold, text};
use serde_json::Value;
use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
    sync::OnceLock,
};
use tempfile::TempDir;

/// Folder of a series of two games of 20 s, in which no puck is ever hit: the puck stays on one side, which is a foul. `reckless`
/// violates all constraints.
fn series() -> &'static Path {
    static DIR: OnceLock<TempDir> = OnceLock::new();
    let dir = DIR.get_or_init(|| {
        let dir = tempfile::tempdir().unwrap();
        let output = command(&["play", "--games", "2", "--steps", "1000", "--seed", SEED])
            .args([hold(), agent("reckless")])
            .arg("--out")
            .arg(dir.path())
            .args(["--config", LONG_TIME_LIMITS])
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", text(&output.stderr));
        dir
    });
    dir.path()
}

pub fn first_game() -> PathBuf {
    series().join("game-1")
}

fn replay(recording: &Path, out: &Path, options: &[&str]) -> Output {
    let (recording, out) = (recording.to_str().unwrap(), out.to_str().unwrap());
    faceoff(&[&["replay", recording, "--out", out], options].concat())
}

/// Draws a recording to a new file with this name; returns the output and the content of the file.
fn draw_to_new_file(recording: &Path, name: &str, options: &[&str]) -> (String, String) {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join(name);
    let output = replay(recording, &out, options);
    assert!(output.status.success(), "{}", text(&output.stderr));
    (text(&output.stdout), fs::read_to_string(out).unwrap())
}

fn refusal(recording: &Path, options: &[&str]) -> String {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("refused.html");
    let output = replay(recording, &out, options);
    assert!(!output.status.success(), "{}", text(&output.stdout));
    assert!(!out.exists());
    text(&output.stderr)
}

fn summary(recording: &Path) -> Value {
    let (json, _) = draw_to_new_file(recording, "game.html", &["--json"]);
    serde_json::from_str(&json).unwrap()
}

#[test]
fn game_page_is_self_contained_and_links_its_events() {
    let (stdout, page) = draw_to_new_file(&first_game(), "game.html", &[]);
    let lines: Vec<&str> = stdout.lines().collect();
    assert_eq!(lines[0], "hold 0 : 0 reckless");
    let foul = lines.iter().find(|line| line.contains("foul 1 by "));
    let (clock, foul) = foul.unwrap().trim().split_once("  ").unwrap();
    assert!(
        foul.contains("the puck stayed on its side for more than 15 s"),
        "{foul}"
    );
    let line = page
        .lines()
        .find(|line| line.contains(foul) && line.starts_with("<li"));
    let line = line.unwrap_or_else(|| panic!("{foul}\n{page:.4000}"));
    assert!(line.contains(&format!(">{clock}</a>")), "{line}");
    // The foul is 15.02 s after the start, and its link jumps to two seconds before that.
    assert!(line.contains("href=\"#t=13."), "{line}");
    assert!(page.contains("3 points for reckless: end effector limit violated in "));
    let rest = page.replace("http://www.w3.org/2000/svg", "");
    for reference in ["http:", "https:", "src=", "@import", "url("] {
        assert!(!rest.contains(reference), "{reference}");
    }
}

#[test]
fn penalties_of_a_game_add_up_to_its_points() {
    let summary = summary(&first_game());
    for (side, score) in (1..).zip(summary["sides"].as_array().unwrap()) {
        let penalties = summary["penalties"].as_array().unwrap().iter();
        let points: f64 = penalties
            .filter(|penalty| penalty["side"] == side)
            .map(|penalty| penalty["points"].as_f64().unwrap())
            .sum();
        assert_eq!(
            points,
            score["penalty_points"].as_f64().unwrap(),
            "{summary}"
        );
    }
    assert!(summary["sides"][1]["penalty_points"].as_f64().unwrap() > 0.0);
}

#[test]
fn positions_on_the_page_are_near_the_table() {
    let (_, page) = draw_to_new_file(&first_game(), "game.html", &[]);
    let (_, rest) = page.split_once("id=\"motion\">").unwrap();
    let (json, _) = rest.split_once("</script>").unwrap();
    let motion: Value = serde_json::from_str(json).unwrap();
    let columns = motion["positions"].as_array().unwrap();
    assert_eq!(columns.len(), 6);
    for column in columns {
        let samples = column.as_array().unwrap().len();
        assert_eq!(samples, 1001, "the start and 1000 control steps");
    }
    // Puck and first mallet stay on the table or in a goal; the second robot throws its arm about.
    for column in &columns[..4] {
        let mut sum = 0;
        for difference in column.as_array().unwrap() {
            sum += difference.as_i64().unwrap();
            assert!(sum.abs() < 1100, "{sum} mm is near the table");
        }
    }
    // The first side's arm is still, so its mallet stays in its half: x < 0.
    assert!(columns[2][0].as_i64().unwrap() < 0, "{}", columns[2][0]);
    assert!(columns[4][0].as_i64().unwrap() > 0, "{}", columns[4][0]);
}

#[test]
fn archive_of_a_side_hides_the_other_sides_penalties() {
    let summary = summary(&first_game().join("side-1.zip"));
    // On a busy machine the side itself may have points for time.
    for penalty in summary["penalties"].as_array().unwrap() {
        assert_eq!(penalty["side"], 1, "{penalty}");
    }
    assert_eq!(summary["seed"], Value::Null);
    let (_, page) = draw_to_new_file(&first_game().join("side-1.zip"), "side.html", &[]);
    assert!(page.contains("From the archive of side 1: "));
    assert!(page.contains("foul 1 by "));
}

#[test]
fn picture_of_a_rally_is_well_formed() {
    let (_, picture) = draw_to_new_file(&first_game(), "rally.svg", &["--rally", "0"]);
    assert!(
        picture.contains("rally 0, 0:00.0 to 0:15.0: foul by "),
        "{picture:.600}"
    );
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("rally.svg");
    fs::write(&file, picture).unwrap();
    let output = Command::new("python3")
        .args([
            "-c",
            "import sys, xml.dom.minidom as x; x.parse(sys.argv[1])",
        ])
        .arg(&file)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
}

#[test]
fn game_of_a_series_is_named_by_its_number() {
    let (stdout, _) = draw_to_new_file(series(), "second.html", &["--game", "2"]);
    assert!(stdout.starts_with("reckless 0 : 0 hold\n"), "{stdout}");
    let message = refusal(series(), &[]);
    assert!(
        message.contains("is the folder of a series: name a game; it has 2 games, --game 1 (game-1) to --game 2 (game-2)"),
        "{message}"
    );
    let message = refusal(series(), &["--game", "3"]);
    assert!(
        message.contains("has no game 3: it has 2 games"),
        "{message}"
    );
    let message = refusal(&first_game(), &["--game", "1"]);
    assert!(
        message.contains("is a single game: leave out --game"),
        "{message}"
    );
}

#[test]
fn invalid_replay_of_a_game_is_refused_with_a_reason() {
    let dir = tempfile::tempdir().unwrap();
    let message = refusal(&first_game(), &["--task", "hit", "--episode", "0"]);
    assert!(
        message.contains("leave out --task and --episode"),
        "{message}"
    );
    let message = refusal(&first_game(), &["--rally", "7"]);
    assert!(
        message.contains("there is no rally 7: the game has 2, from 0"),
        "{message}"
    );

    let bytes = fs::read(first_game().join("game.zip")).unwrap();
    let truncated = dir.path().join("game.zip");
    fs::write(&truncated, &bytes[..bytes.len() / 2]).unwrap();
    let message = refusal(&truncated, &[]);
    assert!(
        message.contains("is neither a game nor a dataset that can be read: expected game.zip"),
        "{message}"
    );
    let message = refusal(&dir.path().join("none.zip"), &[]);
    assert!(message.contains("none.zip: expected game.zip"), "{message}");

    let mut altered = bytes;
    let position = altered.len() / 2;
    altered[position] ^= 1;
    fs::write(&truncated, altered).unwrap();
    let message = refusal(&truncated, &[]);
    assert!(message.contains("damaged or altered"), "{message}");
}
