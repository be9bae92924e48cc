//! A day of a team that has nothing but the program: it signs in, submits, follows, and gets what is its own.

use crate::{
    CONFIG, Team,
    commands::{FAILED, MISUSED, NOT_ALLOWED, REFUSED, UNREACHABLE, admin, faceoff_of},
    start_day,
};
use faceoff_tests::{
    program, repository,
    server::{Server, http},
};
use serde_json::Value;
use std::{
    fs,
    io::{BufRead, BufReader},
    os::unix::fs::PermissionsExt,
    path::Path,
    process::{Command, Stdio},
};

const PASSWORD: &str = "a dozen characters, and more\n";

/// A link by which a team is founded.
fn founders_link(server: &Server) -> String {
    let invited = admin(server, &["people", "invite-team", "Ada", "--json"]).json();
    invited["link"]
        .as_str()
        .expect("an invitation has a link")
        .to_owned()
}

#[test]
fn a_team_signs_in_and_out_and_its_token_is_never_shown() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let home = scratch.path().join("config");
    let ada = |args: &[&str], input: &str| faceoff_of(&home, args, input);
    let file = home.join("faceoff/credentials.toml");

    ada(&["whoami"], "").not_done(NOT_ALLOWED, &["faceoff login", "FACEOFF_TOKEN"]);
    ada(
        &["login", "http://127.0.0.1:1", "--token-stdin"],
        "fo_person_x\n",
    )
    .not_done(UNREACHABLE, &["talking to http://127.0.0.1:1"]);
    assert!(!file.exists(), "what cannot be tried is not kept");

    // An invitation, kept at once.
    let link = founders_link(&server);
    let join = [
        "join",
        &link,
        "--server",
        &server.url,
        "--name",
        "Ada",
        "--team",
        "Alpha",
        "--password-stdin",
        "--sign-in",
    ];
    let told = ada(&join, PASSWORD).done();
    assert!(
        told.contains("signed in to") && !told.contains("fo_person"),
        "{told}"
    );
    let mode = fs::metadata(&file)
        .expect("it is kept")
        .permissions()
        .mode();
    assert_eq!(mode & 0o777, 0o600);
    let told = ada(&["whoami"], "").done();
    assert!(
        told.contains("Ada") && told.contains("(faceoff login), token by faceoff login"),
        "{told}"
    );
    let told = ada(&["whoami", "--json"], "").json();
    assert_eq!(told["server_from"], "login", "{told:#}");

    // The command line is stronger.
    ada(&["whoami", "--token", "fo_person_nobody"], "").not_done(NOT_ALLOWED, &["401"]);
    ada(&["whoami", "--server", "http://127.0.0.1:1"], "")
        .not_done(NOT_ALLOWED, &["nobody is signed in to"]);
    ada(&["login", "--surely"], "").not_done(MISUSED, &["--surely"]);

    // Out, but for the token.
    let kept = fs::read_to_string(&file).expect("it can be read");
    let kept = kept.split('"').find(|word| word.starts_with("fo_person_"));
    let token = kept.expect("the token is in the file").to_owned();
    let told = ada(&["logout", "--keep-token"], "").done();
    assert!(told.contains("still good"), "{told}");
    ada(&["logout"], "").not_done(FAILED, &["nobody is signed in"]);
    ada(&["status"], "").not_done(NOT_ALLOWED, &["nobody is signed in to"]);
    let told = ada(
        &["login", &server.url, "--token-stdin"],
        &format!("{token}\n"),
    )
    .done();
    assert!(
        told.contains("member of the team Alpha") && !told.contains(&token),
        "{told}"
    );

    // By name and password: a token of its own, which ends with the login.
    let by_password = ["login", &server.url, "--name", "Ada", "--password-stdin"];
    ada(&by_password, "something else entirely\n").not_done(NOT_ALLOWED, &["401"]);
    let told = ada(&by_password, PASSWORD).done();
    assert!(told.contains("by the token faceoff login"), "{told}");
    let tokens = ada(&["token", "list", "--json"], "").json();
    let of_sessions = tokens
        .as_array()
        .expect("a list")
        .iter()
        .filter(|token| token["kind"] == "session" && token["revoked_at"].is_null());
    assert_eq!(of_sessions.count(), 0, "{tokens:#}");
    let told = ada(&["logout"], "").done();
    assert!(told.contains("its token is revoked"), "{told}");
    ada(&["whoami", "--server", &server.url, "--token", &token], "").done();
    assert!(
        !fs::read_to_string(&file)
            .expect("it can be read")
            .contains("fo_")
    );
}

#[test]
fn an_organiser_signs_in_and_needs_no_data_folder() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let home = scratch.path().join("config");
    let grace = |args: &[&str], input: &str| faceoff_of(&home, args, input);
    grace(&["admin", "teams", "--server", &server.url], "").not_done(
        NOT_ALLOWED,
        &[
            "reading the organiser's token from",
            "--data-dir",
            "faceoff login",
        ],
    );
    let invited = admin(&server, &["people", "invite-organiser", "Grace", "--json"]).json();
    let link = invited["link"].as_str().expect("it has a link");
    let join = [
        "join",
        link,
        "--server",
        &server.url,
        "--name",
        "Grace",
        "--sign-in",
    ];
    grace(&join, "").done();
    let told = grace(&["admin", "teams"], "").done();
    assert!(told.contains("no team"), "{told}");
}

#[test]
fn a_team_submits_a_folder_follows_it_and_gets_its_dataset_back() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let home = scratch.path().join("config");
    let ada = |args: &[&str]| faceoff_of(&home, args, "");
    let link = founders_link(&server);
    let join = [
        "join",
        &link,
        "--server",
        &server.url,
        "--name",
        "Ada",
        "--team",
        "Alpha",
        "--sign-in",
    ];
    ada(&join).done();

    let bundle = scratch.path().join("my-agent");
    fs::create_dir_all(bundle.join("__pycache__")).expect("a folder can be made");
    let hold = repository().join("agents/hold");
    for file in ["agent.toml", "agent.py", "protocol.py"] {
        fs::copy(hold.join(file), bundle.join(file)).expect("a file can be copied");
    }
    fs::write(bundle.join("__pycache__/agent.pyc"), "x").expect("a file can be written");
    fs::write(bundle.join("notes.md"), "plans").expect("a file can be written");
    fs::write(bundle.join(".faceoffignore"), "notes.md\n").expect("a file can be written");
    let at = |path: &Path| path.to_str().expect("a path of ours is text").to_owned();

    let dry = ada(&["submit", &at(&bundle), "--dry-run", "--json"]).json();
    let files: Vec<_> = dry["files"]
        .as_array()
        .expect("of a folder all are listed")
        .iter()
        .map(|file| file["path"].clone())
        .collect();
    assert_eq!(files, ["agent.py", "agent.toml", "protocol.py"], "{dry:#}");
    assert_eq!(
        dry["left_out"],
        serde_json::json!([".faceoffignore", "__pycache__", "notes.md"])
    );
    let submitted = ada(&["submit", &at(&bundle)]);
    let said = submitted.done();
    assert!(said.contains("valid: hold starts"), "{said}");
    let again = ada(&["submit", &at(&bundle), "--json"]).json();
    assert_eq!(again["state"], "valid", "{again:#}");
    let first = again["same_as"]
        .as_str()
        .expect("the same folder is the same archive")
        .to_owned();

    let log = ada(&["log", &first, "--json"]).json();
    assert_eq!(
        (&log["of"], &log["state"]),
        (&"submission".into(), &"valid".into()),
        "{log:#}"
    );
    ada(&["log", "00000000-0000-7000-8000-000000000000"])
        .not_done(FAILED, &["no submission, evaluation or game"]);
    let second = again["id"]
        .as_str()
        .expect("a submission has an id")
        .to_owned();
    let told = ada(&["withdraw", &second]).done();
    assert!(told.contains("withdrawn"), "{told}");
    ada(&["activate", &second]).done();
    let board = ada(&["board", "--json"]).json();
    assert_eq!(board["rows"], serde_json::json!([]));
    assert!(ada(&["board", "hit"]).done().contains("no results yet"));
    let offered = ada(&["runtimes", "--json"]).json();
    assert_eq!(offered["network"], "none", "{offered:#}");
    let told = ada(&["runtimes"]).done();
    assert!(told.contains("python3") && told.contains("glibc"), "{told}");
    let season = ada(&["season", "--json"]).json();
    assert_eq!(season["closed_at"], Value::Null, "{season:#}");
    assert!(ada(&["season"]).done().contains("commitment "));
    assert_eq!(ada(&["health", "--json"]).json()["status"], "ok");
    assert!(ada(&["health"]).done().starts_with("ok, version "));
    ada(&["board", "--division", "Open"]).not_done(REFUSED, &["404"]);
    ada(&["board", "--stage", "Final"]).not_done(FAILED, &["no stage is named"]);

    let day = start_day(&server);
    let evaluation = day["created"][0]["id"]
        .as_str()
        .expect("it plays")
        .to_owned();
    let token = fs::read_to_string(home.join("faceoff/credentials.toml")).expect("it is kept");
    let token = token
        .split('"')
        .find(|word| word.starts_with("fo_person_"))
        .expect("the token is there")
        .to_owned();
    let path = format!("/api/v1/evaluations/{evaluation}");
    let ended = server.poll(&path, &token, |answer: &Value| {
        !answer["released_at"].is_null()
    });
    assert_eq!(ended["state"], "finished", "{ended:#}");
    let told = ada(&["status"]).done();
    assert!(
        told.contains("last evaluations:")
            && told.contains(&evaluation)
            && told.contains("finished: score"),
        "{told}"
    );
    let board = ada(&["board", "--csv"]).done();
    assert!(
        board
            .lines()
            .nth(1)
            .is_some_and(|row| row.starts_with("1,") && row.contains(",Alpha,")),
        "{board}"
    );
    assert!(ada(&["board"]).done().contains("Alpha"));

    let file = scratch.path().join("dataset.zip");
    let download = [
        "dataset",
        "download",
        &evaluation,
        "--out",
        &at(&file),
        "--json",
    ];
    let done = ada(&download).json();
    assert_eq!(done["checked"], true, "{done:#}");
    assert_eq!(done["blake3"], ended["dataset_blake3"]);
    ada(&[
        "verify",
        &at(&file),
        "--blake3",
        done["blake3"].as_str().expect("a hash is text"),
    ])
    .done();
    // Of an agent and itself all that it solved was solved by both.
    let itself = [
        "compare",
        &evaluation,
        &evaluation,
        "--server",
        &server.url,
        "--episodes",
        "--json",
    ];
    let compared = ada(&itself).json();
    for (task, counts) in compared["tasks"].as_object().expect("it has tasks") {
        let of = &compared["episodes"][task];
        for whom in ["both", "only_a", "only_b", "neither"] {
            let listed = of[whom].as_array().expect("each has a list");
            assert_eq!(counts[whom], listed.len(), "{task}, {whom}: {compared:#}");
        }
    }
    let link = ada(&["link", "dataset", &evaluation, "--json"]).json();
    let url = link["url"].as_str().expect("a link has an address");
    let anybodys = http()
        .build()
        .expect("a client needs nothing")
        .get(url)
        .send();
    let anybodys = anybodys
        .expect("the server answers")
        .bytes()
        .expect("all of it comes");
    assert_eq!(anybodys, fs::read(&file).expect("it is there"));
    // What is not of this dataset is not kept.
    fs::write(scratch.path().join("dataset.zip.part"), "something else")
        .expect("a file can be written");
    assert_eq!(ada(&download).json()["blake3"], done["blake3"]);
}

#[test]
fn a_team_watches_how_it_stands() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let team = Team::create(&server, "Alpha");
    let submission = team.submit(&server, &repository().join("agents/hold"));
    let id = submission["id"].as_str().expect("a submission has an id");
    let who = ["--server", &server.url, "--token", &team.token];
    let mut watching = Command::new(program("faceoff"))
        .args(["status", "--watch", "--json"])
        .args(who)
        .env("XDG_CONFIG_HOME", scratch.path())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the program can be started");
    let told = BufReader::new(watching.stdout.take().expect("standard output is piped"));
    let mut told = told.lines().map(|line| -> Value {
        let line = line.expect("it goes on until it is ended");
        serde_json::from_str(&line).expect("each line is JSON")
    });
    let first = told.next().expect("it tells how the team stands");
    assert_eq!(first["me"]["active_submission"], id, "{first:#}");
    faceoff_of(scratch.path(), &[&["withdraw", id][..], &who].concat(), "").done();
    let changed = told.find(|told| told["me"]["active_submission"].is_null());
    assert!(changed.is_some(), "a change is told");
    watching.kill().expect("a child can be killed");
    watching.wait().expect("a child can be reaped");
}
