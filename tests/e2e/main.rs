//! End-to-end tests: what an organiser, a team and a visitor get from the real program. This file has the steps that many
//! of them share, such as a team's upload and the start of an evaluation day (the evaluations of all teams at one cutoff).

mod accessibility;
mod agent_faults;
mod agent_text;
mod architecture;
mod axe;
mod backup;
mod busy_host;
mod cheating_agents;
mod clock;
mod command_line;
mod commands;
mod compared_replays;
mod connection_limits;
mod container_images;
mod crash_recovery;
mod cutoff;
mod dashboards;
mod demo;
mod documentation;
mod episode_list;
mod frame_costs;
mod front_page;
mod full_disk;
mod game_replay;
mod installation;
mod invalid_actions;
mod kills;
mod large_uploads;
mod live_pages;
mod local_evaluation;
mod log_growth;
mod marked_secrets;
mod ordinary_user;
mod pictures;
mod python_packages;
mod reference_result;
mod refused_uploads;
mod remote_workers;
mod replay;
mod replay_controls;
mod replay_loading;
mod retention;
mod runtimes;
mod shared_folder;
mod slot_shares;
mod soak;
mod time_budgets;
mod tournament;
mod tournament_page;
mod upgrade;
mod uploads;
mod users;
mod visibility;

use bytes::Bytes;
use faceoff_tests::{bundle, program, repository, server::Server};
use serde_json::{Value, json};
use std::{fs, io::Cursor, path::Path, process::Command};
use zip::ZipArchive;

/// A configuration for tests: few episodes, small shards (jobs of some episodes), one slot (place for a running job), and
/// generous time limits. With `resident_bytes = 0` the server does not copy this host's libraries into memory; the test of
/// covert channels overrides that.
const CONFIG: &str = concat!(
    include_str!("../long_time_limits.toml"),
    r#"
[evaluation]
episodes_per_task = 4
episodes_per_shard = 2
[workers]
slots = 1
[sandbox]
resident_bytes = 0
"#
);

/// A team, known by its API token.
struct Team {
    token: String,
}

impl Team {
    fn create(server: &Server, name: &str) -> Self {
        let answer = server.post(
            "/api/v1/teams",
            &server.admin_token,
            &json!({ "name": name }),
        );
        assert_eq!(answer.status(), 201, "creating team {name}");
        let answer: Value = answer.json().expect("the API speaks JSON");
        Self {
            token: answer["token"]
                .as_str()
                .expect("a new team gets a token")
                .to_owned(),
        }
    }

    /// Uploads a folder as a bundle and waits for the verdict of its validation run.
    fn submit(&self, server: &Server, folder: &Path) -> Value {
        let id = self.upload(server, bundle::pack(folder));
        self.verdict(server, &id)
    }

    fn upload(&self, server: &Server, archive: Vec<u8>) -> String {
        let answer = server.upload(&self.token, archive);
        assert_eq!(answer.status(), 201, "uploading");
        let answer: Value = answer.json().expect("the API speaks JSON");
        answer["id"]
            .as_str()
            .expect("a submission has an id")
            .to_owned()
    }

    /// The submission's present state, validated or not.
    fn submission(&self, server: &Server, id: &str) -> Value {
        let path = format!("/api/v1/submissions/{id}");
        server.poll(&path, &self.token, |_| true)
    }

    /// The submission after its validation run, which decides whether it is valid.
    fn verdict(&self, server: &Server, id: &str) -> Value {
        server.poll(
            &format!("/api/v1/submissions/{id}"),
            &self.token,
            |answer| answer["state"] != "validating",
        )
    }

    /// Starts the evaluation day. Returns the API path of the evaluation of the team's active submission.
    fn evaluate(&self, server: &Server, submission: &Value) -> String {
        let day = start_day(server);
        evaluation_path(&day, submission)
    }

    fn wait_until_finished(&self, server: &Server, evaluation: &str) -> Value {
        server.poll(evaluation, &self.token, |answer| {
            !["queued", "running", "finalising"]
                .contains(&answer["state"].as_str().unwrap_or_default())
        })
    }
}

/// Starts the evaluation day as the organiser.
fn start_day(server: &Server) -> Value {
    let answer = server.post("/api/v1/days", &server.admin_token, &json!({}));
    assert_eq!(answer.status(), 200, "starting the day");
    answer.json().expect("the API speaks JSON")
}

/// The API path of a submission's evaluation on a day.
fn evaluation_path(day: &Value, submission: &Value) -> String {
    let evaluations = day["created"].as_array().expect("a day has evaluations");
    let evaluation = evaluations
        .iter()
        .find(|evaluation| evaluation["submission"] == submission["id"]);
    let id = &evaluation.expect("the submission was active at the cutoff")["id"];
    format!(
        "/api/v1/evaluations/{}",
        id.as_str().expect("an evaluation has an id")
    )
}

/// Evaluates the agent of a team on a new server. Returns the API path of the finished evaluation.
fn evaluate_bundle(server: &Server, bundle: &Path) -> String {
    let team = Team::create(server, "Alpha");
    let submission = team.submit(server, bundle);
    let path = team.evaluate(server, &submission);
    let finished = team.wait_until_finished(server, &path);
    assert_eq!(finished["state"], "finished", "{finished}");
    path
}

/// Downloads the dataset of a finished evaluation.
fn dataset(server: &Server, evaluation: &str, token: &str) -> ZipArchive<Cursor<Bytes>> {
    let answer = server.get(&format!("{evaluation}/dataset"), Some(token));
    assert_eq!(answer.status(), 200, "the dataset of {evaluation}");
    let bytes = answer.bytes().expect("the download completes");
    ZipArchive::new(Cursor::new(bytes)).expect("a dataset is a zip")
}

/// A JSON file of a dataset.
fn entry(dataset: &mut ZipArchive<Cursor<Bytes>>, name: &str) -> Value {
    let file = dataset.by_name(name).expect("every dataset has this file");
    serde_json::from_reader(file).expect("it is JSON")
}

/// The result of the local evaluator (`faceoff eval`) for a bundle, with `episodes` per task and the seeds in a dataset's
/// manifest: `seed` for the episodes, `mismatch_seed` for how the robot deviates from its published model. Two workers, since
/// the number of workers must not affect the result.
fn score_locally(bundle: &Path, manifest: &Value, episodes: u32, out_dir: &Path) -> Value {
    let seed = |name: &str| {
        manifest[name]
            .as_str()
            .expect("the manifest contains the seeds")
    };
    let local = Command::new(program("faceoff"))
        .arg("eval")
        .arg(bundle)
        .args(["--task", "hit,defend,prepare"])
        .args(["--episodes", &episodes.to_string()])
        .args(["--profile", "evaluation", "--seed", seed("seed")])
        .args(["--mismatch-seed", seed("mismatch_seed"), "--workers", "2"])
        .arg("--config")
        .arg(repository().join("tests/long_time_limits.toml"))
        .arg("--out")
        .arg(out_dir)
        .output()
        .expect("the program can be started");
    assert!(
        local.status.success(),
        "{}",
        String::from_utf8_lossy(&local.stderr)
    );
    let result = fs::read(out_dir.join("results.json")).expect("the evaluator writes its result");
    serde_json::from_slice(&result).expect("it is JSON")
}

/// A result without its non-reproducible parts: computation times, and the penalty points and tiers that depend
/// on them.
fn without_times(result: &Value) -> Value {
    fn remove(object: &mut Value, fields: &[&str]) {
        let object = object
            .as_object_mut()
            .expect("a part of a result is an object");
        for field in fields {
            object.remove(*field).expect("a result has all its fields");
        }
    }
    let mut result = result.clone();
    remove(&mut result, &["penalty_points", "tier", "timing"]);
    for task in result["tasks"]
        .as_object_mut()
        .expect("a result has tasks")
        .values_mut()
    {
        remove(task, &["penalty_points", "tier", "computation_time_s"]);
        remove(&mut task["violations"], &["computation_time"]);
    }
    result
}
