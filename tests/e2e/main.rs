//! End to end: what an organiser, a team and a visitor get from the real program.

mod accessible;
mod axe;
mod backup;
mod bad_agents;
mod busy_host;
mod command_line;
mod commands;
mod crash;
mod cut;
mod demo;
mod desks;
mod elsewhere;
mod fair_shares;
mod full_disk;
mod growth;
mod house;
mod images;
mod installed;
mod kills;
mod large_uploads;
mod like_server;
mod live;
mod luck;
mod packages;
mod people;
mod pictures;
mod privacy;
mod real_time;
mod replay;
mod retention;
mod runtimes;
mod soak;
mod strangers;
mod told_text;
mod tournament;
mod undisturbed;
mod upgrade;
mod uploads;
mod void_at_will;
mod watching;

use bytes::Bytes;
use faceoff_tests::{bundle, program, repository, server::Server};
use serde_json::{Value, json};
use std::{fs, io::Cursor, path::Path, process::Command};
use zip::ZipArchive;

/// A configuration for tests: few episodes, small shards, one slot, time for every answer. No server of a
/// test copies this host's libraries into memory, but the one that is asked what agents find there.
const CONFIG: &str = concat!(
    include_str!("../patient.toml"),
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

/// A team of a test.
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

    /// Uploads a folder and waits for its verdict.
    fn submit(&self, server: &Server, folder: &Path) -> Value {
        let id = self.upload(server, bundle::packed(folder));
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

    fn verdict_so_far(&self, server: &Server, submission: &str) -> Value {
        let path = format!("/api/v1/submissions/{submission}");
        server.poll(&path, &self.token, |_| true)
    }

    fn verdict(&self, server: &Server, submission: &str) -> Value {
        server.poll(
            &format!("/api/v1/submissions/{submission}"),
            &self.token,
            |answer| answer["state"] != "validating",
        )
    }

    /// Starts the day, on which this is active, and returns the evaluation's path.
    fn evaluate(&self, server: &Server, submission: &Value) -> String {
        let day = start_day(server);
        path_of(&day, submission)
    }

    fn finished(&self, server: &Server, evaluation: &str) -> Value {
        server.poll(evaluation, &self.token, |answer| {
            !["queued", "running", "finalising"]
                .contains(&answer["state"].as_str().unwrap_or_default())
        })
    }
}

/// The organiser starts the day.
fn start_day(server: &Server) -> Value {
    let answer = server.post("/api/v1/days", &server.admin_token, &json!({}));
    assert_eq!(answer.status(), 200, "starting the day");
    answer.json().expect("the API speaks JSON")
}

/// The path of the evaluation in which a submission plays a day.
fn path_of(day: &Value, submission: &Value) -> String {
    let created = day["created"].as_array().expect("a day has evaluations");
    let of_submission = created
        .iter()
        .find(|evaluation| evaluation["submission"] == submission["id"]);
    let id = &of_submission.expect("it was active at the cut")["id"];
    format!(
        "/api/v1/evaluations/{}",
        id.as_str().expect("an evaluation has an id")
    )
}

/// A finished evaluation's dataset.
fn dataset(server: &Server, evaluation: &str, token: &str) -> ZipArchive<Cursor<Bytes>> {
    let answer = server.get(&format!("{evaluation}/dataset"), Some(token));
    assert_eq!(answer.status(), 200, "the dataset of {evaluation}");
    let bytes = answer.bytes().expect("the download completes");
    ZipArchive::new(Cursor::new(bytes)).expect("a dataset is a zip")
}

/// A file of a dataset.
fn entry(dataset: &mut ZipArchive<Cursor<Bytes>>, name: &str) -> Value {
    let file = dataset.by_name(name).expect("every dataset has it");
    serde_json::from_reader(file).expect("it is JSON")
}

/// What the local evaluator makes of a bundle, with the seeds that a dataset's manifest publishes, so many
/// episodes per task and another number of workers.
fn scored_locally(bundle: &Path, manifest: &Value, episodes: u32, out: &Path) -> Value {
    let seed = |name: &str| manifest[name].as_str().expect("the manifest names it");
    let local = Command::new(program("faceoff"))
        .arg("eval")
        .arg(bundle)
        .args(["--task", "hit,defend,prepare"])
        .args(["--episodes", &episodes.to_string()])
        .args(["--profile", "evaluation", "--seed", seed("seed")])
        .args(["--mismatch-seed", seed("mismatch_seed"), "--workers", "2"])
        .arg("--config")
        .arg(repository().join("tests/patient.toml"))
        .arg("--out")
        .arg(out)
        .output()
        .expect("the program can be started");
    assert!(
        local.status.success(),
        "{}",
        String::from_utf8_lossy(&local.stderr)
    );
    let result = fs::read(out.join("results.json")).expect("the evaluator writes its result");
    serde_json::from_slice(&result).expect("it is JSON")
}

/// A result without what no run can repeat: computation times and the points that follow from them.
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
