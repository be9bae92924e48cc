//! What a team does on a day, with nothing but the command-line program `faceoff`: sign in, submit, watch progress, download
//! results.

use crate::{
    CONFIG, Team,
    commands::{
        FAILED, NOT_ALLOWED, REFUSED, UNREACHABLE, USAGE_ERROR, admin, faceoff_with_home, join_args,
    },
    start_day,
};
use faceoff_tests::{
    program,
    relay::Relay,
    repository,
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

/// The beginning of each user's token.
const TOKEN_PREFIX: &str = "fo_person_";
/// A password as a line of standard input.
const PASSWORD: &str = "a dozen characters, and more\n";

/// An invitation link for a new team.
fn team_invitation_link(server: &Server) -> String {
    let invited = admin(server, &["people", "invite-team", "Ada", "--json"]).json();
    invited["link"]
        .as_str()
        .expect("an invitation has a link")
        .to_owned()
}

#[test]
fn sign_in_and_sign_out_never_print_the_token() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let home = scratch.path().join("config");
    // Runs the program as Ada, a member of a team.
    let ada = |args: &[&str], input: &str| faceoff_with_home(&home, args, input);
    let credentials_file = home.join("faceoff/credentials.toml");

    ada(&["whoami"], "").expect_refusal(NOT_ALLOWED, &["faceoff login", "FACEOFF_TOKEN"]);
    ada(
        &["login", "http://127.0.0.1:1", "--token-stdin"],
        "fo_person_x\n",
    )
    .expect_refusal(UNREACHABLE, &["talking to http://127.0.0.1:1"]);
    assert!(
        !credentials_file.exists(),
        "a token that cannot be verified is not stored"
    );

    // Joining with --sign-in stores the token.
    let link = team_invitation_link(&server);
    let founder = ["--name", "Ada", "--team", "Alpha", "--sign-in"];
    let founder = [&founder[..], &["--password-stdin"]].concat();
    let join = join_args(&server, &link, &founder);
    let output = ada(&join, PASSWORD).expect_success();
    assert!(
        output.contains("signed in to") && !output.contains(TOKEN_PREFIX),
        "{output}"
    );
    let mode = fs::metadata(&credentials_file)
        .expect("the login is stored")
        .permissions()
        .mode();
    assert_eq!(mode & 0o777, 0o600);
    let output = ada(&["whoami"], "").expect_success();
    assert!(
        output.contains("Ada") && output.contains("(faceoff login), token from faceoff login"),
        "{output}"
    );
    let account = ada(&["whoami", "--json"], "").json();
    assert_eq!(account["server_from"], "login", "{account:#}");

    // Options of the command line override the stored login.
    ada(&["whoami", "--token", "fo_person_unknown"], "").expect_refusal(NOT_ALLOWED, &["401"]);
    ada(&["whoami", "--server", "http://127.0.0.1:1"], "")
        .expect_refusal(NOT_ALLOWED, &["not signed in to"]);
    ada(&["login", "--surely"], "").expect_refusal(USAGE_ERROR, &["--surely"]);

    // Signing out with --keep-token does not revoke the token. It can be used to sign in again.
    let credentials = fs::read_to_string(&credentials_file).expect("the file can be read");
    let stored_token = credentials
        .split('"')
        .find(|word| word.starts_with(TOKEN_PREFIX));
    let token = stored_token.expect("the token is in the file").to_owned();
    let output = ada(&["logout", "--keep-token"], "").expect_success();
    assert!(output.contains("still valid"), "{output}");
    ada(&["logout"], "").expect_refusal(FAILED, &["not signed in"]);
    ada(&["status"], "").expect_refusal(NOT_ALLOWED, &["not signed in to"]);
    let output = ada(
        &["login", &server.url, "--token-stdin"],
        &format!("{token}\n"),
    )
    .expect_success();
    assert!(
        output.contains("member of the team Alpha") && !output.contains(&token),
        "{output}"
    );

    // Signing in by name and password creates a separate token, which signing out revokes.
    let by_password = ["login", &server.url, "--name", "Ada", "--password-stdin"];
    ada(&by_password, "something else entirely\n").expect_refusal(NOT_ALLOWED, &["401"]);
    let output = ada(&by_password, PASSWORD).expect_success();
    assert!(output.contains("with the token “faceoff login"), "{output}");
    let tokens = ada(&["token", "list", "--json"], "").json();
    let sessions = tokens
        .as_array()
        .expect("a list")
        .iter()
        .filter(|token| token["kind"] == "session" && token["revoked_at"].is_null());
    assert_eq!(sessions.count(), 0, "{tokens:#}");
    let output = ada(&["logout"], "").expect_success();
    assert!(output.contains("the token is revoked"), "{output}");
    ada(&["whoami", "--server", &server.url, "--token", &token], "").expect_success();
    assert!(
        !fs::read_to_string(&credentials_file)
            .expect("it can be read")
            .contains("fo_")
    );
}

#[test]
fn organiser_sign_in_needs_no_data_folder() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let home = scratch.path().join("config");
    // Runs the program as Grace, an organiser.
    let grace = |args: &[&str], input: &str| faceoff_with_home(&home, args, input);
    grace(&["admin", "teams", "--server", &server.url], "").expect_refusal(
        NOT_ALLOWED,
        &[
            "reading the operator's token from",
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
    grace(&join, "").expect_success();
    let output = grace(&["admin", "teams"], "").expect_success();
    assert!(output.contains("no team"), "{output}");
}

#[test]
fn submitted_folder_is_evaluated_and_dataset_downloaded() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let home = scratch.path().join("config");
    // Runs the program as Ada, a member of a team.
    let ada = |args: &[&str]| faceoff_with_home(&home, args, "");
    let link = team_invitation_link(&server);
    let founder = ["--name", "Ada", "--team", "Alpha", "--sign-in"];
    let join = join_args(&server, &link, &founder);
    ada(&join).expect_success();

    let bundle = scratch.path().join("my-agent");
    fs::create_dir_all(bundle.join("__pycache__")).expect("a folder can be made");
    let hold = repository().join("agents/hold");
    for file in ["agent.toml", "agent.py", "protocol.py"] {
        fs::copy(hold.join(file), bundle.join(file)).expect("a file can be copied");
    }
    fs::write(bundle.join("__pycache__/agent.pyc"), "x").expect("a file can be written");
    fs::write(bundle.join("notes.md"), "plans").expect("a file can be written");
    fs::write(bundle.join(".faceoffignore"), "notes.md\n").expect("a file can be written");
    let path_text = |path: &Path| path.to_str().expect("scratch paths are text").to_owned();

    let dry_run = ada(&["submit", &path_text(&bundle), "--dry-run", "--json"]).json();
    let files: Vec<_> = dry_run["files"]
        .as_array()
        .expect("a dry run lists the files")
        .iter()
        .map(|file| file["path"].clone())
        .collect();
    assert_eq!(
        files,
        ["agent.py", "agent.toml", "protocol.py"],
        "{dry_run:#}"
    );
    assert_eq!(
        dry_run["left_out"],
        serde_json::json!([".faceoffignore", "__pycache__", "notes.md"])
    );
    let output = ada(&["submit", &path_text(&bundle)]).expect_success();
    assert!(output.contains("valid: hold starts"), "{output}");
    let repeated = ada(&["submit", &path_text(&bundle), "--json"]).json();
    assert_eq!(repeated["state"], "valid", "{repeated:#}");
    let first = repeated["same_as"]
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
        .expect_refusal(FAILED, &["no submission, evaluation or game"]);
    let second = repeated["id"]
        .as_str()
        .expect("a submission has an id")
        .to_owned();
    let output = ada(&["withdraw", "latest"]).expect_success();
    assert!(
        output.contains("withdrawn") && output.contains(&second),
        "{output}"
    );
    // The two ids begin with the time of the upload, so their common beginning is a part of both.
    let equal_chars = first
        .chars()
        .zip(second.chars())
        .take_while(|(a, b)| a == b);
    let ambiguous = &first[..equal_chars.count()];
    ada(&["activate", ambiguous]).expect_refusal(FAILED, &["give more characters"]);
    ada(&["activate", &second]).expect_success();
    let board = ada(&["board", "--json"]).json();
    assert_eq!(board["rows"], serde_json::json!([]));
    assert!(
        ada(&["board", "hit"])
            .expect_success()
            .contains("no results yet")
    );
    let runtimes = ada(&["runtimes", "--json"]).json();
    assert_eq!(runtimes["network"], "none", "{runtimes:#}");
    let output = ada(&["runtimes"]).expect_success();
    assert!(
        output.contains("python3") && output.contains("glibc"),
        "{output}"
    );
    let season = ada(&["season", "--json"]).json();
    assert_eq!(season["closed_at"], Value::Null, "{season:#}");
    // The commitment is the published hash of the season's secret.
    assert!(ada(&["season"]).expect_success().contains("commitment "));
    assert_eq!(ada(&["health", "--json"]).json()["status"], "ok");
    assert!(
        ada(&["health"])
            .expect_success()
            .starts_with("ok, version ")
    );
    ada(&["board", "--division", "Open"]).expect_refusal(REFUSED, &["404"]);
    ada(&["board", "--stage", "Final"]).expect_refusal(FAILED, &["there is no stage"]);

    let day = start_day(&server);
    let evaluation = day["created"][0]["id"]
        .as_str()
        .expect("the active submission is evaluated")
        .to_owned();
    let credentials =
        fs::read_to_string(home.join("faceoff/credentials.toml")).expect("the login is stored");
    let token = credentials
        .split('"')
        .find(|word| word.starts_with(TOKEN_PREFIX))
        .expect("the token is in the file")
        .to_owned();
    let path = format!("/api/v1/evaluations/{evaluation}");
    let evaluated = server.poll(&path, &token, |answer: &Value| {
        !answer["released_at"].is_null()
    });
    assert_eq!(evaluated["state"], "finished", "{evaluated:#}");
    let output = ada(&["status"]).expect_success();
    assert!(
        output.contains("last evaluations:")
            && output.contains(&evaluation)
            && output.contains("finished: score"),
        "{output}"
    );
    let board = ada(&["board", "--csv"]).expect_success();
    assert!(
        board
            .lines()
            .nth(1)
            .is_some_and(|row| row.starts_with("1,") && row.contains(",Alpha,")),
        "{board}"
    );
    assert!(ada(&["board"]).expect_success().contains("Alpha"));

    // The evaluation is found by `latest`, by the end of its id, and by team and date.
    let date = evaluated["day"].as_str().expect("a day has a date");
    let end = &evaluation[28..];
    let quoted = format!("alpha {date}");
    for name in [&["latest"] as &[&str], &[end], &["Alpha", date], &[&quoted]] {
        let args = [&["evaluation", "--json"], name].concat();
        assert_eq!(ada(&args).json()["id"], evaluation.as_str(), "{name:?}");
    }
    assert_eq!(ada(&["log", "latest", "--json"]).json()["of"], "evaluation");
    ada(&["evaluation", "Beta", date])
        .expect_refusal(FAILED, &["Beta", "these teams have one: Alpha"]);
    ada(&["evaluation", "Alpha", "2001-01-01"])
        .expect_refusal(FAILED, &["no results of 2001-01-01 are public"]);
    ada(&["evaluation", "soon"]).expect_refusal(FAILED, &["`latest`, or a team and a day"]);
    // A visitor finds the evaluation on the board, but may see it only after its publication.
    let visitor = scratch.path().join("visitor");
    let by_day = ["evaluation", "Alpha", date, "--server", &server.url];
    faceoff_with_home(&visitor, &by_day, "")
        .expect_refusal(NOT_ALLOWED, &["no such public evaluation"]);

    let dataset_file = scratch.path().join("dataset.zip");
    let download = [
        "dataset",
        "download",
        &evaluation,
        "--out",
        &path_text(&dataset_file),
        "--json",
    ];
    let downloaded = ada(&download).json();
    assert_eq!(downloaded["checked"], true, "{downloaded:#}");
    assert_eq!(downloaded["blake3"], evaluated["dataset_blake3"]);
    ada(&[
        "verify",
        &path_text(&dataset_file),
        "--blake3",
        downloaded["blake3"].as_str().expect("a hash is text"),
    ])
    .expect_success();
    // An evaluation is compared with itself: the number of episodes in each list equals the count.
    let compare = [
        "compare",
        &evaluation,
        &evaluation,
        "--server",
        &server.url,
        "--episodes",
        "--json",
    ];
    let compared = ada(&compare).json();
    for (task, counts) in compared["tasks"]
        .as_object()
        .expect("a comparison has tasks")
    {
        let lists = &compared["episodes"][task];
        for group in ["both", "only_a", "only_b", "neither"] {
            let listed = lists[group].as_array().expect("each group has a list");
            assert_eq!(counts[group], listed.len(), "{task}, {group}: {compared:#}");
        }
    }
    let link = ada(&["link", "dataset", &evaluation, "--json"]).json();
    let url = link["url"].as_str().expect("a link has an address");
    let public_download = http()
        .build()
        .expect("an HTTP client can be made")
        .get(url)
        .send();
    let public_download = public_download
        .expect("the server answers")
        .bytes()
        .expect("the download completes");
    assert_eq!(
        public_download,
        fs::read(&dataset_file).expect("it is there")
    );
    // A partial file with other contents is replaced.
    fs::write(scratch.path().join("dataset.zip.part"), "something else")
        .expect("a file can be written");
    assert_eq!(ada(&download).json()["blake3"], downloaded["blake3"]);
}

#[test]
fn proxy_of_the_environment_is_used_for_other_machines() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    // It passes the requests on, which have the form for proxies.
    let proxy = Relay::start();
    let address = server.url.strip_prefix("http://").expect("it has no TLS");
    proxy.set_target(address.parse().expect("it is an address"));
    let health = |url: &str, proxy: &str| {
        Command::new(program("faceoff"))
            .args(["health", "--server", url])
            .env("http_proxy", proxy)
            .env("no_proxy", "")
            .env("XDG_CONFIG_HOME", scratch.path())
            .output()
            .expect("the program can be started")
    };
    // The name is known to the proxy only.
    let answered = health(
        "http://faceoff.test",
        &format!("http://{}", proxy.address()),
    );
    assert!(
        answered.status.success(),
        "{}",
        String::from_utf8_lossy(&answered.stderr)
    );
    let unused = health(&server.url, "http://127.0.0.1:9");
    assert!(unused.status.success(), "this machine needs no proxy");
}

#[test]
fn status_watch_prints_each_change() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let team = Team::create(&server, "Alpha");
    let submission = team.submit(&server, &repository().join("agents/hold"));
    let id = submission["id"].as_str().expect("a submission has an id");
    let options = ["--server", &server.url, "--token", &team.token];
    let mut watching = Command::new(program("faceoff"))
        .args(["status", "--watch", "--json"])
        .args(options)
        .env("XDG_CONFIG_HOME", scratch.path())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the program can be started");
    let output = BufReader::new(watching.stdout.take().expect("standard output is piped"));
    let mut states = output.lines().map(|line| -> Value {
        let line = line.expect("it runs until it is killed");
        serde_json::from_str(&line).expect("each line is JSON")
    });
    let first = states.next().expect("it prints the team's state first");
    assert_eq!(first["me"]["active_submission"], id, "{first:#}");
    faceoff_with_home(
        scratch.path(),
        &[&["withdraw", id][..], &options].concat(),
        "",
    )
    .expect_success();
    let changed = states.find(|state| state["me"]["active_submission"].is_null());
    assert!(changed.is_some(), "a change is printed");
    watching.kill().expect("a child can be killed");
    watching.wait().expect("a child can be reaped");
}
