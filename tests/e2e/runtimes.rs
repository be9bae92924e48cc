//! A stage that takes agents of one runtime only, from the organiser's command to the team's verdict.

use crate::{
    CONFIG, Team,
    commands::{MISUSED, REFUSED, admin, faceoff, member},
};
use faceoff_tests::{
    bundle::{python_agent, python_bundle, reference},
    server::Server,
};
use serde_json::json;

#[test]
fn a_stage_refuses_what_is_not_of_its_runtimes_and_says_which_they_are() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let change = |runtimes: &str| {
        let args = [
            "stage",
            "change",
            "Qualifying",
            "--confirm",
            "Qualifying",
            "--runtimes",
        ];
        admin(&server, &[&args[..], &[runtimes]].concat())
    };
    change("julia").not_done(
        REFUSED,
        &["runtimes: expected some of", "native", "\"julia\""],
    );
    change("../x").not_done(REFUSED, &["runtimes", "dots, dashes"]);
    change("").not_done(REFUSED, &["runtimes"]);
    let args = ["stage", "change", "Qualifying", "--runtimes"];
    admin(&server, &args).not_done(MISUSED, &["--runtimes"]);
    let unconfirmed = admin(&server, &[&args[..], &["native"]].concat());
    unconfirmed.not_done(REFUSED, &["other rules begin revision 2", "“confirm”"]);

    let team = Team::create(&server, "Alpha");
    let python = python_bundle(scratch.path(), "python", &python_agent("say(hold)"));
    let first = team.submit(&server, &python);
    assert_eq!(
        (&first["state"], &first["runtime"]),
        (&json!("valid"), &json!("python3"))
    );
    let told = change("native").done();
    assert!(
        told.contains("agents   of the runtime native only"),
        "{told}"
    );

    let refused = team.submit(&server, &python);
    assert_eq!(refused["state"], "invalid", "{refused:#}");
    let reason = refused["reason"].as_str().expect("a refusal has a reason");
    for words in ["“Qualifying”", "native only", "names python3 in agent.toml"] {
        assert!(reason.contains(words), "{reason}");
    }
    assert_eq!(refused["timing"], json!(null), "it was not started");
    // What was valid before may be active, and is told that it does not play.
    let id = first["id"].as_str().expect("a submission has an id");
    let active = member(&server, &team.token, "activate", &[id]).done();
    assert!(
        active.contains("does not play at the next cut") && active.contains("native only"),
        "{active}"
    );
    let status = [
        "submissions",
        "status",
        "--server",
        &server.url,
        "--token",
        &team.token,
    ];
    let status = faceoff(&status, "").done();
    assert!(status.contains("does not play at the next cut"), "{status}");
    admin(&server, &["start-day"]).not_done(REFUSED, &["that the stage takes"]);
    let native = team.submit(&server, &reference("striker", scratch.path()));
    assert_eq!(
        (&native["state"], &native["runtime"]),
        (&json!("valid"), &json!("native"))
    );
    let told = change("all").done();
    assert!(!told.contains("runtime"), "{told}");
}
