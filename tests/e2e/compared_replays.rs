//! Two episodes with one set of controls in a real browser: beside each other, and on one table.

use crate::{
    Team,
    axe::{axe_script, page_defects},
    evaluation_path,
    replay::PREFERS_REDUCED_MOTION,
    shared_folder::start_prepared,
    start_day,
};
use faceoff_tests::{
    browser::{Browser, Page, View},
    repository,
    server::Server,
};
use serde_json::{Value, json};
use std::path::Path;

const HANDHELD: View = View {
    width: 390,
    height: 844,
    ..View::DESKTOP
};

/// The first request for the second replay's motion fails.
const FAIL_SECOND_REPLAY_ONCE: &str = "
    const original = window.fetch;
    let hasFailed = false;
    window.fetch = (address, options) => {
        const isSecond = address === document.querySelector('#replay-b')?.dataset.motion;
        if (!isSecond || hasFailed) return original.call(window, address, options);
        hasFailed = true;
        return Promise.reject(new TypeError('the network is down'));
    };
";

/// Starts a server and waits for the evaluations of two teams. Returns the server and the path of the page that compares them.
pub fn compared_evaluations(scratch: &Path, agents: [&str; 2]) -> (Server, String) {
    let name = format!("compared-{}-{}", agents[0], agents[1]);
    start_prepared(&name, scratch, |server, _| {
        let teams = ["Alpha", "Beta"].map(|name| Team::create(server, name));
        let submissions = [0, 1].map(|index: usize| {
            let agent = repository().join("agents").join(agents[index]);
            teams[index].submit(server, &agent)
        });
        let day = start_day(server);
        let [left_page, right_page] = [0, 1].map(|index: usize| {
            let path = evaluation_path(&day, &submissions[index]);
            let finished = teams[index].wait_until_finished(server, &path);
            assert_eq!(finished["state"], "finished", "{finished}");
            path.replace("/api/v1", "")
        });
        let right_id = right_page.rsplit('/').next();
        let right_id = right_id.expect("the path ends with the id");
        format!("{left_page}/compare/{right_id}")
    })
}

/// Waits until both replays are loaded.
pub fn wait_for_both(page: &Page) {
    page.wait_until("document.querySelectorAll('section.replay[data-state=ready]').length == 2");
}

/// Moves the shared slider to a sample, and waits until both replays show it.
pub fn show_both_at(page: &Page, sample: usize) {
    let _ = page.evaluate(&format!(
        "(() => {{
            const slider = document.querySelector('.shared-controls input[type=range]');
            slider.value = {sample};
            slider.dispatchEvent(new Event('input', {{ bubbles: true }}));
        }})()"
    ));
    page.wait_until(&format!(
        "[...document.querySelectorAll('section.replay')].every(replay => replay.dataset.step == '{sample}')"
    ));
}

/// JavaScript: the box with the text "Both on one table".
pub const ONE_TABLE_BOX: &str = "[...document.querySelectorAll('.shared-controls label')]
    .find(label => label.textContent.includes('one table')).querySelector('input')";

/// Number of the first replay's pixels in the flat view that have this colour, which is the name of a variable of the style sheet.
fn pixels_of(page: &Page, colour: &str) -> u64 {
    let count = page.evaluate(&format!(
        "(() => {{
            const canvas = [...document.querySelectorAll('#replay-a canvas')]
                .find(canvas => canvas.checkVisibility() && canvas.getContext('2d') !== null);
            const {{ data, width, height }} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
            const digits = getComputedStyle(document.querySelector('#replay-a')).getPropertyValue('--{colour}');
            const colour = digits.match(/[0-9a-f]{{2}}/gi).map(pair => parseInt(pair, 16));
            let count = 0;
            for (let i = 0; i < width * height; i++)
                if (colour.every((part, k) => Math.abs(part - data[4 * i + k]) < 12)) count++;
            return count;
        }})()"
    ));
    count.as_u64().expect("a number of pixels")
}

/// Draw calls of the first replay.
fn draw_calls(page: &Page) -> u64 {
    let calls =
        page.evaluate("Number(document.querySelector('#replay-a.replay').dataset.drawCalls)");
    calls.as_u64().expect("the replay reports its draw calls")
}

#[test]
fn compared_replays_show_same_sample() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, comparison) = compared_evaluations(scratch.path(), ["hold", "hold"]);
    let browser = Browser::start(scratch.path());
    let page = browser.open(&format!("{}{comparison}/defend/1", server.url));
    wait_for_both(&page);
    show_both_at(&page, 12);
    // On a phone both pictures and their only controls are in view at once.
    page.set_view(HANDHELD);
    let visible = page.evaluate(
        "new Promise(done => requestAnimationFrame(() => {
            document.querySelector('.together').scrollIntoView();
            const boxes = ['#replay-a .screen', '#replay-b .screen', '.shared-controls .controls']
                .map(selector => document.querySelector(selector).getBoundingClientRect());
            done([document.querySelectorAll('input[type=range]').length,
                boxes.every(box => box.top >= 0 && box.bottom <= innerHeight && box.height > 50)]);
        }))",
    );
    assert_eq!(visible, json!([1, true]));
    page.set_view(View::DESKTOP);
    // axe-core finds violations of accessibility rules.
    let axe = axe_script();
    let mut found = page_defects(&page, &axe, "an episode twice");
    page.set_view(View::DESKTOP);
    page.go_to(&format!("{}{comparison}", server.url));
    found.extend(page_defects(&page, &axe, "a comparison"));
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn two_episodes_are_drawn_on_one_table() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, comparison) = compared_evaluations(scratch.path(), ["hold", "reckless"]);
    let browser = Browser::start(scratch.path());
    let url = format!("{}{comparison}/defend/1", server.url);
    let page = browser.open(&url);
    wait_for_both(&page);
    show_both_at(&page, 12);
    let alone = draw_calls(&page);

    // The keyboard reaches the switch.
    let _ = page.evaluate(&format!("{ONE_TABLE_BOX}.focus()"));
    page.press(" ");
    page.wait_until("document.querySelector('.together.one-table') !== null");
    page.wait_until(&format!(
        "Number(document.querySelector('#replay-a').dataset.drawCalls) > {alone} + 2"
    ));
    let shown = page.evaluate(
        "['#replay-a canvas', '#replay-b canvas', '.table-legend'].map(selector => document.querySelector(selector).checkVisibility())",
    );
    assert_eq!(shown, json!([true, false, true]));
    let legend = page.text(".table-legend");
    for name in ["Alpha, defend 1:", "Beta, defend 1 (translucent):"] {
        assert!(legend.contains(name), "{legend}");
    }

    // The flat view without trails: the second arm, mallet and puck have a colour of their own.
    let _ = page.evaluate(
        "(() => {
            document.querySelectorAll('.layers input:checked').forEach(box => box.click());
            [...document.querySelectorAll('.shared-controls button')].find(button => button.textContent == 'Flat').click();
        })()",
    );
    page.wait_for("#replay-a[data-view=flat]");
    show_both_at(&page, 13);
    let both = ["rp-ghost", "rp-puck", "rp-mallet"].map(|colour| pixels_of(&page, colour));
    assert!(both.iter().all(|count| *count > 40), "{both:?}");
    assert!(page.text(".table-legend").contains("(outlines)"));
    let link = page.evaluate(
        "(() => {
            Object.defineProperty(navigator, 'clipboard', { value: undefined });
            [...document.querySelectorAll('.shared-controls button')]
                .find(button => button.textContent == 'Copy link to this moment').click();
            return new Promise(done => setTimeout(() => done(document.querySelector('.shared-controls .address').value)));
        })()",
    );
    assert_eq!(link, format!("{url}#t=13&flat=1&ghost=1&paths=none"));
    // Switched off again: each episode has its own table.
    let _ = page.evaluate(&format!("{ONE_TABLE_BOX}.click()"));
    show_both_at(&page, 12);
    assert_eq!(pixels_of(&page, "rp-ghost"), 0);
    assert_eq!(page.console_errors(), [""; 0]);

    link_shows_one_table(&browser, &server, &url);
    link_to_one_table_waits_for_a_late_replay(&browser, &server, &url);
    let without_scripts = browser.open_in(View::DESKTOP.without_scripts(), &url);
    let stills = without_scripts.evaluate("document.querySelectorAll('.still svg').length");
    assert_eq!(stills, 2);
}

/// The link's `ghost=1` asks for both episodes on one table. The second replay is loaded at its second attempt only.
fn link_to_one_table_waits_for_a_late_replay(browser: &Browser, server: &Server, url: &str) {
    let page = browser.open_in(View::DESKTOP, &format!("{}/", server.url));
    page.before_scripts(FAIL_SECOND_REPLAY_ONCE);
    page.go_to(&format!("{url}#t=9&ghost=1"));
    page.wait_for("#replay-a[data-state=ready]");
    page.wait_for("#replay-b[data-state=failed]");
    assert_eq!(
        page.evaluate("document.querySelector('.one-table') === null"),
        true
    );
    let _ = page.evaluate(
        "[...document.querySelectorAll('#replay-b button')].find(button => button.textContent == 'Try again').click()",
    );
    page.wait_for(".one-table #replay-b[data-state=ready]");
    assert_eq!(page.evaluate(&format!("{ONE_TABLE_BOX}.checked")), true);
}

/// On a phone, for a visitor who prefers reduced motion.
fn link_shows_one_table(browser: &Browser, server: &Server, url: &str) {
    let page = browser.open_in(HANDHELD, &format!("{}/", server.url));
    page.before_scripts(PREFERS_REDUCED_MOTION);
    page.go_to(&format!("{url}#t=9&ghost=1"));
    page.wait_for(".one-table #replay-a[data-state=ready][data-step='9']");
    let found: Value = page.evaluate(
        "new Promise(done => requestAnimationFrame(() => {
            document.querySelector('.together').scrollIntoView();
            const boxes = ['.table-legend', '#replay-a .canvas-area', '.shared-controls .controls']
                .map(selector => document.querySelector(selector).getBoundingClientRect());
            done({
                inView: boxes.every(box => box.top >= 0 && box.bottom <= innerHeight && box.height > 30),
                width: boxes[1].width > innerWidth - 60,
                playing: document.querySelector('.transport .main').getAttribute('aria-label'),
            });
        }))",
    );
    let expected = json!({ "inView": true, "width": true, "playing": "Play" });
    assert_eq!(found, expected);
    let found = page_defects(&page, &axe_script(), "two episodes on one table");
    assert!(found.is_empty(), "{}", found.join("\n"));
}
