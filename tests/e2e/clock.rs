//! A system clock that is set while the server runs, or while it does not. After such a *step* the server's time goes on as before.
//! The server reports the step until the clock is right again or an organiser accepts it.

use crate::{CONFIG, Team, start_day};
use faceoff_tests::{
    bundle::{python_agent, python_bundle},
    faketime::SystemClock,
    program,
    server::Server,
};
use serde_json::{Value, json};
use std::{fs, path::Path, process::Command};

fn submit_valid(server: &Server, team: &Team, folder: &Path, name: &str) -> Value {
    let source = format!("# {name}\n{}", python_agent("say(hold)"));
    let submission = team.submit(server, &python_bundle(folder, name, &source));
    assert_eq!(submission["state"], "valid", "{submission:#}");
    submission
}

/// Asserts that the server reports a clock that was set, and returns the description.
fn health_problem(server: &Server) -> String {
    let health = server.get("/api/v1/health", None);
    assert_eq!(health.status(), 503);
    let problem: Value = health.json().expect("the API speaks JSON");
    assert_eq!(problem["clock"], "set", "{problem:#}");
    problem["detail"].as_str().expect("a detail").to_owned()
}

fn assert_healthy(server: &Server) {
    assert_eq!(server.get("/api/v1/health", None).status(), 200);
}

#[test]
fn running_server_continues_its_time_after_a_step() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (data, clock) = (
        scratch.path().join("data"),
        SystemClock::new(scratch.path()),
    );
    let server = Server::start_with_environment(&data, CONFIG, &clock.environment());
    let team = Team::create(&server, "Alpha");
    assert_healthy(&server);

    // Five days are 432000 s.
    clock.set(5 * 86_400);
    server.wait_for_log("432000 s ahead", 1);
    assert!(health_problem(&server).contains("432000 s ahead"));
    let submission = submit_valid(&server, &team, scratch.path(), "ahead");

    clock.set(-86_400);
    server.wait_for_log("86400 s behind", 1);
    let evaluation = crate::evaluation_path(&start_day(&server), &submission);
    let done = team.wait_until_finished(&server, &evaluation);
    assert_eq!(done["state"], "finished", "{done:#}");
    let log = server.log();
    assert!(!log.contains("lease lost"), "{log}");

    // A restart does not hide the step.
    server.kill();
    let server = Server::start_with_environment(&data, CONFIG, &clock.environment());
    assert!(health_problem(&server).contains("86400 s behind"));
    clock.set(0);
    server.wait_for_log("agree again", 1);
    assert_healthy(&server);
}

/// The newest change is the newest event in the database. Its time shows that the clock is wrong, even after a restart of the machine.
#[test]
fn server_starts_with_a_clock_before_the_newest_change() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (data, clock) = (
        scratch.path().join("data"),
        SystemClock::new(scratch.path()),
    );
    let server = Server::start(&data, CONFIG);
    let team = Team::create(&server, "Alpha");
    let pause = server.post(
        "/api/v1/queue/pause",
        &server.admin_token,
        &json!({ "reason": "a test" }),
    );
    assert_eq!(pause.status(), 204);
    let bundle = python_bundle(scratch.path(), "a", &python_agent("say(hold)"));
    let bundle = faceoff_tests::bundle::pack(&bundle);
    let id = team.upload(&server, bundle);
    server.kill();
    // The file has the readings of the monotonic clock, which mean nothing after a restart of the machine. Removing it imitates one.
    fs::remove_file(data.join("clock.json")).expect("the server has recorded its clock");
    clock.set(-86_400);
    let server = Server::start_with_environment(&data, CONFIG, &clock.environment());
    server.wait_for_log("No evaluation day starts", 1);
    assert!(health_problem(&server).contains("newest change"));
    // The validation run was queued at a time that is now in the future. It runs nevertheless.
    let resume = server.post("/api/v1/queue/resume", &server.admin_token, &json!({}));
    assert_eq!(resume.status(), 204);
    assert_eq!(team.verdict(&server, &id)["state"], "valid");

    let accept = |options: &[&str]| {
        let mut command = Command::new(program("faceoff"));
        command
            .args(["admin", "accept-clock", "--server", &server.url])
            .args(["--token", &server.admin_token])
            .args(options);
        command.output().expect("the program can be started")
    };
    let preview = accept(&[]);
    assert!(!preview.status.success());
    let preview = String::from_utf8_lossy(&preview.stderr).into_owned();
    let step = preview
        .rsplit('"')
        .nth(1)
        .expect("it names the confirmation");
    assert!(step.ends_with(" s behind"), "{preview}");
    let accepted = accept(&["--confirm", step]);
    assert!(accepted.status.success(), "{accepted:?}");
    assert_healthy(&server);
}
