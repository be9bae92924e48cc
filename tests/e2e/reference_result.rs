//! The reference result for an evaluation that other teams or clients try to disturb: the local evaluator `faceoff eval` repeats
//! the evaluation with the same seeds.

use crate::{Team, without_times};
use faceoff_tests::{program, repository, server::Server};
use serde_json::Value;
use std::{fs, io::Cursor, path::Path, process::Command};

/// A short evaluation of one task.
pub const CONFIG: &str = concat!(
    include_str!("../long_time_limits.toml"),
    r#"
[evaluation]
tasks = ["hit"]
episodes_per_task = 6
episodes_per_shard = 2
[workers]
slots = 1
"#
);

/// Asserts that the evaluation of `bundle`, with [`CONFIG`], finishes at the first attempt and with the result of a local
/// evaluation. Files are written to the folder `scratch`.
pub fn assert_undisturbed(
    server: &Server,
    team: &Team,
    evaluation: &str,
    bundle: &Path,
    scratch: &Path,
) {
    let finished = team.wait_until_finished(server, evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    assert!(finished["rerun_of"].is_null(), "{finished:#}");
    let answer = server.get(&format!("{evaluation}/dataset"), Some(&team.token));
    assert_eq!(answer.status(), 200);
    let bytes = answer.bytes().expect("the download completes");
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).expect("a dataset is a zip");
    let manifest = archive.by_name("manifest.json");
    let manifest: Value = serde_json::from_reader(manifest.expect("a dataset has a manifest"))
        .expect("a manifest is JSON");
    let seed = |name: &str| {
        manifest[name]
            .as_str()
            .expect("the manifest names its seeds")
    };
    let out = scratch.join("undisturbed");
    let local = Command::new(program("faceoff"))
        .arg("eval")
        .arg(bundle)
        .args([
            "--task",
            "hit",
            "--episodes",
            "6",
            "--profile",
            "evaluation",
        ])
        .args(["--seed", seed("seed")])
        // Seed of the model mismatch: how the simulated robot deviates from the model that agents know.
        .args(["--mismatch-seed", seed("mismatch_seed")])
        .args(["--workers", "1"])
        .arg("--config")
        .arg(repository().join("tests/long_time_limits.toml"))
        .arg("--out")
        .arg(&out)
        .output()
        .expect("the program can be started");
    let errors = String::from_utf8_lossy(&local.stderr);
    assert!(local.status.success(), "{errors}");
    let local = fs::read(out.join("results.json")).expect("the evaluator writes its result");
    let local: Value = serde_json::from_slice(&local).expect("a result is JSON");
    // A dataset can be downloaded only once its day is released, so now the whole result is visible.
    let finished = team.wait_until_finished(server, evaluation);
    let retries = &finished["result"]["timing"]["platform_retries"];
    assert!(retries.is_null() || *retries == 0, "{finished:#}");
    assert_eq!(without_times(&finished["result"]), without_times(&local));
}
