//! Power cuts, and the same score from anyone's machine.

use crate::{CONFIG, Team, without_times};
use faceoff_tests::{bundle, program, repository, server::Server};
use serde_json::Value;
use std::{fs, io::Cursor, process::Command};

#[test]
fn an_evaluation_survives_kill_9_and_scores_as_the_local_evaluator_does() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let data_dir = scratch.path().join("data");
    let striker = bundle::reference("striker", scratch.path());

    let mut server = Server::start(&data_dir, CONFIG);
    let team = Team::create(&server, "Phoenix");
    let submission = team.submit(&server, &striker);
    assert_eq!(submission["state"], "valid", "{submission:#}");
    let evaluation = team.evaluate(&server, &submission);

    // Killed whenever the next part of the evaluation has been played.
    for episodes in [1, 4, 8] {
        let _ = server.poll(&evaluation, &team.token, |answer| {
            answer["progress"]["episodes_done"].as_u64() >= Some(episodes)
        });
        server.kill();
        server = Server::start(&data_dir, CONFIG);
    }
    let survived = team.finished(&server, &evaluation);
    assert_eq!(survived["state"], "finished", "{survived:#}");

    let dataset = server.get(&format!("{evaluation}/dataset"), Some(&team.token));
    assert_eq!(dataset.status(), 200);
    let bytes = dataset.bytes().expect("the download completes");
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).expect("a dataset is a zip");
    let manifest: Value = serde_json::from_reader(
        archive
            .by_name("manifest.json")
            .expect("a dataset has a manifest"),
    )
    .expect("it is JSON");

    // The dataset released the day's seed: from now on the result tells it too.
    let survived = team.finished(&server, &evaluation);
    assert_eq!(survived["result"]["seed"], manifest["seed"]);

    // The local evaluator, with the published seeds and another number of workers.
    let out = scratch.path().join("local");
    let local = Command::new(program("faceoff"))
        .arg("eval")
        .arg(&striker)
        .args([
            "--task",
            "hit,defend,prepare",
            "--episodes",
            "4",
            "--profile",
            "evaluation",
        ])
        .args([
            "--seed",
            manifest["seed"]
                .as_str()
                .expect("the manifest names the seed"),
        ])
        .args([
            "--mismatch-seed",
            manifest["mismatch_seed"]
                .as_str()
                .expect("the manifest names the season's draw"),
        ])
        .args(["--workers", "2"])
        .arg("--config")
        .arg(repository().join("tests/patient.toml"))
        .arg("--out")
        .arg(&out)
        .output()
        .expect("the program can be started");
    assert!(
        local.status.success(),
        "{}",
        String::from_utf8_lossy(&local.stderr)
    );
    let local: Value = serde_json::from_slice(
        &fs::read(out.join("results.json")).expect("the evaluator writes its result"),
    )
    .expect("it is JSON");
    assert_eq!(without_times(&survived["result"]), without_times(&local));
}
