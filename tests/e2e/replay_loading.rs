//! How a replay's page appears in a real browser: with the still picture at once, and without moving what is already shown.

use crate::compared_replays::compared_evaluations;
use faceoff_tests::browser::{Browser, Page, View};

/// Largest sum of layout shifts that the web's guidelines call good (web.dev/cls).
const MAX_LAYOUT_SHIFT: f64 = 0.1;

/// Runs before the scripts of a page: collects layout shifts, and what the page shows when it is parsed. Modules, and so the
/// replay's script, run after that.
const RECORD_LOADING: &str = "
    window.shifts = [];
    new PerformanceObserver(list => {
        for (const shift of list.getEntries()) window.shifts.push({
            value: shift.value,
            moved: shift.sources.map(({ node, previousRect, currentRect }) =>
                `${node?.nodeName}.${node?.className} ${JSON.stringify(previousRect)} ${JSON.stringify(currentRect)}`),
        });
    }).observe({ type: 'layout-shift', buffered: true });
    document.addEventListener('readystatechange', () => {
        if (document.readyState != 'interactive') return;
        window.parsed = [...document.querySelectorAll('section.replay')].map(section => ({
            state: section.dataset.state ?? null,
            path: section.querySelector('.still .trajectory.puck')?.getAttribute('d').length ?? 0,
            height: section.querySelector('.still svg')?.getBoundingClientRect().height ?? 0,
        }));
    });
";

/// Loads a page with replays. Asserts that it shows the still pictures before its script runs, and that its layout shifts little.
fn assert_still_first_and_layout_stable(page: &Page, url: &str, replays: usize) {
    page.go_to(url);
    page.wait_until(&format!(
        "document.querySelectorAll('section.replay[data-state=ready]').length == {replays}"
    ));
    // Shifts are reported with the frames after them.
    let _ = page.evaluate(
        "new Promise(drawn => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(drawn, 0))))",
    );
    let parsed = page.evaluate("window.parsed");
    let parsed = parsed.as_array().expect("the page was parsed");
    assert_eq!(parsed.len(), replays);
    for section in parsed {
        assert!(section["state"].is_null(), "before the script: {section}");
        assert!(section["path"].as_u64() > Some(20), "{section}");
        assert!(section["height"].as_f64() > Some(100.0), "{section}");
    }
    let total = page.evaluate("window.shifts.reduce((sum, shift) => sum + shift.value, 0)");
    let total = total.as_f64().expect("a sum");
    assert!(
        total < MAX_LAYOUT_SHIFT,
        "{url}: {total}: {:#}",
        page.evaluate("window.shifts")
    );
}

#[test]
fn replay_page_shows_a_still_first_and_keeps_its_layout() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, comparison) = compared_evaluations(scratch.path(), ["hold", "hold"]);
    let browser = Browser::start(scratch.path());
    let evaluation = comparison
        .split("/compare")
        .next()
        .expect("there is a first part");
    let handheld = View {
        width: 390,
        height: 844,
        ..View::DESKTOP
    };
    for view in [View::DESKTOP, handheld, View::PROJECTOR] {
        let page = browser.open_in(view, &format!("{}/", server.url));
        page.before_scripts(RECORD_LOADING);
        let episode = format!("{}{evaluation}/episodes/defend/0", server.url);
        assert_still_first_and_layout_stable(&page, &episode, 1);
        assert_still_first_and_layout_stable(&page, &format!("{episode}/embed"), 1);
        assert_still_first_and_layout_stable(
            &page,
            &format!("{}{comparison}/defend/1", server.url),
            2,
        );
    }
}
