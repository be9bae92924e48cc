//! Teams that try to gain an advantage on an evaluation day: by several evaluations, by uploads based on what an earlier agent
//! saw, by locking other teams out. A day has one cutoff, the moment when each team's active submission is fixed. The day is
//! released (its results become public) when all its evaluations have ended.

use crate::{CONFIG, Team, evaluation_path, start_day};
use faceoff_tests::{
    bundle::{pack, python_agent, python_bundle},
    repository,
    server::Server,
};
use reqwest::{Method, blocking::Response};
use serde_json::{Value, json};
use std::{
    fs,
    io::Cursor,
    path::{Path, PathBuf},
};

/// A configuration with one task, and with one shard (job of consecutive episodes) that is longer than a validation run.
fn one_task() -> String {
    CONFIG.replace(
        "episodes_per_task = 4\nepisodes_per_shard = 2",
        "tasks = [\"hit\"]\nepisodes_per_task = 18\nepisodes_per_shard = 18\nmax_faults = 0",
    )
}

/// An agent that holds still. Only its name and a comment distinguish it from others.
fn holding_agent(folder: &Path, name: &str) -> PathBuf {
    let source = format!("# {name}\n{}", python_agent("say(hold)"));
    python_bundle(folder, name, &source)
}

fn json_of(answer: Response) -> Value {
    answer.json().expect("the API speaks JSON")
}

fn get(server: &Server, path: &str, token: &str) -> Value {
    let answer = server.get(path, Some(token));
    assert_eq!(answer.status(), 200, "{path}");
    json_of(answer)
}

/// Asserts a problem response with this status and kind, and returns it.
fn assert_refused(answer: Response, status: u16, kind: &str) -> Value {
    assert_eq!(answer.status(), status);
    let problem = json_of(answer);
    assert_eq!(problem["type"], format!("/problems#{kind}"), "{problem:#}");
    problem
}

/// Tries to start the day once more. It is refused, unless midnight has passed since the first start.
fn assert_second_start_is_refused(server: &Server, day: &Value) {
    let answer = server.post("/api/v1/days", &server.admin_token, &json!({}));
    if get(server, "/api/v1/season", &server.admin_token)["today"] == day["day"] {
        let problem = assert_refused(answer, 409, "cutoff-passed");
        assert!(problem["next_cutoff"]["day"].is_string(), "{problem:#}");
    }
}

/// The ids of the day's evaluations, each with the id of its submission.
fn evaluations_of(server: &Server, day: &Value) -> Vec<(Value, Value)> {
    let day = day["day"].as_str().expect("a day has a date");
    let path = format!("/api/v1/evaluations?day={day}");
    let list = get(server, &path, &server.admin_token);
    list.as_array()
        .expect("a list")
        .iter()
        .map(|evaluation| (evaluation["id"].clone(), evaluation["submission"].clone()))
        .collect()
}

/// The manifest in the dataset of an evaluation.
fn manifest(server: &Server, evaluation: &str, token: &str) -> Value {
    let answer = server.get(&format!("{evaluation}/dataset"), Some(token));
    assert_eq!(answer.status(), 200, "the dataset of {evaluation}");
    let bytes = answer.bytes().expect("the download completes");
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).expect("a dataset is a zip");
    let file = archive.by_name("manifest.json");
    serde_json::from_reader(file.expect("a dataset has a manifest")).expect("it is JSON")
}

/// Chooses the submission for the team's next evaluation.
fn activate(server: &Server, team: &Team, submission: &Value) -> Response {
    let id = submission["id"].as_str().expect("a submission has an id");
    let path = format!("/api/v1/submissions/{id}/activate");
    server.post(&path, &team.token, &json!({}))
}

#[test]
fn variants_after_release_get_no_evaluation_of_the_day() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let (greedy, stopped) = (
        Team::create(&server, "Greedy"),
        // Its evaluation is cancelled.
        Team::create(&server, "Stopped"),
    );
    let first = greedy.submit(&server, &holding_agent(scratch.path(), "first"));
    let at_cutoff = stopped.submit(&server, &holding_agent(scratch.path(), "at-cutoff"));
    let day = start_day(&server);
    let [finished, cancelled] =
        [&first, &at_cutoff].map(|submission| evaluation_path(&day, submission));
    let reason = json!({ "reason": "power cut" });
    let cancel = server.post(&format!("{cancelled}/cancel"), &server.admin_token, &reason);
    assert_eq!(cancel.status(), 200);
    let done = greedy.wait_until_finished(&server, &finished);
    assert_eq!(done["state"], "finished", "{done:#}");
    let seed = done["result"]["seed"].clone();
    assert!(seed.is_string(), "the day is released: {done:#}");
    let evaluations_before = evaluations_of(&server, &day);

    // The team makes variants that know the public seed, and tries every way to request an evaluation for them.
    for number in 0..3 {
        let variant = holding_agent(scratch.path(), &format!("variant-{number}"));
        let variant = greedy.submit(&server, &variant);
        assert_eq!(variant["state"], "valid", "{variant:#}");
        let id = variant["id"].as_str().expect("a submission has an id");
        for token in [&greedy.token, &server.admin_token] {
            let path = format!("/api/v1/submissions/{id}/evaluations");
            assert_refused(server.post(&path, token, &json!({})), 410, "gone");
        }
        assert_eq!(activate(&server, &greedy, &variant).status(), 200);
        let start_by_team = server.post("/api/v1/days", &greedy.token, &json!({}));
        assert_refused(start_by_team, 403, "forbidden");
        assert_second_start_is_refused(&server, &day);
        let rerun = format!("{finished}/rerun");
        assert_refused(
            server.post(&rerun, &greedy.token, &json!({})),
            403,
            "forbidden",
        );
        let with_variant = json!({ "submission": id });
        let rerun_by_organiser = server.post(&rerun, &server.admin_token, &with_variant);
        assert_refused(rerun_by_organiser, 409, "conflict");
    }
    assert_eq!(evaluations_of(&server, &day), evaluations_before);

    // A rerun by the organiser uses the submission of the cutoff and the day's seed.
    let better = stopped.submit(&server, &holding_agent(scratch.path(), "better"));
    assert_eq!(better["active"], true, "{better:#}");
    // The submission in the body has no effect.
    let with_newer = json!({ "submission": better["id"] });
    let rerun = server.post(
        &format!("{cancelled}/rerun"),
        &server.admin_token,
        &with_newer,
    );
    assert_eq!(rerun.status(), 201);
    let rerun = json_of(rerun);
    assert_eq!(rerun["submission"], at_cutoff["id"]);
    let path = format!(
        "/api/v1/evaluations/{}",
        rerun["id"].as_str().expect("an id")
    );
    let done = stopped.wait_until_finished(&server, &path);
    assert_eq!(done["state"], "finished", "{done:#}");
    let manifest = manifest(&server, &path, &stopped.token);
    assert_eq!(
        (&manifest["agent"], &manifest["seed"]),
        (&json!("at-cutoff"), &seed)
    );
}

#[test]
fn second_start_and_choice_after_cutoff_change_nothing() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let team = Team::create(&server, "Undecided");
    let older = team.submit(&server, &holding_agent(scratch.path(), "older"));
    let newer = team.submit(&server, &holding_agent(scratch.path(), "newer"));
    assert_eq!(newer["active"], true, "{newer:#}");
    assert_eq!(activate(&server, &team, &older).status(), 200);
    let day = start_day(&server);
    let evaluation = evaluation_path(&day, &older);
    // After the cutoff the team chooses another submission and uploads a newer one, which becomes active. The organiser tries
    // to start the day again, also with another request body.
    assert_eq!(activate(&server, &team, &newer).status(), 200);
    let newest = team.submit(&server, &holding_agent(scratch.path(), "newest"));
    assert_eq!(newest["active"], true, "{newest:#}");
    assert_second_start_is_refused(&server, &day);
    let with_stage = json!({ "stage": day["stage"] });
    let answer = server.post("/api/v1/days", &server.admin_token, &with_stage);
    if get(&server, "/api/v1/season", &team.token)["today"] == day["day"] {
        assert_refused(answer, 409, "cutoff-passed");
    }
    let done = team.wait_until_finished(&server, &evaluation);
    assert_eq!(done["state"], "finished", "{done:#}");
    assert_eq!(done["submission"], older["id"]);
    assert_eq!(evaluations_of(&server, &day).len(), 1);
    assert_eq!(
        manifest(&server, &evaluation, &team.token)["agent"],
        "older"
    );
    let me = get(&server, "/api/v1/me", &team.token);
    assert_eq!(me["active_submission"], newest["id"]);
}

/// Statements at each step of an agent that logs how each episode begins, and exits in the sixteenth episode of a shard: no
/// validation run is that long.
const LEAKING_AGENT: &str = "
if message['step'] == 0:
    seen = globals().get('seen', 0) + 1
    sys.stderr.write('it begins with %s\\n' % message['obs'][:3])
if seen > 15:
    sys.exit(9)
say(hold)";

#[test]
fn pending_rerun_delays_release_and_locks_out_no_team() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (data_dir, config) = (scratch.path().join("data"), one_task());
    let server = Server::start(&data_dir, &config);
    let [early, leaking, broken, newcomer] =
        ["Early", "Leaking", "Broken", "Newcomer"].map(|name| Team::create(&server, name));
    let leaks = python_bundle(scratch.path(), "leaks", &python_agent(LEAKING_AGENT));
    let submissions = [
        early.submit(&server, &repository().join("agents/hold")),
        leaking.submit(&server, &leaks),
        broken.submit(&server, &holding_agent(scratch.path(), "lost")),
    ];
    for submission in &submissions {
        assert_eq!(submission["state"], "valid", "{submission:#}");
    }
    // A platform fault: a bundle is lost while no server has it unpacked.
    server.kill();
    let team = submissions[2]["team"].as_str().expect("a team has an id");
    let bundles = data_dir.join("artifacts/bundles").join(team);
    let lost = scratch.path().join("lost-bundles");
    fs::rename(&bundles, &lost).expect("it was uploaded");
    let server = Server::start(&data_dir, &config);
    let day = start_day(&server);
    let [finished, failed, lost_bundle] =
        [0, 1, 2].map(|index| evaluation_path(&day, &submissions[index]));
    let done = early.wait_until_finished(&server, &finished);
    assert_eq!(done["state"], "finished", "{done:#}");
    assert!(done["result"]["score"].is_number(), "{done:#}");
    let state = leaking.wait_until_finished(&server, &failed);
    assert_eq!(state["state"], "agent_failed", "{state:#}");
    let first_attempt = broken.wait_until_finished(&server, &lost_bundle);
    assert_eq!(
        first_attempt["state"], "platform_failed",
        "{first_attempt:#}"
    );

    // Log and faults of the failed agent are hidden on every page.
    let admin = &server.admin_token;
    let pages = [
        failed.clone(),
        failed.replace("/api/v1", ""),
        "/api/v1/evaluations".to_owned(),
        "/".to_owned(),
    ];
    for path in &pages {
        for token in [&leaking.token, admin] {
            let body = server.get(path, Some(token)).text().expect("it is text");
            for part in ["it begins with", "status 9", "\"faults\"", "\"log\""] {
                assert!(!body.contains(part), "{part} is in {path}: {body}");
            }
        }
    }
    // The dataset of the finished evaluation is refused to each request, and details of its episodes are hidden.
    let dataset = format!("{finished}/dataset");
    for token in [&early.token, admin] {
        for method in [Method::HEAD, Method::GET] {
            let answer = server.request(method, &dataset, token).send();
            assert_eq!(answer.expect("the server answers").status(), 409);
        }
        let part = server
            .request(Method::GET, &dataset, token)
            .header("range", "bytes=0-99");
        assert_refused(part.send().expect("the server answers"), 409, "not-yet");
    }
    for field in ["/result/seed", "/result/timing", "/result/tasks/hit/steps"] {
        let value = done.pointer(field).unwrap_or(&Value::Null);
        assert!(value.is_null(), "{field}: {done:#}");
    }
    // No team is locked out meanwhile: new uploads are valid and active for the next day.
    let new_uploads = [
        (&leaking, "informed"),
        (&newcomer, "new"),
        (&early, "again"),
    ];
    for (team, name) in new_uploads {
        let uploaded = team.submit(&server, &holding_agent(scratch.path(), name));
        assert_eq!(
            (&uploaded["state"], &uploaded["active"]),
            (&json!("valid"), &json!(true)),
            "{uploaded:#}"
        );
    }
    assert_second_start_is_refused(&server, &day);

    // The bundle is restored, and the same submission is evaluated on the same episodes.
    fs::rename(&lost, &bundles).expect("the folder can be moved back");
    let is_finished = |evaluation: &&Value| evaluation["state"] == "finished";
    let own_evaluations = server.poll("/api/v1/evaluations", &broken.token, |list| {
        list.as_array()
            .expect("a list")
            .iter()
            .any(|evaluation| is_finished(&evaluation))
    });
    let rerun = own_evaluations
        .as_array()
        .expect("a list")
        .iter()
        .find(is_finished);
    let rerun = rerun.expect("the poll has found it");
    assert!(rerun["rerun_of"].is_string(), "{own_evaluations:#}");
    assert_eq!(rerun["submission"], submissions[2]["id"]);
    let path = format!(
        "/api/v1/evaluations/{}",
        rerun["id"].as_str().expect("an id")
    );

    // The end of the rerun released the day to the teams.
    let seeds = [(&finished, &early), (&path, &broken)]
        .map(|(path, team)| manifest(&server, path, &team.token)["seed"].clone());
    assert_eq!(seeds[0], seeds[1]);
    assert_eq!(
        get(&server, &path, &broken.token)["result"]["seed"],
        seeds[0]
    );
    let state = get(&server, &failed, &leaking.token);
    let log = state["log"].as_str().expect("a failed agent has a log");
    assert_eq!(log.matches("it begins with").count(), 16, "{log}");
    assert!(
        state["faults"][0]["message"]
            .as_str()
            .is_some_and(|text| text.contains("status 9"))
    );
    let head = server.request(Method::HEAD, &dataset, &early.token).send();
    assert_eq!(head.expect("the server answers").status(), 200);
    let day_submissions: Vec<_> = evaluations_of(&server, &day)
        .into_iter()
        .map(|(_, submission)| submission)
        .collect();
    assert!(
        day_submissions.len() > submissions.len(),
        "{day_submissions:?}"
    );
    assert!(
        day_submissions
            .iter()
            .all(|id| submissions.iter().any(|submission| submission["id"] == *id))
    );
    // The same bundle can still be uploaded by another team.
    assert_eq!(server.upload(&newcomer.token, pack(&leaks)).status(), 201);
}
