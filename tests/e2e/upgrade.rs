//! Upgrades: a data folder of an earlier version, killed during its work, is opened, migrated and continued.

use faceoff_tests::{program, repository, server::Server};
use flate2::read::GzDecoder;
use serde_json::Value;
use std::{
    fs::{self, File},
    path::Path,
    process::Command,
};

/// The configuration of the server that wrote the data folder.
const CONFIG: &str = r#"
[evaluation]
episodes_per_task = 2
episodes_per_shard = 1
max_faults = 1
[workers]
slots = 1
lease_s = 5
"#;

/// The ruleset (version of the competition's rules) of the first release.
const FIRST_RULESET: &str = "airhockey-2023.1";
/// The current ruleset.
const CURRENT_RULESET: &str = "airhockey-2023.3";
/// Rows of the board with results of the first ruleset.
const FIRST_BOARD_ROWS: usize = 2;

/// The last API responses of the earlier version, with the teams' tokens.
struct RecordedAnswers(Value);

impl RecordedAnswers {
    fn read(data_dir: &Path) -> Self {
        let json = fs::read(data_dir.join("told.json"))
            .expect("the fixture has its server's last answers");
        Self(serde_json::from_slice(&json).expect("it is JSON"))
    }

    fn token(&self, team: &str) -> &str {
        self.0["tokens"][team].as_str().expect("a team has a token")
    }

    /// The response with this name, such as `day two Alpha`: the evaluation of the team Alpha on the second day.
    fn answer(&self, name: &str) -> &Value {
        let answer = &self.0["answers"][name];
        assert!(answer.is_object(), "the fixture has no answer {name}");
        answer
    }

    /// The API path of a recorded evaluation or submission.
    fn path(&self, kind: &str, name: &str) -> String {
        let id = self.answer(name)["id"].as_str().expect("it has an id");
        format!("/api/v1/{kind}/{id}")
    }
}

/// Unpacks an archive of `tests/fixtures` into a folder.
pub(crate) fn unpack(archive: &str, folder: &Path) {
    let file = File::open(repository().join("tests/fixtures").join(archive)).expect("a fixture");
    tar::Archive::new(GzDecoder::new(file))
        .unpack(folder)
        .expect("the fixture unpacks");
}

fn get(server: &Server, path: &str, token: &str) -> Value {
    let answer = server.get(path, Some(token));
    assert_eq!(answer.status(), 200, "{path}");
    answer.json().expect("the API speaks JSON")
}

/// Downloads the dataset of an evaluation and verifies it with `faceoff verify`.
pub(crate) fn verify_dataset(server: &Server, evaluation: &str, token: &str, folder: &Path) {
    let answer = server.get(&format!("{evaluation}/dataset"), Some(token));
    assert_eq!(answer.status(), 200, "the dataset of {evaluation}");
    let file = folder.join("dataset.zip");
    fs::write(&file, answer.bytes().expect("the download completes")).expect("a scratch file");
    let verified = Command::new(program("faceoff"))
        .arg("verify")
        .arg(&file)
        .output()
        .expect("the program starts");
    assert!(
        verified.status.success(),
        "{evaluation}: {}",
        String::from_utf8_lossy(&verified.stderr)
    );
}

#[test]
fn first_release_data_folder_is_upgraded_and_continued() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    unpack("data-folder-e67a08c.tar.gz", scratch.path());
    let data_dir = scratch.path().join("data");
    let recorded = RecordedAnswers::read(&data_dir);
    let server = Server::start(&data_dir, CONFIG);
    let admin = server.admin_token.clone();

    // Finished evaluations are unchanged. The results of the first day are public; the second day has running evaluations.
    for name in [
        "day one Alpha",
        "day one Beta",
        "day two Delta",
        "day two Gamma",
    ] {
        let mut found = get(&server, &recorded.path("evaluations", name), &admin);
        if let Some(seed) = found.pointer_mut("/result/seed") {
            assert!(seed.take().is_string(), "{name}");
        }
        let fields = found.as_object_mut().expect("an answer is an object");
        let released_at = fields
            .remove("released_at")
            .expect("an answer has this field");
        if name.starts_with("day one") {
            assert!(released_at.is_string(), "{name}");
        }
        // The earlier version did not have the following fields.
        let stage = get(&server, "/api/v1/stages", &admin)[0].take();
        let fields = found.as_object_mut().expect("an answer is an object");
        assert_eq!(fields.remove("stage"), Some(stage["id"].clone()), "{name}");
        assert_eq!(fields.remove("revision"), Some(1.into()), "{name}");
        assert_eq!(fields.remove("deadline_at"), Some(Value::Null), "{name}");
        assert_eq!(fields.remove("public"), Some(false.into()), "{name}");
        let next = fields.remove("next").expect("an answer has this field");
        assert!(next.is_string(), "{name}");
        assert_eq!(
            stage["names_seeds"], false,
            "the seeds of its days do not derive from its id"
        );
        assert_eq!(&found, recorded.answer(name), "{name}");
    }
    for (ablation, evaluation) in [
        ("ablation Alpha", "day one Alpha"),
        ("ablation Beta", "day one Beta"),
    ] {
        let submission = recorded.answer(evaluation)["submission"]
            .as_str()
            .expect("an id");
        let path = format!("/api/v1/submissions/{submission}/ablation");
        assert_eq!(
            &get(&server, &path, &admin),
            recorded.answer(ablation),
            "{ablation}"
        );
    }

    // Running evaluations, validation runs and ablations continue.
    let alpha = recorded.token("Alpha");
    for (name, team) in [("day two Alpha", "Alpha"), ("day two Epsilon", "Epsilon")] {
        let path = recorded.path("evaluations", name);
        let finished = server.poll(&path, recorded.token(team), |answer| {
            !["queued", "running", "finalising"].contains(&answer["state"].as_str().unwrap_or(""))
        });
        assert_eq!(finished["state"], "finished", "{name}: {finished:#}");
        assert_eq!(finished["result"]["tasks"]["hit"]["episodes"], 2, "{name}");
        assert_eq!(finished["result"]["ruleset"], FIRST_RULESET, "{name}");
    }
    let validated = server.poll(
        &recorded.path("submissions", "submission Beta"),
        recorded.token("Beta"),
        |answer| answer["state"] != "validating",
    );
    assert_eq!(validated["state"], "valid", "{validated:#}");
    let alpha_submission = recorded.answer("day two Alpha")["submission"]
        .as_str()
        .expect("an id");
    let ablation = server.poll(
        &format!("/api/v1/submissions/{alpha_submission}/ablation"),
        alpha,
        |answer| answer["state"] != "open",
    );
    assert_eq!(ablation["state"], "finished", "{ablation:#}");
    // An ablation evaluates the submission without perturbations, with each of four alone, and with all: six profiles.
    assert_eq!(ablation["tasks"]["hit"].as_array().map(Vec::len), Some(6));

    // The last evaluation released the second day, and no evaluation was repeated.
    let season = get(&server, "/api/v1/season", &admin);
    let days = season["days"].as_array().expect("a season has its days");
    assert_eq!(days.len(), 2, "{season:#}");
    for day in days {
        assert!(
            day["released_at"].is_string() && day["seed"].is_string(),
            "{day:#}"
        );
    }
    // The date of the fixture's second day.
    let second_day = get(&server, "/api/v1/evaluations?day=2026-11-19", &admin);
    assert_eq!(
        second_day.as_array().map(Vec::len),
        Some(4),
        "{second_day:#}"
    );

    // Datasets with episodes of both versions pass verification.
    for name in ["day one Alpha", "day two Alpha"] {
        verify_dataset(
            &server,
            &recorded.path("evaluations", name),
            alpha,
            scratch.path(),
        );
    }
    // The board of the first ruleset stays until a result of the next one exists; boards never mix rulesets.
    assert_board(&server, "/api/v1/board", FIRST_RULESET, FIRST_BOARD_ROWS);
    let started = server.post("/api/v1/days", &admin, &serde_json::json!({}));
    assert!(started.status().is_success(), "starting a day");
    let today = get(&server, "/api/v1/evaluations", &admin);
    let mut evaluations = today.as_array().expect("a list").iter();
    let beta = evaluations
        .find(|evaluation| evaluation["team_name"] == "Beta")
        .unwrap_or_else(|| panic!("Beta has no evaluation: {today:#}"));
    let path = format!(
        "/api/v1/evaluations/{}",
        beta["id"].as_str().expect("it has an id")
    );
    let finished = server.poll(&path, &admin, |answer| answer["state"] == "finished");
    assert_eq!(finished["result"]["ruleset"], CURRENT_RULESET);
    let board = get(&server, "/api/v1/board", &admin);
    assert_eq!(board["ruleset"], CURRENT_RULESET);
    for row in board["rows"].as_array().expect("a board has rows") {
        assert_eq!(row["ruleset"], CURRENT_RULESET, "{board:#}");
    }
    assert_board(
        &server,
        "/api/v1/board?revision=1",
        FIRST_RULESET,
        FIRST_BOARD_ROWS,
    );
}

/// Asserts that the board has this number of rows, all with results of this ruleset.
fn assert_board(server: &Server, path: &str, ruleset: &str, rows: usize) {
    let board = get(server, path, &server.admin_token);
    assert_eq!(board["ruleset"], ruleset);
    let board_rows = board["rows"].as_array().expect("a board has rows");
    assert_eq!(board_rows.len(), rows, "{board:#}");
    assert!(
        board_rows.iter().all(|row| row["ruleset"] == ruleset),
        "{board:#}"
    );
}
