//! A round of a tournament as a visitor follows it in a real browser, and as one who wants to watch it later.

use crate::{
    CONFIG, Team,
    axe::{axe, faults},
    commands::admin,
};
use faceoff_tests::{
    browser::{Browser, Page, View},
    repository,
    server::Server,
};
use serde_json::{Value, json};

/// Words that nothing but a page that was never loaded again still has.
fn mark(page: &Page) {
    assert_eq!(page.evaluate("window.kept = true"), true);
}

#[test]
fn a_round_is_followed_without_being_loaded_again_and_its_results_can_be_hidden() {
    let axe = axe();
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    for name in ["Ada", "Bob"] {
        let team = Team::create(&server, name);
        let submission = team.submit(&server, &repository().join("agents/hold"));
        assert_eq!(submission["state"], "valid", "{submission:#}");
    }
    let rules = [
        "--format",
        "round-robin",
        "--rounds",
        "1",
        "--steps",
        "1500",
    ];
    let open = ["tournament", "open", "Cup", "--teams", "Ada,Bob", "--json"];
    let cup = admin(&server, &[&open[..], &rules].concat()).json();
    let cup = cup["id"].as_str().expect("a tournament has an id");
    let browser = Browser::start(scratch.path());
    let tournament = browser.open(&format!("{}/tournaments/{cup}", server.url));
    mark(&tournament);

    // Nothing begins before it is looked at.
    let pause = json!({ "reason": "Until all are there" });
    let paused = server.post("/api/v1/queue/pause", &server.admin_token, &pause);
    assert!(paused.status().is_success(), "{}", paused.status());
    admin(&server, &["tournament", "start-round", "Cup"]).done();
    tournament.wait_for("[data-live-region=schedule] a[href^='/games/']");
    let game = tournament.evaluate(
        "document.querySelector('[data-live-region=schedule] a[href^=\"/games/\"]').pathname",
    );
    let game = game.as_str().expect("a path is text");
    let watched = browser.open(&format!("{}{game}", server.url));
    let later = browser.open(&format!("{}{game}", server.url));
    later.leave_by("document.querySelector('form.spoilers').requestSubmit()");
    let resumed = server.post("/api/v1/queue/resume", &server.admin_token, &json!({}));
    assert!(resumed.status().is_success(), "{}", resumed.status());

    tournament.wait_until(
        "document.querySelector('[data-live-region=schedule]').textContent.includes('1 of 1 games')",
    );
    assert_eq!(tournament.evaluate("window.kept"), true);
    // Of a game that is over its page is another, with the replay.
    watched.wait_for("#result");

    // What it came to is on the pages of who wants to know, and nowhere on those of who does not.
    let told: Value = server
        .get(&format!("/api/v1{game}"), None)
        .json()
        .expect("the API speaks JSON");
    let because = told["result"]["because"]
        .as_str()
        .expect("somebody won, or nobody");
    watched.go(&format!("{}{game}", server.url));
    assert!(watched.html().contains(because), "{because:?}");
    for path in [
        game.to_owned(),
        format!("/tournaments/{cup}"),
        "/tournaments".to_owned(),
    ] {
        later.go(&format!("{}{path}", server.url));
        let html = later.html();
        assert!(!html.contains(because), "{path}: {html}");
        assert!(later.text("main").contains("hidden"), "{path}");
    }
    later.go(&format!("{}{game}?show=result", server.url));
    assert!(later.html().contains(because), "this one alone is shown");

    let two = tournament.evaluate(
        "document.querySelector('a[href*=\"/teams/\"][href^=\"/tournaments/\"]').pathname",
    );
    let two = two.as_str().expect("a path is text").to_owned();
    let mut broken = Vec::new();
    for (page, path) in [
        (&tournament, "/tournaments".to_owned()),
        (&tournament, format!("/tournaments/{cup}")),
        (&tournament, two.clone()),
        (&later, two),
        (&later, format!("/tournaments/{cup}")),
        (&watched, game.to_owned()),
        (&later, game.to_owned()),
    ] {
        page.look_through(View::DESK);
        page.go(&format!("{}{path}", server.url));
        page.wait_until(
            "[...document.querySelectorAll('.replay')].every(replay => replay.dataset.state == 'ready')",
        );
        broken.extend(faults(page, &axe, &path));
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}
