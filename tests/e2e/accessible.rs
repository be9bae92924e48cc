//! Pages for everybody: axe finds nothing, nothing is wider than the window, and no script fails.

use crate::replay::released;
use faceoff_tests::{
    browser::{Browser, View},
    repository,
};
use serde_json::Value;
use std::fs;

/// Rules of WCAG 2.0 to 2.2, levels A and AA.
const RUN: &str = "axe.run(document, {
    runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa'],
    resultTypes: ['violations'],
}).then(found => found.violations.map(one => one.id + ': ' + one.nodes.map(node => node.html).join(' … ').slice(0, 400)))";

#[test]
fn no_page_breaks_a_rule_of_accessibility() {
    let axe = repository().join("web/client/node_modules/axe-core/axe.min.js");
    let axe = fs::read_to_string(&axe).unwrap_or_else(|error| {
        panic!(
            "{}: {error}; `web/client/build.sh test`, a part of `make test`, installs it",
            axe.display()
        )
    });
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
        "/nowhere",
    ] {
        for view in [View::DESK, View::PHONE.dark()] {
            let page = browser.open_in(view, &format!("{}{path}", server.url));
            if path.contains("/episodes/") {
                page.wait_for("#replay[data-state=ready]");
            }
            let _ = page.evaluate(&format!("{axe};1"));
            let found = page.evaluate(RUN);
            let found = found.as_array().expect("axe tells what it found");
            broken.extend(
                found
                    .iter()
                    .map(|one| format!("{path} {}: {one}", view.width)),
            );
            if page.overflow() != 0 {
                broken.push(format!("{path} is wider than {} pixels", view.width));
            }
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}
