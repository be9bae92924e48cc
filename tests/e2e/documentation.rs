//! The documentation in a real browser: copying of listings, the list of all pages, and anchors of headings.

use crate::CONFIG;
use faceoff_tests::{
    browser::{Browser, LAN_HOST, Page, View},
    server::Server,
};

/// Widths of windows in CSS pixels, from a small phone to a desktop.
const WIDTHS: [u32; 5] = [320, 390, 768, 1024, 1440];
/// JavaScript: stores the text that a page copies in `window.copied`. Pages copy by the browser's clipboard interface or, where it has
/// none, by a selection.
const KEEP_COPIES: &str = "
    if (navigator.clipboard) navigator.clipboard.writeText = async text => { window.copied = text; };
    document.execCommand = command => { window.copied = document.activeElement.value; return command === 'copy'; };";

fn view(width: u32) -> View {
    View {
        width,
        ..View::DESKTOP
    }
}

/// Presses the button of the listing whose code has this text. Returns the copied text.
fn copy(page: &Page, text: &str) -> String {
    let listing = format!(
        "[...document.querySelectorAll('.listing')].find(listing => listing.textContent.includes('{text}'))"
    );
    let _ = page.evaluate(&format!("{listing}.querySelector('button').click()"));
    page.wait_until("document.querySelector('[data-live-status]').textContent === 'Copied'");
    let copied = page.evaluate("window.copied");
    copied.as_str().expect("a text was copied").to_owned()
}

#[test]
fn listings_are_copied_without_prompts() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let browser = Browser::start(scratch.path());
    // Browsers give pages without TLS no access to the clipboard, except those of the loopback address.
    let lan_url = server.url.replace("127.0.0.1", LAN_HOST);
    for url in [&server.url, &lan_url] {
        let page = browser.open(&format!("{url}/docs"));
        page.before_scripts(KEEP_COPIES);
        page.go_to(&format!("{url}/docs/start"));
        // Of a terminal session only the commands are copied, without prompts and output; of another listing everything is.
        let commands = copy(&page, "faceoff new my-agent");
        assert!(commands.contains("faceoff new my-agent\n"), "{commands}");
        assert!(!commands.contains("an agent for the task"), "{commands}");
        assert!(!commands.contains("$ "), "{commands}");
        page.go_to(&format!("{url}/docs/configuration"));
        let settings = copy(&page, "data_dir =");
        assert!(settings.starts_with("# The configuration"), "{settings}");
        assert!(settings.contains("\n[server]\nlisten = \""), "{settings}");
    }
    // A selection by hand leaves out the prompts and has the output.
    let page = browser.open(&format!("{}/docs/start", server.url));
    let selected = page.evaluate(
        "getSelection().selectAllChildren(document.querySelector('pre:has(.prompt)')), getSelection().toString()",
    );
    let selected = selected.as_str().expect("a selection is text");
    assert!(
        !selected.contains('$') && selected.contains("apt-get"),
        "{selected}"
    );
    // Without scripts there is nothing to press.
    let plain = browser.open_in(
        View::PHONE.without_scripts(),
        &format!("{}/docs/start", server.url),
    );
    assert_eq!(
        plain.evaluate("document.querySelector('.listing button')"),
        serde_json::Value::Null
    );
}

#[test]
fn documentation_fits_all_widths() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let browser = Browser::start(scratch.path());
    let page = browser.open(&format!("{}/docs", server.url));
    for path in [
        "/docs",
        "/docs/rules",
        "/docs/start",
        "/docs/configuration",
        "/docs/api",
        "/docs/search?q=board",
        "/docs/api-reference",
        "/docs/api-reference/organiser",
        "/docs/api-reference/schemas",
        "/docs/api-reference/schemas/BoardView",
    ] {
        page.go_to(&format!("{}{path}", server.url));
        for width in WIDTHS {
            page.set_view(view(width));
            assert_eq!(page.overflow(), 0, "{path} at {width} pixels");
            // Anchors need no hover, and a finger can press them.
            let small = page.evaluate(
                "[...document.querySelectorAll('.anchor')].filter(anchor => {
                    const box = anchor.getBoundingClientRect();
                    return box.width < 24 || box.height < 24 || getComputedStyle(anchor).opacity < 1;
                }).length",
            );
            assert_eq!(small, 0, "{path} at {width} pixels");
        }
    }
    assert_eq!(page.console_errors(), [""; 0]);
}

#[test]
fn list_of_pages_is_beside_wide_text_only() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let browser = Browser::start(scratch.path());
    let url = format!("{}/docs/workers", server.url);
    let state = |page: &Page| {
        page.evaluate(
            "(() => {
                const list = document.querySelector('.side').getBoundingClientRect();
                const article = document.querySelector('article').getBoundingClientRect();
                const current = document.querySelector('.side [aria-current=page]');
                const box = current.getBoundingClientRect();
                return {
                    beside: list.right <= article.left,
                    above: list.bottom <= article.top,
                    shown: current.checkVisibility({ contentVisibilityAuto: true }) && box.height >= 24,
                    inWindow: box.top >= list.top && box.bottom <= innerHeight,
                    summary: document.querySelector('.side summary').checkVisibility(),
                };
            })()",
        )
    };
    for width in WIDTHS {
        let page = browser.open_in(view(width), &url);
        let is_wide = width >= 1000;
        if is_wide {
            // The list begins near the current page, although it is longer than the window.
            page.wait_until("document.querySelector('.side-list').scrollTop > 0");
        }
        let state = state(&page);
        assert_eq!(state["beside"], is_wide, "{width}: {state}");
        assert_eq!(state["above"], !is_wide, "{width}: {state}");
        assert_eq!(state["shown"], is_wide, "{width}: {state}");
        assert_eq!(state["summary"], !is_wide, "{width}: {state}");
        if is_wide {
            assert_eq!(state["inWindow"], true, "{width}: {state}");
        }
    }
    // The disclosure works without scripts.
    let phone = browser.open_in(View::PHONE.without_scripts(), &url);
    let _ = phone.evaluate("document.querySelector('.side summary').click()");
    assert_eq!(state(&phone)["shown"], true);
    assert_eq!(phone.overflow(), 0);
}
