//! `make demo` without make: the command it runs.

use crate::browser;
use faceoff_tests::{bundle, program, repository, server::Server};
use serde_json::Value;
use std::{fs::File, net::TcpListener, process::Command};

#[test]
fn the_demo_plays_a_day_and_its_board_is_served() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let data_dir = scratch.path().join("data");
    let port = TcpListener::bind("127.0.0.1:0")
        .and_then(|listener| listener.local_addr())
        .expect("a port is free")
        .port();
    let output = Command::new(program("faceoff"))
        .arg("demo")
        .args(["--episodes", "3", "--no-serve"])
        .args(["--listen", &format!("127.0.0.1:{port}")])
        .arg("--data-dir")
        .arg(&data_dir)
        .arg("--bundle")
        .arg(repository().join("agents/hold"))
        .arg("--bundle")
        .arg(bundle::reference("striker", scratch.path()))
        .arg("--bundle")
        .arg(repository().join("agents/reckless"))
        .output()
        .expect("the program can be started");
    let stdout = String::from_utf8_lossy(&output.stdout);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success(),
        "the demo failed\n{stdout}\n{stderr}"
    );

    // Tiers in order, with the teams where they belong.
    let place = |text: &str| {
        stdout
            .find(text)
            .unwrap_or_else(|| panic!("{text:?} is not in the output:\n{stdout}"))
    };
    assert!(place("Deployable") < place("Non-deployable"));
    assert!(place("hold") < place("Non-deployable"));
    assert!(stdout.rfind("reckless").expect("the team is on the board") > place("Non-deployable"));

    // The dataset is a complete archive, and verified.
    assert!(place("dataset of hold") < place("   verified "));
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
    assert_eq!(results["ruleset"], "airhockey-2023.1");
    assert_eq!(results["profile"], "evaluation");
    for task in ["hit", "defend", "prepare"] {
        assert_eq!(results["tasks"][task]["episodes"], 3, "{task}");
    }

    // The same board from the same folder, in a browser.
    let server = Server::start(&data_dir, "");
    let board: Value = server
        .get("/api/v1/board", None)
        .json()
        .expect("the API speaks JSON");
    let rows = board["rows"].as_array().expect("a board has rows");
    assert_eq!(rows.len(), 3);
    let teams: Vec<&str> = rows.iter().filter_map(|row| row["team"].as_str()).collect();
    assert_in_order(
        &browser::dump(&format!("{}/", server.url), scratch.path()),
        &teams,
    );
    // What a visitor without JavaScript gets.
    assert_in_order(
        &server.get("/", None).text().expect("a page is text"),
        &teams,
    );
}

/// Asserts that a page's table of teams names `teams` in this order.
fn assert_in_order(page: &str, teams: &[&str]) {
    let mut rest = page.split_once("<tbody").map_or("", |(_, table)| table);
    for team in teams {
        rest = rest
            .split_once(team)
            .unwrap_or_else(|| panic!("{team} is not in its place in the table:\n{page}"))
            .1;
    }
}
