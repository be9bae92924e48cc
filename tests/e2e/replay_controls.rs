//! Keys, clicks, links and videos of a replay in a real browser.

use crate::replay::{PREFERS_REDUCED_MOTION, press, released_evaluation};
use faceoff_tests::browser::{Browser, Page};
use serde_json::json;

/// Whether the replay plays after an action, which is an expression.
fn plays_after(page: &Page, action: &str) -> bool {
    let label = page.evaluate(&format!(
        "(() => {{
            {action};
            return new Promise(drawn => requestAnimationFrame(() => requestAnimationFrame(() =>
                drawn(document.querySelector('#replay .transport .main').getAttribute('aria-label')))));
        }})()"
    ));
    label == "Pause"
}

#[test]
fn space_and_clicks_play_and_drags_do_not() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, evaluation) = released_evaluation(scratch.path());
    let browser = Browser::start(scratch.path());
    let page = browser.open(&format!("{}{evaluation}/episodes/defend/0", server.url));
    page.wait_for("#replay[data-state=ready]");
    let _ = page.evaluate(
        "(() => {
            const speed = document.querySelector('#replay select[aria-label=Speed]');
            speed.value = '0.1';
            speed.dispatchEvent(new Event('change'));
            window.space = target => target.dispatchEvent(
                new KeyboardEvent('keydown', { key: ' ', bubbles: true, cancelable: true }));
            const area = document.querySelector('#replay .canvas-area');
            const at = (kind, x) => area.dispatchEvent(
                new PointerEvent(kind, { clientX: x, clientY: 300, button: 0, bubbles: true }));
            window.clickPicture = moved => { at('pointerdown', 300); at('pointermove', 300 + moved);
                at('pointerup', 300 + moved); area.click(); };
        })()",
    );
    // Space and clicks on the picture start and stop the replay. A click after a move of 60 pixels is the end of a drag, which turns the
    // camera and changes nothing. Links and fields keep the key for themselves.
    assert!(plays_after(&page, "space(document.body)"));
    assert!(!plays_after(&page, "space(document.querySelector('h1'))"));
    assert!(!plays_after(
        &page,
        "space(document.querySelector('.lead a'))"
    ));
    assert!(!plays_after(
        &page,
        "space(document.querySelector('#replay select'))"
    ));
    assert!(plays_after(&page, "clickPicture(2)"));
    assert!(
        plays_after(&page, "clickPicture(60)"),
        "a drag turns the camera"
    );
    assert!(!plays_after(&page, "clickPicture(0)"));
    assert_eq!(page.console_errors(), [""; 0]);
}

#[test]
fn link_to_a_moment_restores_the_view_and_plays() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, evaluation) = released_evaluation(scratch.path());
    let browser = Browser::start(scratch.path());
    let url = format!("{}{evaluation}/episodes/hit/0", server.url);
    let linked = browser.open(&format!("{url}#t=7&flat=1"));
    linked.wait_for("#replay[data-state=ready][data-view=flat]");
    linked.wait_until("Number(document.querySelector('#replay').dataset.step) > 7");

    let page = browser.open(&format!("{}/", server.url));
    page.before_scripts(PREFERS_REDUCED_MOTION);
    let fragment = "#t=9&cam=-0.1_0_0.05_-1.3_0.6_3.1&speed=2&paths=puck&trail=all&arm=2";
    page.go_to(&format!("{url}{fragment}"));
    page.wait_for("#replay[data-state=ready][data-step='9']");
    let found = page.evaluate(
        "(() => {
            Object.defineProperty(navigator, 'clipboard', { value: undefined });
            [...document.querySelectorAll('#replay button')]
                .find(button => button.textContent == 'Copy link to this moment').click();
            return new Promise(done => setTimeout(() => done({
                link: document.querySelector('#replay .address').value,
                speed: document.querySelector('#replay select[aria-label=Speed]').value,
                layers: document.querySelectorAll('#replay .layers input:checked').length,
                arm: document.querySelector('#replay .strips select').selectedIndex,
                playing: document.querySelector('#replay .transport .main').getAttribute('aria-label'),
                isInView: document.querySelector('#replay .screen').getBoundingClientRect().top < innerHeight / 2,
            })));
        })()",
    );
    let expected = json!({
        "link": format!("{url}{fragment}"), "speed": "2", "layers": 1, "arm": 1, "playing": "Play", "isInView": true,
    });
    assert_eq!(found, expected);
    // Bad values are ignored.
    page.go_to(&format!("{url}?#t=x&cam=1_2&paths=moon&arm=7"));
    page.wait_for("#replay[data-state=ready][data-step='0']");
    assert_eq!(page.console_errors(), [""; 0]);
}

#[test]
fn space_scrolls_a_focused_table_that_can_scroll() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, evaluation) = released_evaluation(scratch.path());
    let browser = Browser::start(scratch.path());
    let page = browser.open(&format!("{}{evaluation}/episodes/defend/0", server.url));
    page.wait_for("#replay[data-state=ready]");
    let _ = page.evaluate(
        "(() => {
            document.querySelector('#replay .data').open = true;
            window.space = () => document.querySelector('#replay .data .wide').dispatchEvent(
                new KeyboardEvent('keydown', { key: ' ', bubbles: true, cancelable: true }));
        })()",
    );
    page.wait_until("document.querySelector('#replay .data [aria-current] td').checkVisibility()");
    assert!(
        !plays_after(&page, "space()"),
        "the columns do not fit: the table scrolls"
    );
    // A table that fits has nothing to scroll.
    let _ = page.evaluate(
        "document.querySelectorAll('#replay .data tr > :nth-child(n + 3)').forEach(cell => cell.remove())",
    );
    assert!(plays_after(&page, "space()"));
    assert_eq!(page.console_errors(), [""; 0]);
}

#[test]
fn video_that_cannot_be_recorded_is_a_visible_message() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, evaluation) = released_evaluation(scratch.path());
    let browser = Browser::start(scratch.path());
    let page = browser.open(&format!("{}/", server.url));
    page.before_scripts(
        "MediaRecorder.prototype.start = () => { throw new DOMException('no encoder'); };",
    );
    page.go_to(&format!("{}{evaluation}/episodes/defend/0", server.url));
    page.wait_for("#replay[data-state=ready]");
    let problem = "document.querySelector('#replay .share .problem')";
    assert_eq!(
        page.evaluate(&format!("{problem}.checkVisibility()")),
        false
    );
    press(&page, "Record video");
    page.wait_until(&format!("{problem}.checkVisibility()"));
    assert_eq!(
        page.text("#replay .share .problem"),
        "The video could not be recorded."
    );
    let height = page.evaluate(&format!("{problem}.getBoundingClientRect().height > 16"));
    assert_eq!(height, true, "it is no text for screen readers only");
}
