//! Pages of a tournament round in a real browser: live updates, and hidden results for visitors who avoid spoilers.

use crate::{
    CONFIG,
    axe::{axe_script, page_defects},
    commands::admin,
    dashboards::{InvitedUser, sign_in},
    tournament::{OPEN_CUP, create_teams_with_hold},
};
use faceoff_tests::{
    browser::{Browser, Page, View},
    server::Server,
};
use serde_json::{Value, json};

/// Sets a mark that the page loses when it is reloaded.
fn mark(page: &Page) {
    assert_eq!(page.evaluate("window.isMarked = true"), true);
}

#[test]
fn round_pages_update_live_and_can_hide_results() {
    // axe-core finds violations of accessibility rules.
    let axe = axe_script();
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    create_teams_with_hold(&server, &["Ada", "Bob"]);
    let cup = admin(&server, &OPEN_CUP).json();
    let cup = cup["id"].as_str().expect("a tournament has an id");
    let browser = Browser::start(scratch.path());
    let tournament = browser.open(&format!("{}/tournaments/{cup}", server.url));
    mark(&tournament);

    // No game starts until the pages are open.
    let pause = json!({ "reason": "Until the pages are open" });
    let paused = server.post("/api/v1/queue/pause", &server.admin_token, &pause);
    assert!(paused.status().is_success(), "{}", paused.status());
    admin(&server, &["tournament", "start-round", "Cup"]).expect_success();
    tournament.wait_for("[data-live-region=schedule] a[href^='/games/']");
    let game = tournament.evaluate(
        "document.querySelector('[data-live-region=schedule] a[href^=\"/games/\"]').pathname",
    );
    let game = game.as_str().expect("a path is text");
    let watched = browser.open(&format!("{}{game}", server.url));
    let spoiler_free = browser.open(&format!("{}{game}", server.url));
    spoiler_free.navigate_by("document.querySelector('form.spoilers').requestSubmit()");
    let resumed = server.post("/api/v1/queue/resume", &server.admin_token, &json!({}));
    assert!(resumed.status().is_success(), "{}", resumed.status());

    tournament.wait_until(
        "document.querySelector('[data-live-region=schedule]').textContent.includes('1 of 1 games')",
    );
    assert_eq!(tournament.evaluate("window.isMarked"), true);
    // The page of a finished game shows the result and the replay.
    watched.wait_for("#result");

    // The result is on the first visitor's pages, and on no page of the visitor who hides results.
    let view: Value = server
        .get(&format!("/api/v1{game}"), None)
        .json()
        .expect("the API speaks JSON");
    // The text with the reason of the result is on every page that shows the result.
    let because = view["result"]["because"]
        .as_str()
        .expect("a finished game has a reason for its result");
    watched.go_to(&format!("{}{game}", server.url));
    assert!(watched.html().contains(because), "{because:?}");
    for path in [
        game.to_owned(),
        format!("/tournaments/{cup}"),
        "/tournaments".to_owned(),
    ] {
        spoiler_free.go_to(&format!("{}{path}", server.url));
        let html = spoiler_free.html();
        assert!(!html.contains(because), "{path}: {html}");
        assert!(spoiler_free.text("main").contains("hidden"), "{path}");
    }
    spoiler_free.go_to(&format!("{}{game}?show=result", server.url));
    assert!(
        spoiler_free.html().contains(because),
        "this result alone is shown"
    );

    // The page of a pair of teams.
    let pair_path = tournament.evaluate(
        "document.querySelector('a[href*=\"/teams/\"][href^=\"/tournaments/\"]').pathname",
    );
    let pair_path = pair_path.as_str().expect("a path is text").to_owned();
    let mut found = Vec::new();
    for (page, path) in [
        (&tournament, "/tournaments".to_owned()),
        (&tournament, format!("/tournaments/{cup}")),
        (&tournament, pair_path.clone()),
        (&spoiler_free, pair_path),
        (&spoiler_free, format!("/tournaments/{cup}")),
        (&watched, game.to_owned()),
        (&spoiler_free, game.to_owned()),
    ] {
        page.set_view(View::DESKTOP);
        page.go_to(&format!("{}{path}", server.url));
        page.wait_until(
            "[...document.querySelectorAll('section.replay')].every(replay => replay.dataset.state == 'ready')",
        );
        found.extend(page_defects(page, &axe, &path));
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn organiser_opens_and_starts_a_tournament_by_forms() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    create_teams_with_hold(&server, &["Ada", "Bob"]);
    let browser = Browser::start(scratch.path());
    let grace = sign_in(&browser, &server, InvitedUser::organiser("Grace"));
    grace.go_to(&format!("{}/organiser", server.url));
    grace.navigate_by("document.querySelector('.tabs a[href=\"/organiser/tournaments\"]').click()");
    assert_eq!(grace.text("h1"), "Tournaments");
    let fields = [("name", "Cup"), ("teams", "Ada\nBob"), ("rounds", "1")];
    grace.send_form("form[action='/organiser/tournaments']", &fields);
    assert_eq!(grace.text("h1"), "Cup");
    assert!(grace.text(".done").contains("The tournament is open"));
    grace.navigate_by("document.querySelector('.primary-action').click()");
    assert_eq!(grace.text("h1"), "Start round 1 of Cup");
    grace.send_form("main form", &[]);
    assert!(grace.text(".done").contains("The round has started"));
    assert!(grace.text(".facts").contains("round in progress"));
    let tournaments: Value = server
        .get("/api/v1/tournaments", None)
        .json()
        .expect("the API speaks JSON");
    assert_eq!(tournaments[0]["phase"], "round", "{tournaments}");
    assert_eq!(grace.console_errors(), Vec::<String>::new());
}
