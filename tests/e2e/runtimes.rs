//! A *stage* (a part of the season) that accepts agents of one *runtime* (an environment such as the interpreter `python3`) only:
//! from the organiser's command to the validation of a team's submission.

use crate::{
    CONFIG, Team,
    commands::{REFUSED, USAGE_ERROR, admin, faceoff, member},
};
use faceoff_tests::{
    bundle::{example_agent, python_agent, python_bundle},
    server::Server,
};
use serde_json::json;

#[test]
fn stage_refuses_other_runtimes_and_names_accepted_ones() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let set_runtimes = |runtimes: &str| {
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
    set_runtimes("julia").expect_refusal(
        REFUSED,
        &["runtimes: expected runtimes", "native", "\"julia\""],
    );
    set_runtimes("../x").expect_refusal(REFUSED, &["runtimes", "dots, dashes"]);
    set_runtimes("").expect_refusal(REFUSED, &["runtimes"]);
    let args = ["stage", "change", "Qualifying", "--runtimes"];
    admin(&server, &args).expect_refusal(USAGE_ERROR, &["--runtimes"]);
    let unconfirmed = admin(&server, &[&args[..], &["native"]].concat());
    unconfirmed.expect_refusal(REFUSED, &["new rules will begin revision 2", "“confirm”"]);

    let team = Team::create(&server, "Alpha");
    let python = python_bundle(scratch.path(), "python", &python_agent("say(hold)"));
    let python_submission = team.submit(&server, &python);
    assert_eq!(
        (&python_submission["state"], &python_submission["runtime"]),
        (&json!("valid"), &json!("python3"))
    );
    let output = set_runtimes("native").expect_success();
    assert!(output.contains("runtimes native only"), "{output}");

    let refused = team.submit(&server, &python);
    assert_eq!(refused["state"], "invalid", "{refused:#}");
    let reason = refused["reason"].as_str().expect("a refusal has a reason");
    for text in ["“Qualifying”", "native only", "names python3 in agent.toml"] {
        assert!(reason.contains(text), "{reason}");
    }
    assert_eq!(refused["timing"], json!(null), "the agent was not started");
    // A submission that was valid before can be active, but the command reports that the stage excludes it.
    let id = python_submission["id"]
        .as_str()
        .expect("a submission has an id");
    let active = member(&server, &team.token, "activate", &[id]).expect_success();
    assert!(
        active.contains("excluded from the next cutoff") && active.contains("native only"),
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
    let status = faceoff(&status, "").expect_success();
    assert!(status.contains("excluded from the next cutoff"), "{status}");
    admin(&server, &["start-day"]).expect_refusal(REFUSED, &["that the stage accepts"]);
    let native_submission = team.submit(&server, &example_agent("striker", scratch.path()));
    assert_eq!(
        (&native_submission["state"], &native_submission["runtime"]),
        (&json!("valid"), &json!("native"))
    );
    let output = set_runtimes("all").expect_success();
    assert!(!output.contains("runtime"), "{output}");
}
