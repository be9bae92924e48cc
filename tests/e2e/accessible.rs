//! Pages for everybody, and both desks: axe finds nothing, nothing is wider than the window, and no script fails.

use crate::{
    axe::{axe, faults},
    commands::admin,
    desks::{Person, signed_in},
    replay::released,
};
use faceoff_tests::{
    browser::{Browser, Page, View},
    server::Server,
};
use serde_json::{Value, json};

fn look(page: &Page, server: &Server, axe: &str, path: &str) -> Vec<String> {
    page.look_through(View::DESK);
    page.go(&format!("{}{path}", server.url));
    let is_there = page.evaluate("document.querySelector('h1') !== null");
    assert_eq!(is_there, true, "{path} has a heading");
    page.wait_until(
        "[...document.querySelectorAll('.replay')].every(replay => replay.dataset.state == 'ready')",
    );
    faults(page, axe, path)
}

#[test]
fn no_page_breaks_a_rule_of_accessibility() {
    let axe = axe();
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, evaluation) = released(scratch.path());
    let browser = Browser::start(scratch.path());
    let board: Value = server
        .get("/api/v1/board", None)
        .json()
        .expect("the API speaks JSON");
    let team = board["rows"][0]["team_id"].as_str();
    let team = format!("/teams/{}", team.expect("a row names its team"));
    let episodes = format!("{evaluation}/episodes");
    let replay = format!("{evaluation}/episodes/defend/0");
    let embedded = format!("{replay}/embed");
    let mut broken = Vec::new();
    let page = browser.open(&format!("{}/", server.url));
    for path in [
        "/",
        "/tasks/defend",
        &team,
        &evaluation,
        &episodes,
        &replay,
        &embedded,
        "/season",
        "/announcements",
        "/help",
        "/problems",
        "/docs",
        "/docs/rules",
        "/docs/api-reference",
        "/sign-in",
        "/register",
    ] {
        broken.extend(look(&page, &server, &axe, path));
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn no_page_of_a_desk_breaks_a_rule_of_accessibility() {
    let axe = axe();
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, evaluation) = released(scratch.path());
    let id = evaluation.rsplit('/').next().expect("a path has an end");
    let of: Value = server
        .get(
            &format!("/api/v1/evaluations/{id}"),
            Some(&server.admin_token),
        )
        .json()
        .expect("the API speaks JSON");
    let told = |name: &str| {
        of[name]
            .as_str()
            .expect("an evaluation names it")
            .to_owned()
    };
    let (team, submission) = (told("team"), told("submission"));
    let asked = server.post(
        "/api/v1/announcements",
        &server.admin_token,
        &json!({ "title": "Hello", "text": "The season has begun." }),
    );
    assert_eq!(asked.status(), 201);
    admin(&server, &["order-ablation", &submission, "--episodes", "1"]).done();
    let browser = Browser::start(scratch.path());
    let mut broken = Vec::new();
    let member = signed_in(&browser, &server, Person::member("Ada", &team));
    for path in [
        "/desk",
        &format!("/desk/submissions/{submission}"),
        "/desk/questions",
        "/desk/access",
        "/account",
    ] {
        broken.extend(look(&member, &server, &axe, path));
    }
    let organiser = signed_in(&browser, &server, Person::organiser("Grace"));
    let stage = of["stage"].as_str().expect("an evaluation is of a stage");
    for path in [
        "/organiser",
        "/organiser/day",
        "/organiser/teams",
        "/organiser/stages",
        &format!("/organiser/stages/{stage}"),
        "/organiser/messages",
        "/organiser/storage",
        "/organiser/workers",
        "/organiser/access",
        "/organiser/log",
        "/organiser/decide/pause",
        &format!("/organiser/decide/void/{id}"),
        &format!("/submissions/{submission}/ablation"),
    ] {
        broken.extend(look(&organiser, &server, &axe, path));
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}
