//! Accessibility of the public pages and of both dashboards (signed-in start pages of teams and organisers): the library
//! axe-core reports no violation, no page is wider than its window, and no script fails.

use crate::{
    axe::{axe_script, page_defects},
    commands::admin,
    dashboards::{InvitedUser, sign_in},
    replay::released_evaluation,
};
use faceoff_tests::{
    browser::{Browser, Page, View},
    server::Server,
};
use serde_json::{Value, json};

/// Opens a page, waits until its replays are loaded, and returns its defects.
fn check_page(page: &Page, server: &Server, axe_script: &str, path: &str) -> Vec<String> {
    page.set_view(View::DESKTOP);
    page.go_to(&format!("{}{path}", server.url));
    let has_heading = page.evaluate("document.querySelector('h1') !== null");
    assert_eq!(has_heading, true, "{path} has a heading");
    page.wait_until(
        "[...document.querySelectorAll('section.replay')].every(replay => replay.dataset.state == 'ready')",
    );
    page_defects(page, axe_script, path)
}

#[test]
fn public_pages_follow_accessibility_rules() {
    let axe_script = axe_script();
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, evaluation_page) = released_evaluation(scratch.path());
    let browser = Browser::start(scratch.path());
    let board: Value = server
        .get("/api/v1/board", None)
        .json()
        .expect("the API speaks JSON");
    let team = board["rows"][0]["team_id"].as_str();
    let team = format!("/teams/{}", team.expect("a row names its team"));
    let episodes = format!("{evaluation_page}/episodes");
    let replay = format!("{evaluation_page}/episodes/defend/0");
    let embedded = format!("{replay}/embed");
    let mut all_defects = Vec::new();
    let page = browser.open(&format!("{}/", server.url));
    for path in [
        "/",
        "/tasks/defend",
        &team,
        &evaluation_page,
        &episodes,
        &replay,
        &embedded,
        "/season",
        "/announcements",
        "/help",
        "/problems",
        "/docs",
        "/docs/rules",
        "/docs/start",
        "/docs/configuration",
        "/docs/search?q=tournamant",
        "/docs/api-reference",
        "/docs/api-reference/public",
        "/docs/api-reference/schemas",
        "/sign-in",
        "/register",
    ] {
        all_defects.extend(check_page(&page, &server, &axe_script, path));
    }
    assert!(all_defects.is_empty(), "{}", all_defects.join("\n"));
}

#[test]
fn dashboards_follow_accessibility_rules() {
    let axe_script = axe_script();
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, evaluation_page) = released_evaluation(scratch.path());
    let id = evaluation_page
        .rsplit('/')
        .next()
        .expect("the path ends with the id");
    let evaluation: Value = server
        .get(
            &format!("/api/v1/evaluations/{id}"),
            Some(&server.admin_token),
        )
        .json()
        .expect("the API speaks JSON");
    let field = |name: &str| {
        evaluation[name]
            .as_str()
            .expect("an evaluation has this field")
            .to_owned()
    };
    let (team, submission) = (field("team"), field("submission"));
    let announced = server.post(
        "/api/v1/announcements",
        &server.admin_token,
        &json!({ "title": "Hello", "text": "The season has begun." }),
    );
    assert_eq!(announced.status(), 201);
    // An ablation evaluates a submission with each perturbation of the simulation alone.
    admin(&server, &["order-ablation", &submission, "--episodes", "1"]).expect_success();
    let browser = Browser::start(scratch.path());
    let mut all_defects = Vec::new();
    let member = sign_in(&browser, &server, InvitedUser::member("Ada", &team));
    for path in [
        "/dashboard",
        &format!("/dashboard/submissions/{submission}"),
        "/dashboard/questions",
        "/dashboard/access",
        "/dashboard/settings",
        "/account",
    ] {
        all_defects.extend(check_page(&member, &server, &axe_script, path));
    }
    let organiser = sign_in(&browser, &server, InvitedUser::organiser("Grace"));
    let cup = server.post(
        "/api/v1/tournaments",
        &server.admin_token,
        &json!({ "name": "Cup", "teams": ["Alpha"] }),
    );
    let cup: Value = cup.json().expect("the API speaks JSON");
    let cup = cup["id"].as_str().expect("a tournament has an id");
    let stage = evaluation["stage"]
        .as_str()
        .expect("an evaluation has a stage");
    for path in [
        "/organiser",
        "/organiser/day",
        "/organiser/teams",
        "/organiser/stages",
        &format!("/organiser/stages/{stage}"),
        "/organiser/tournaments",
        &format!("/organiser/tournaments/{cup}"),
        &format!("/organiser/decide/start-round/{cup}/1"),
        "/organiser/messages",
        "/organiser/storage",
        "/organiser/workers",
        "/organiser/access",
        "/organiser/log",
        "/organiser/decide/pause",
        &format!("/organiser/decide/void/{id}"),
        &format!("/submissions/{submission}/ablation"),
    ] {
        all_defects.extend(check_page(&organiser, &server, &axe_script, path));
    }
    assert!(all_defects.is_empty(), "{}", all_defects.join("\n"));
}
