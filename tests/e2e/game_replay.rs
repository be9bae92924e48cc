//! The page that `faceoff replay` writes for a recorded game, in a real browser.

use crate::commands::faceoff;
use faceoff_tests::{browser::Browser, repository};
use serde_json::json;

/// The two robots hit no puck, so the game has a foul after 15 s.
#[test]
fn link_on_a_games_page_plays_from_two_seconds_before() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let path = |name: &str| scratch.path().join(name).display().to_string();
    let root = repository();
    let agent = |name: &str| root.join("agents").join(name).display().to_string();
    let config = root.join("tests/long_time_limits.toml");
    let (game, page) = (path("game"), path("look.html"));
    let play = [
        "play",
        &agent("hold"),
        &agent("reckless"),
        "--steps",
        "1000",
        "--out",
        &game,
        "--config",
        &config.display().to_string(),
    ];
    let _ = faceoff(&play, "").expect_success();
    let replay = ["replay", &game, "--out", &page, "--json"];
    let summary = faceoff(&replay, "").expect_success();
    let summary: serde_json::Value = serde_json::from_str(&summary).expect("it is JSON");
    let events = summary["events"].as_array().expect("a list");
    let foul = events.iter().find(|event| event["event"] == "foul");
    let foul_step = foul.expect("there is a foul")["game_step"].as_u64();
    // 100 control steps are 2 s.
    let first_step = foul_step.expect("a number") - 100;

    let browser = Browser::start(scratch.path());
    let page = browser.open(&format!("file://{page}"));
    // The page shows the game's start, with both mallets in their halves.
    let shown = page.evaluate(
        "['step', 'mallet-1', 'mallet-2'].map(id => document.getElementById(id))
            .map((element, i) => i == 0 ? element.value : Math.sign(element.getAttribute('cx')))",
    );
    assert_eq!(shown, json!(["0", -1, 1]));
    let shown = page.evaluate(
        "(() => {
            document.querySelector('.events .foul a').click();
            return [Number(document.getElementById('step').value), document.getElementById('play').textContent];
        })()",
    );
    assert_eq!(shown, json!([first_step, "pause"]));
    page.wait_until(&format!(
        "Number(document.getElementById('step').value) > {first_step}"
    ));
    // The next rally begins with the sample after the foul.
    let shown = page.evaluate(
        "(() => {
            const rally = document.getElementById('rally');
            rally.selectedIndex = 1;
            rally.dispatchEvent(new Event('change'));
            return [Number(document.getElementById('step').value), document.getElementById('play').textContent];
        })()",
    );
    assert_eq!(shown, json!([first_step + 101, "play"]));
    assert_eq!(page.console_errors(), [""; 0]);
}
