//! The list of an evaluation's episodes in a real browser: still pictures, maps and the layout on a phone.

use crate::replay::released_evaluation;
use faceoff_tests::browser::{Browser, View};

#[test]
fn list_of_episodes_shows_stills_and_marks_open_replays() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, evaluation) = released_evaluation(scratch.path());
    let browser = Browser::start(scratch.path());
    let page = browser.open(&format!("{}{evaluation}/episodes", server.url));
    // JavaScript: the number of still pictures that are loaded.
    let loaded_pictures = "[...document.querySelectorAll('.episodes tbody img')].filter(image => image.complete && image.naturalWidth > 0).length";
    page.wait_until(&format!("{loaded_pictures} > 0"));
    // Pictures far below the window are loaded on the way there.
    let _ = page.evaluate("scrollTo(0, document.body.scrollHeight)");
    page.wait_until(&format!(
        "{loaded_pictures} == document.querySelectorAll('.episodes tbody tr').length"
    ));
    page.set_view(View::PHONE);
    assert_eq!(page.overflow(), 0);
    let table = "document.querySelector('.episodes').parentElement";
    let scrolls = page.evaluate(&format!("{table}.scrollWidth > {table}.clientWidth"));
    assert_eq!(scrolls, false, "rows are cards on a phone");
    let name = page.evaluate("document.querySelector('.table-map a title').textContent");
    let name = name.as_str().expect("a title is text");
    assert!(
        name.starts_with("hit ") && name.contains("solved"),
        "{name}"
    );
    page.navigate_by(
        "document.querySelector('.table-map a').dispatchEvent(new MouseEvent('click', { bubbles: true, cancelable: true }))",
    );
    let path = page.evaluate("location.pathname");
    let path = path.as_str().expect("a path is text");
    assert!(
        path.starts_with(&format!("{evaluation}/episodes/hit/")),
        "{path}"
    );
    assert_eq!(page.console_errors(), Vec::<String>::new());
}
