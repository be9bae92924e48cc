//! The front page in a real browser: what a visitor who has never heard of the competition sees, and what moves.

use crate::{evaluate_bundle, replay::PREFERS_REDUCED_MOTION, shared_folder::start_prepared};
use faceoff_tests::{
    browser::{Browser, Page, View},
    bundle,
    server::Server,
};
use std::path::Path;

/// Starts a server and waits for a public evaluation of an agent that succeeds in most episodes, whatever the season's secret is.
/// Returns the server and the path of the evaluation's page.
fn evaluated_striker(scratch: &Path) -> (Server, String) {
    start_prepared("evaluated-striker", scratch, |server, scratch| {
        let agent = bundle::example_agent("striker", scratch);
        evaluate_bundle(server, &agent).replace("/api/v1", "")
    })
}

/// JavaScript: does the drawing of an episode on the front page move?
const IS_MOVING: &str = "!document.querySelector('[data-highlight] svg').animationsPaused()";

fn click(page: &Page, selector: &str) {
    let _ = page.evaluate(&format!("document.querySelector({selector:?}).click()"));
}

#[test]
fn front_page_says_what_it_is_and_who_leads() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, evaluation) = evaluated_striker(scratch.path());
    let browser = Browser::start(scratch.path());
    let page = browser.open(&format!("{}/", server.url));
    assert!(page.text(".summary").contains("play air hockey"));
    assert!(page.text(".leader").starts_with("Alpha leads with "));
    assert_eq!(page.text(".actions a:last-child"), "Rules");
    let tasks = page.text(".task-cards");
    assert!(
        tasks.contains("goalkeeper") && tasks.contains("% of the score"),
        "{tasks}"
    );
    // The picture leads to the replay of a success of the leader.
    let replay = page.evaluate("document.querySelector('[data-highlight] a').getAttribute('href')");
    let replay = replay.as_str().expect("the picture is a link");
    assert!(replay.starts_with(&evaluation), "{replay}");
    page.wait_until(IS_MOVING);
    let x = "document.querySelector('[data-highlight] circle.puck').cx.animVal.value";
    let start = page.evaluate(x);
    page.wait_until(&format!("{x} != {start}"));
    click(&page, "[data-highlight-pause]");
    assert_eq!(page.evaluate(IS_MOVING), false);
    assert_eq!(page.text("[data-highlight-pause]"), "Play");
    page.go_to(&format!("{}{replay}", server.url));
    assert_eq!(page.text(".verdict strong").chars().next(), Some('✓'));
}

#[test]
fn front_page_stays_still_for_reduced_motion() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, _) = evaluated_striker(scratch.path());
    let browser = Browser::start(scratch.path());
    let page = browser.open(&format!("{}/season", server.url));
    page.before_scripts(PREFERS_REDUCED_MOTION);
    page.go_to(&format!("{}/", server.url));
    page.wait_for("[data-highlight-pause]:not([hidden])");
    assert_eq!(page.evaluate(IS_MOVING), false);
    click(&page, "[data-highlight-pause]");
    page.wait_until(IS_MOVING);
}

#[test]
fn board_column_heading_opens_its_explanation() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, _) = evaluated_striker(scratch.path());
    let browser = Browser::start(scratch.path());
    let page = browser.open(&format!("{}/", server.url));
    let is_shown = "document.querySelector('#about-points').checkVisibility()";
    assert_eq!(page.evaluate(is_shown), false);
    click(&page, "[popovertarget=about-points]");
    assert_eq!(page.evaluate(is_shown), true);
    assert!(
        page.text("#about-points")
            .contains("endanger the real robot")
    );
    click(&page, "[popovertarget=about-points]");
    assert_eq!(page.evaluate(is_shown), false);
}

#[test]
fn board_of_a_task_needs_no_sideways_scrolling() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, _) = evaluated_striker(scratch.path());
    let browser = Browser::start(scratch.path());
    let page = browser.open(&format!("{}/tasks/defend", server.url));
    // The longest name and large numbers.
    let _ = page.evaluate(
        "(() => {
            const text = (selector, text) => document.querySelectorAll(selector).forEach(found => { found.textContent = text; });
            text('.board .team > a', 'Donaudampfschifffahrtsgesellschafts Team');
            text('.board .small', '1000');
            text('.board .points .figure', '1000.5');
        })()",
    );
    for width in [320, 600, 896, 897, 960, 1024, 1100, 1150, 1216, 1280, 1440] {
        page.set_view(View {
            width,
            ..View::DESKTOP
        });
        let excess = page.evaluate(
            "(board => board.scrollWidth - board.clientWidth)(document.querySelector('.board.task').parentElement)",
        );
        assert_eq!(excess, 0, "{width}");
        assert_eq!(page.overflow(), 0, "{width}");
    }
}
