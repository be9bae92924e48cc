//! `faceoff demo`, which `make demo` runs: it evaluates the submissions of three teams on one day, prints the board (the
//! ranking of teams) and downloads a dataset.

use faceoff_tests::{
    browser::{Browser, View},
    bundle, program, repository,
    server::Server,
};
use serde_json::Value;
use std::{fs::File, process::Command};

#[test]
fn demo_evaluates_a_day_and_serves_its_board() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let data_dir = scratch.path().join("data");
    let output = Command::new(program("faceoff"))
        .arg("demo")
        .args(["--episodes", "3", "--no-serve"])
        .args(["--listen", "127.0.0.1:0"])
        .arg("--data-dir")
        .arg(&data_dir)
        .arg("--bundle")
        .arg(repository().join("agents/hold"))
        .arg("--bundle")
        .arg(bundle::example_agent("striker", scratch.path()))
        .arg("--bundle")
        .arg(repository().join("agents/reckless"))
        .env(
            "FACEOFF_CONFIG",
            repository().join("tests/long_time_limits.toml"),
        )
        .output()
        .expect("the program can be started");
    let stdout = String::from_utf8_lossy(&output.stdout);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success(),
        "the demo failed\n{stdout}\n{stderr}"
    );

    let position = |text: &str| {
        stdout
            .find(text)
            .unwrap_or_else(|| panic!("{text:?} is not in the output:\n{stdout}"))
    };

    // The dataset is a complete archive, and verified.
    assert!(position("dataset of hold") < position("   verified "));
    let dataset = std::fs::read_dir(&data_dir)
        .expect("the demo made its folder")
        .filter_map(Result::ok)
        .map(|entry| entry.path())
        .find(|path| path.extension().is_some_and(|end| end == "zip"))
        .expect("the demo downloads a dataset");
    let mut archive =
        zip::ZipArchive::new(File::open(&dataset).expect("it can be read")).expect("it is a zip");
    let results: Value = serde_json::from_reader(
        archive
            .by_name("results.json")
            .expect("a dataset has its score"),
    )
    .expect("it is JSON");
    assert_eq!(results["ruleset"], "airhockey-2023.3");
    assert_eq!(results["profile"], "evaluation");
    for task in ["hit", "defend", "prepare"] {
        assert_eq!(results["tasks"][task]["episodes"], 3, "{task}");
    }

    // A server on the demo's data folder shows the same board as the demo has printed, in a browser and as plain HTML.
    let server = Server::start(&data_dir, "");
    let board: Value = server
        .get("/api/v1/board", None)
        .json()
        .expect("the API speaks JSON");
    let rows = board["rows"].as_array().expect("a board has rows");
    assert_eq!(rows.len(), 3);
    let mut printed_lines = Vec::new();
    for row in rows {
        let [heading, team] = tier_heading_and_team(row);
        if !printed_lines.contains(&heading) {
            printed_lines.push(heading);
        }
        printed_lines.push(team);
    }
    assert_in_order(&stdout, &printed_lines);
    let teams: Vec<&str> = rows.iter().filter_map(|row| row["team"].as_str()).collect();
    // The rows of the page's first table.
    let table = |page: &str| {
        page.split_once("<tbody")
            .map_or_else(String::new, |(_, table)| table.to_owned())
    };
    let browser = Browser::start(scratch.path());
    let url = format!("{}/", server.url);
    for view in [View::DESKTOP, View::PHONE.dark().without_scripts()] {
        let page = browser.open_in(view, &url);
        assert_in_order(&table(&page.html()), &teams);
        assert_eq!(page.console_errors(), [""; 0]);
    }
    assert_in_order(
        &table(&server.get("/", None).text().expect("a page is text")),
        &teams,
    );
}

/// The printed heading of a row's tier, and the row's team. The tier says how safe an agent is for a real robot. Asserts that
/// it fits the violations. On a busy machine any agent may get penalty points for computation time, which can lower its tier.
fn tier_heading_and_team(row: &Value) -> [&str; 2] {
    let text = |field: &str| row[field].as_str().expect("a row has its texts");
    let (team, tier) = (text("team"), text("tier"));
    let episodes_with = |violations: &[&str]| -> u64 {
        let tasks = row["tasks"].as_object().expect("a row has its tasks");
        let counts = tasks.values().flat_map(|task| {
            let count = |kind: &&str| task["violations"][*kind].as_u64();
            violations.iter().map(count)
        });
        counts
            .map(|count| count.expect("violations are counted"))
            .sum()
    };
    match team {
        "hold" => {
            // The end effector, a link, or a joint's position or velocity was outside of its limits.
            let harmful = episodes_with(&["ee", "link", "joint_pos", "joint_vel"]);
            assert_eq!(harmful, 0, "{row:#}");
            let slow = episodes_with(&["computation_time"]) > 0;
            assert!(slow || tier == "deployable", "{row:#}");
        }
        "reckless" => assert_eq!(tier, "non_deployable", "{row:#}"),
        _ => assert_eq!(team, "striker"),
    }
    let heading = match tier {
        "deployable" => "── Deployable ",
        "improvable" => "── Improvable ",
        "non_deployable" => "── Non-deployable ",
        other => panic!("{other:?} is no tier"),
    };
    [heading, team]
}

/// Asserts that `text` has each of `parts`, in this order.
fn assert_in_order(text: &str, parts: &[&str]) {
    let mut rest = text;
    for part in parts {
        rest = rest
            .split_once(part)
            .unwrap_or_else(|| panic!("{part:?} is missing or out of order:\n{text}"))
            .1;
    }
}
