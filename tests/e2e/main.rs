//! End to end: what an organiser, a team and a visitor get from the real program.

mod bad_agents;
mod browser;
mod busy_host;
mod crash;
mod cut;
mod demo;
mod fair_shares;
mod house;
mod kills;
mod luck;
mod privacy;
mod real_time;
mod told_text;
mod upgrade;
mod void_at_will;

use faceoff_tests::{bundle, server::Server};
use serde_json::{Value, json};
use std::path::Path;

/// A configuration for tests: few episodes, small shards, one slot, time for every answer.
const CONFIG: &str = concat!(
    include_str!("../patient.toml"),
    r#"
[evaluation]
episodes_per_task = 4
episodes_per_shard = 2
[workers]
slots = 1
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
