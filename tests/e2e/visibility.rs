//! Visibility of a team's data (dataset, submission), and the errors of refused requests: of other callers, and for invalid uploads.

use crate::{CONFIG, Team};
use faceoff_tests::{repository, server::Server};
use serde_json::Value;

/// Asserts that the response is a problem document (RFC 9457) with this status and all fields that clients show.
fn assert_problem(answer: reqwest::blocking::Response, status: u16) {
    assert_eq!(answer.status(), status);
    assert_eq!(
        answer.headers()["content-type"],
        "application/problem+json",
        "errors are problem documents"
    );
    let problem: Value = answer.json().expect("a problem is JSON");
    assert_eq!(problem["status"], status);
    for field in ["type", "title", "detail"] {
        assert!(
            problem[field].as_str().is_some_and(|text| !text.is_empty()),
            "a problem has {field}: {problem:#}"
        );
    }
}

#[test]
fn dataset_and_submission_are_visible_to_their_team_only() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let owner = Team::create(&server, "Owner");
    let other = Team::create(&server, "Other");
    let submission = owner.submit(&server, &repository().join("agents/hold"));
    assert_eq!(submission["state"], "valid", "{submission:#}");
    let evaluation = owner.evaluate(&server, &submission);
    let done = owner.wait_until_finished(&server, &evaluation);
    assert_eq!(done["state"], "finished", "{done:#}");

    let dataset = format!("{evaluation}/dataset");
    assert_eq!(server.get(&dataset, Some(&owner.token)).status(), 200);
    assert_problem(server.get(&dataset, Some(&other.token)), 404);
    assert_problem(server.get(&dataset, Some("fo_team_wrong")), 401);
    assert_problem(server.get(&dataset, None), 401);
    let path = format!(
        "/api/v1/submissions/{}",
        submission["id"].as_str().expect("a submission has an id")
    );
    assert_problem(server.get(&path, Some(&other.token)), 404);

    // An id in an invalid form, and an id that no evaluation has.
    assert_problem(
        server.get("/api/v1/evaluations/seventeen", Some(&owner.token)),
        404,
    );
    assert_problem(
        server.get(
            "/api/v1/evaluations/01890000-0000-7000-8000-000000000000",
            Some(&owner.token),
        ),
        404,
    );
}

#[test]
fn oversized_and_non_archive_uploads_are_refused() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let config = format!("{CONFIG}\n[bundle]\npacked_bytes = 4096\n");
    let server = Server::start(&scratch.path().join("data"), &config);
    let team = Team::create(&server, "Big");
    // Bundles begin with these bytes of a gzip archive.
    let mut large = vec![0x1f, 0x8b];
    large.resize(5000, 0);
    assert_problem(server.upload(&team.token, large), 413);
    assert_problem(server.upload(&team.token, b"just text".to_vec()), 415);
}
