//! Teams that try to choose their luck of a day: by playing it more than once, by carrying what they saw of it
//! to a later upload, by locking others out. The day has one cut, and comes out when all of it is over.

use crate::{CONFIG, Team, path_of, start_day};
use faceoff_tests::{
    bundle::{packed, python_agent, python_bundle},
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

/// One task, and shards that are longer than a smoke run.
fn one_task() -> String {
    CONFIG.replace(
        "episodes_per_task = 4\nepisodes_per_shard = 2",
        "tasks = [\"hit\"]\nepisodes_per_task = 18\nepisodes_per_shard = 18\nmax_faults = 0",
    )
}

/// An agent that holds still, told from others by its name and, in its manifest, nothing else.
fn holding(folder: &Path, name: &str) -> PathBuf {
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

/// Asserts a problem of this kind.
fn assert_refused(answer: Response, status: u16, kind: &str) -> Value {
    assert_eq!(answer.status(), status);
    let problem = json_of(answer);
    assert_eq!(problem["type"], format!("/problems#{kind}"), "{problem:#}");
    problem
}

/// Another start of the day, which starts nothing, unless a midnight has passed since.
fn start_again(server: &Server, day: &Value) {
    let answer = server.post("/api/v1/days", &server.admin_token, &json!({}));
    if get(server, "/api/v1/season", &server.admin_token)["today"] == day["day"] {
        let problem = assert_refused(answer, 409, "day-has-cut");
        assert!(problem["next_cut"]["day"].is_string(), "{problem:#}");
    }
}

/// The evaluations of the day: their ids with what plays.
fn plays(server: &Server, day: &Value) -> Vec<(Value, Value)> {
    let day = day["day"].as_str().expect("a day has a date");
    let path = format!("/api/v1/evaluations?day={day}");
    let list = get(server, &path, &server.admin_token);
    list.as_array()
        .expect("a list")
        .iter()
        .map(|evaluation| (evaluation["id"].clone(), evaluation["submission"].clone()))
        .collect()
}

fn manifest(server: &Server, evaluation: &str, token: &str) -> Value {
    let answer = server.get(&format!("{evaluation}/dataset"), Some(token));
    assert_eq!(answer.status(), 200, "the dataset of {evaluation}");
    let bytes = answer.bytes().expect("the download completes");
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).expect("a dataset is a zip");
    let file = archive.by_name("manifest.json");
    serde_json::from_reader(file.expect("a dataset has a manifest")).expect("it is JSON")
}

fn activate(server: &Server, team: &Team, submission: &Value) -> Response {
    let id = submission["id"].as_str().expect("a submission has an id");
    let path = format!("/api/v1/submissions/{id}/activate");
    server.post(&path, &team.token, &json!({}))
}

#[test]
fn best_of_n_after_the_release_plays_nothing_of_the_day() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let (greedy, stopped) = (
        Team::create(&server, "Greedy"),
        Team::create(&server, "Stopped"),
    );
    let first = greedy.submit(&server, &holding(scratch.path(), "first"));
    let entered = stopped.submit(&server, &holding(scratch.path(), "entered"));
    let day = start_day(&server);
    let [played, cancelled] = [&first, &entered].map(|submission| path_of(&day, submission));
    let reason = json!({ "reason": "power cut" });
    let cancel = server.post(&format!("{cancelled}/cancel"), &server.admin_token, &reason);
    assert_eq!(cancel.status(), 200);
    let done = greedy.finished(&server, &played);
    assert_eq!(done["state"], "finished", "{done:#}");
    let seed = done["result"]["seed"].clone();
    assert!(seed.is_string(), "the day is released: {done:#}");
    let before = plays(&server, &day);

    // Variants made with the public seed, and every way to have one of them play.
    for number in 0..3 {
        let variant = holding(scratch.path(), &format!("variant-{number}"));
        let variant = greedy.submit(&server, &variant);
        assert_eq!(variant["state"], "valid", "{variant:#}");
        let id = variant["id"].as_str().expect("a submission has an id");
        for token in [&greedy.token, &server.admin_token] {
            let path = format!("/api/v1/submissions/{id}/evaluations");
            assert_refused(server.post(&path, token, &json!({})), 410, "gone");
        }
        assert_eq!(activate(&server, &greedy, &variant).status(), 200);
        let day_by_team = server.post("/api/v1/days", &greedy.token, &json!({}));
        assert_refused(day_by_team, 403, "forbidden");
        start_again(&server, &day);
        let rerun = format!("{played}/rerun");
        assert_refused(
            server.post(&rerun, &greedy.token, &json!({})),
            403,
            "forbidden",
        );
        let other = json!({ "submission": id });
        let by_organiser = server.post(&rerun, &server.admin_token, &other);
        assert_refused(by_organiser, 409, "conflict");
    }
    assert_eq!(plays(&server, &day), before);

    // What the organiser has played again is what was active at the cut, on the day's seed.
    let better = stopped.submit(&server, &holding(scratch.path(), "better"));
    assert_eq!(better["active"], true, "{better:#}");
    let other = json!({ "submission": better["id"] });
    let rerun = server.post(&format!("{cancelled}/rerun"), &server.admin_token, &other);
    assert_eq!(rerun.status(), 201);
    let rerun = json_of(rerun);
    assert_eq!(rerun["submission"], entered["id"]);
    let path = format!(
        "/api/v1/evaluations/{}",
        rerun["id"].as_str().expect("an id")
    );
    let done = stopped.finished(&server, &path);
    assert_eq!(done["state"], "finished", "{done:#}");
    let manifest = manifest(&server, &path, &stopped.token);
    assert_eq!(
        (&manifest["agent"], &manifest["seed"]),
        (&json!("entered"), &seed)
    );
}

#[test]
fn a_second_start_and_a_choice_after_the_cut_change_nothing() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let team = Team::create(&server, "Undecided");
    let older = team.submit(&server, &holding(scratch.path(), "older"));
    let newer = team.submit(&server, &holding(scratch.path(), "newer"));
    assert_eq!(newer["active"], true, "{newer:#}");
    assert_eq!(activate(&server, &team, &older).status(), 200);
    let day = start_day(&server);
    let evaluation = path_of(&day, &older);
    // A choice, an upload that takes its place, and other bodies of the request.
    assert_eq!(activate(&server, &team, &newer).status(), 200);
    let newest = team.submit(&server, &holding(scratch.path(), "newest"));
    assert_eq!(newest["active"], true, "{newest:#}");
    start_again(&server, &day);
    let named = json!({ "stage": day["stage"] });
    let answer = server.post("/api/v1/days", &server.admin_token, &named);
    if get(&server, "/api/v1/season", &team.token)["today"] == day["day"] {
        assert_refused(answer, 409, "day-has-cut");
    }
    let done = team.finished(&server, &evaluation);
    assert_eq!(done["state"], "finished", "{done:#}");
    assert_eq!(done["submission"], older["id"]);
    assert_eq!(plays(&server, &day).len(), 1);
    assert_eq!(
        manifest(&server, &evaluation, &team.token)["agent"],
        "older"
    );
    let me = get(&server, "/api/v1/me", &team.token);
    assert_eq!(me["active_submission"], newest["id"]);
}

/// Writes down how each episode begins, and falls in the sixteenth of a shard: longer than any smoke run.
const TELLTALE: &str = "
if message['step'] == 0:
    seen = globals().get('seen', 0) + 1
    sys.stderr.write('it begins with %s\\n' % message['obs'][:3])
if seen > 15:
    sys.exit(9)
say(hold)";

#[test]
fn while_one_is_to_be_played_again_nothing_comes_out_and_nobody_is_locked_out() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (data_dir, config) = (scratch.path().join("data"), one_task());
    let server = Server::start(&data_dir, &config);
    let [early, telltale, broken, newcomer] =
        ["Early", "Telltale", "Broken", "Newcomer"].map(|name| Team::create(&server, name));
    let leaks = python_bundle(scratch.path(), "leaks", &python_agent(TELLTALE));
    let submissions = [
        early.submit(&server, &repository().join("agents/hold")),
        telltale.submit(&server, &leaks),
        broken.submit(&server, &holding(scratch.path(), "lost")),
    ];
    for submission in &submissions {
        assert_eq!(submission["state"], "valid", "{submission:#}");
    }
    // We lose a bundle; the server that has unpacked it is gone.
    server.kill();
    let team = submissions[2]["team"].as_str().expect("a team has an id");
    let bundles = data_dir.join("artifacts/bundles").join(team);
    let lost = scratch.path().join("lost-bundles");
    fs::rename(&bundles, &lost).expect("it was uploaded");
    let server = Server::start(&data_dir, &config);
    let day = start_day(&server);
    let [finished, failed, unplayed] = [0, 1, 2].map(|index| path_of(&day, &submissions[index]));
    let done = early.finished(&server, &finished);
    assert_eq!(done["state"], "finished", "{done:#}");
    assert!(done["result"]["score"].is_number(), "{done:#}");
    let state = telltale.finished(&server, &failed);
    assert_eq!(state["state"], "agent_failed", "{state:#}");
    let first_try = broken.finished(&server, &unplayed);
    assert_eq!(first_try["state"], "platform_failed", "{first_try:#}");

    // The failed agent's log and faults, wherever one may look.
    let admin = &server.admin_token;
    let pages = [
        failed.clone(),
        failed.replace("/api/v1", ""),
        "/api/v1/evaluations".to_owned(),
        "/".to_owned(),
    ];
    for path in &pages {
        for token in [&telltale.token, admin] {
            let body = server.get(path, Some(token)).text().expect("it is text");
            for part in ["it begins with", "status 9", "\"faults\"", "\"log\""] {
                assert!(!body.contains(part), "{part} is in {path}: {body}");
            }
        }
    }
    // The early dataset, asked for in every way, and what tells of its episodes.
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
        let told = done.pointer(field).unwrap_or(&Value::Null);
        assert!(told.is_null(), "{field}: {done:#}");
    }
    // Nobody is locked out by it; what is learnt from a log could play another day only.
    let sources = [
        (&telltale, "informed"),
        (&newcomer, "new"),
        (&early, "again"),
    ];
    for (team, name) in sources {
        let uploaded = team.submit(&server, &holding(scratch.path(), name));
        assert_eq!(
            (&uploaded["state"], &uploaded["active"]),
            (&json!("valid"), &json!(true)),
            "{uploaded:#}"
        );
    }
    start_again(&server, &day);

    // The bundle is found; the same submission plays the same episodes again.
    fs::rename(&lost, &bundles).expect("it goes back");
    let is_finished = |one: &&Value| one["state"] == "finished";
    let own = server.poll("/api/v1/evaluations", &broken.token, |own| {
        own.as_array()
            .expect("a list")
            .iter()
            .any(|one| is_finished(&one))
    });
    let again = own.as_array().expect("a list").iter().find(is_finished);
    let again = again.expect("it was waited for");
    assert!(again["rerun_of"].is_string(), "{own:#}");
    assert_eq!(again["submission"], submissions[2]["id"]);
    let path = format!(
        "/api/v1/evaluations/{}",
        again["id"].as_str().expect("an id")
    );

    // Its end released the day, to those it belongs to.
    let seeds = [(&finished, &early), (&path, &broken)]
        .map(|(path, team)| manifest(&server, path, &team.token)["seed"].clone());
    assert_eq!(seeds[0], seeds[1]);
    assert_eq!(
        get(&server, &path, &broken.token)["result"]["seed"],
        seeds[0]
    );
    let state = get(&server, &failed, &telltale.token);
    let log = state["log"].as_str().expect("a failed agent has a log");
    assert_eq!(log.matches("it begins with").count(), 16, "{log}");
    assert!(
        state["faults"][0]["message"]
            .as_str()
            .is_some_and(|text| text.contains("status 9"))
    );
    let head = server.request(Method::HEAD, &dataset, &early.token).send();
    assert_eq!(head.expect("the server answers").status(), 200);
    let of_day: Vec<_> = plays(&server, &day)
        .into_iter()
        .map(|(_, plays)| plays)
        .collect();
    assert!(of_day.len() > submissions.len(), "{of_day:?}");
    assert!(
        of_day
            .iter()
            .all(|plays| submissions.iter().any(|one| one["id"] == *plays))
    );
    // An archive is as good as it was: nobody's upload was touched.
    assert_eq!(server.upload(&newcomer.token, packed(&leaks)).status(), 201);
}
