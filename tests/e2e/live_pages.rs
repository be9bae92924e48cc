//! Live updates of pages in a real browser: a loaded page follows the server's event stream and replaces its changed parts.

use crate::{CONFIG, Team, evaluation_path, start_day};
use faceoff_tests::{
    browser::{Browser, Page, View},
    repository,
    server::Server,
};
use std::{
    io::{Read, Write},
    net::TcpStream,
};

/// Number of event streams that visitors may have open at the same time: three quarters of the server's 512.
const MAX_STREAMS: usize = 384;

/// A script that records each event stream that a page opens, and how many milliseconds it waits before it opens the next.
/// `followStream` is the function of the page's script that opens one.
const RECORD_STREAMS: &str = "
    window.streams = [];
    window.waits = [];
    window.EventSource = class extends window.EventSource {
        constructor(...args) { super(...args); window.streams.push(this); }
    };
    const originalSetTimeout = window.setTimeout;
    window.setTimeout = (callback, ms, ...args) => {
        if (callback.name === 'followStream') window.waits.push(ms);
        return originalSetTimeout(callback, ms, ...args);
    };
";

/// Makes the browser report the page as hidden, or as visible.
fn set_hidden(page: &Page, is_hidden: bool) {
    let _ = page.evaluate(&format!(
        "Object.defineProperty(document, 'hidden', {{ configurable: true, get: () => {is_hidden} }});
        document.dispatchEvent(new Event('visibilitychange'))"
    ));
}

/// Sets a mark that the page loses when it is reloaded.
fn mark(page: &Page) {
    assert_eq!(page.evaluate("window.isMarked = true"), true);
}

fn was_not_reloaded(page: &Page) -> bool {
    page.evaluate("window.isMarked") == true
}

/// A script that lists the texts outside of the window. It skips texts for screen readers, links that appear with the keyboard
/// focus, code and drawings, and tables that scroll separately. Captions of tables do not scroll.
const CLIPPED_TEXTS: &str = "(() => {
    const clipped = [];
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    while (walker.nextNode()) {
        const parent = walker.currentNode.parentElement;
        const scrolls = parent.closest('.wide') && !parent.closest('caption, .board');
        if (scrolls || parent.closest('.sr, .skip, pre, svg')) continue;
        const range = document.createRange();
        range.selectNodeContents(walker.currentNode);
        const box = range.getBoundingClientRect();
        if (box.width > 0 && (box.left < 0 || box.right > innerWidth + 0.5)) clipped.push(walker.currentNode.data);
    }
    return clipped;
})()";

#[test]
fn board_and_evaluation_pages_follow_day_without_reload() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let browser = Browser::start(scratch.path());
    let teams = ["Alpha", "Beta"].map(|name| Team::create(&server, name));
    let submissions = teams
        .each_ref()
        .map(|team| team.submit(&server, &repository().join("agents/hold")));

    let board = browser.open(&format!("{}/", server.url));
    assert_eq!(board.text("#empty"), "No team has a result yet");
    mark(&board);
    let day = start_day(&server);
    let evaluation_page = evaluation_path(&day, &submissions[1]).replace("/api/v1", "");
    let evaluation = browser.open(&format!("{}{evaluation_page}", server.url));
    mark(&evaluation);

    board.wait_for(".board th.team a");
    let first_team = board.text(".board th.team a");
    let _ = board.evaluate("document.querySelector('.board th.team a').focus()");
    // Screen readers announce the change.
    board.wait_until(
        "document.querySelector('[data-live-status]').textContent.includes('The board has changed')",
    );
    board.wait_until("document.querySelectorAll('.board th.team').length == 2");
    assert!(was_not_reloaded(&board));
    assert_eq!(
        board.evaluate("document.activeElement.textContent"),
        first_team.as_str(),
        "the keyboard focus stays on the team"
    );
    // The note about running evaluations disappears.
    board.wait_until("document.querySelector('.under-way') === null");

    evaluation.wait_for("#result");
    assert!(was_not_reloaded(&evaluation));
    // The details that are public with the day's release appear, too.
    evaluation.wait_for("#violations");
    for page in [&board, &evaluation] {
        assert_eq!(page.console_errors(), [""; 0]);
    }

    // A time is shown in UTC and in the visitor's time zone.
    let phone_in_india = View {
        time_zone: "Asia/Kolkata",
        ..View::PHONE
    };
    let page = browser.open_in(phone_in_india, &format!("{}{evaluation_page}", server.url));
    page.wait_for("time .local");
    assert!(page.text("time:has(.local)").contains(" UTC ("));
    assert!(page.text("time .local").contains("GMT+5:30"));
    assert_eq!(page.overflow(), 0);

    // Without scripts a loaded page shows the same, and no text is clipped on a phone.
    for path in ["/", "/?sort=team", "/tasks/hit", &evaluation_page] {
        for view in [View::PHONE, View::PHONE.dark().without_scripts()] {
            let page = browser.open_in(view, &format!("{}{path}", server.url));
            assert_eq!(page.overflow(), 0, "{path} is wider than a phone");
            if path != evaluation_page {
                assert_eq!(
                    page.evaluate("document.querySelectorAll('.board th.team').length"),
                    2
                );
            }
            assert_eq!(
                page.evaluate(CLIPPED_TEXTS),
                serde_json::json!([]),
                "{path}"
            );
            assert_eq!(page.console_errors(), [""; 0], "{path}");
        }
    }
}

#[test]
fn refused_stream_is_retried_with_growing_delay() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let browser = Browser::start(scratch.path());
    let address = server.url.trim_start_matches("http://");
    let other_streams: Vec<TcpStream> = (0..MAX_STREAMS)
        .map(|_| {
            let mut stream = TcpStream::connect(address).expect("the server accepts it");
            let request = format!("GET /api/v1/events/stream HTTP/1.1\r\nHost: {address}\r\n\r\n");
            stream
                .write_all(request.as_bytes())
                .expect("the server reads");
            let mut status_line = [0; b"HTTP/1.1 200".len()];
            stream
                .read_exact(&mut status_line)
                .expect("the server answers");
            assert_eq!(&status_line, b"HTTP/1.1 200");
            stream
        })
        .collect();

    let page = browser.open(&format!("{}/docs", server.url));
    page.before_scripts(RECORD_STREAMS);
    page.go_to(&format!("{}/", server.url));
    page.wait_until("waits.length == 3");
    drop(other_streams);
    page.wait_until("streams.at(-1).readyState == EventSource.OPEN");
    let waits = page.evaluate("waits.slice(0, 3)");
    for (index, min_ms) in [500.0, 1000.0, 2000.0].into_iter().enumerate() {
        let wait = waits[index].as_f64().expect("milliseconds");
        assert!((min_ms..3.0 * min_ms).contains(&wait), "waited {waits} ms");
    }
    // From now on the page is updated like any other.
    mark(&page);
    let _ = Team::create(&server, "Alpha").submit(&server, &repository().join("agents/hold"));
    let _ = start_day(&server);
    page.wait_for(".board th.team a");
    assert!(was_not_reloaded(&page));
}

#[test]
fn hidden_page_closes_stream_and_scroll_position_is_kept() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let browser = Browser::start(scratch.path());
    let team = Team::create(&server, "Alpha");
    let submission = team.submit(&server, &repository().join("agents/hold"));
    let board = browser.open(&format!("{}/docs", server.url));
    board.before_scripts(RECORD_STREAMS);
    board.go_to(&format!("{}/", server.url));
    board.wait_until("streams.at(-1)?.readyState == EventSource.OPEN");
    mark(&board);
    set_hidden(&board, true);
    let open_streams = "streams.filter(stream => stream.readyState != EventSource.CLOSED).length";
    assert_eq!(board.evaluate(open_streams), 0);

    let path = evaluation_path(&start_day(&server), &submission).replace("/api/v1", "");
    let low_window = View {
        height: 200,
        ..View::PHONE
    };
    let scrolled = browser.open_in(low_window, &format!("{}{path}", server.url));
    mark(&scrolled);
    let _ = scrolled.evaluate("scrollTo(0, document.documentElement.scrollHeight)");
    let footer_top = "document.querySelector('footer a').getBoundingClientRect().top";
    let [top_before, height_before] =
        [footer_top, "document.body.offsetHeight"].map(|expression| scrolled.evaluate(expression));
    assert!(
        scrolled
            .evaluate("document.querySelector('#result')")
            .is_null()
            && scrolled
                .evaluate("document.querySelector('main').getBoundingClientRect().bottom < 0")
                == true,
        "the part that will change is above the visible part"
    );
    scrolled.wait_for("#result");
    scrolled.wait_for("#violations");
    assert!(was_not_reloaded(&scrolled));
    assert_ne!(
        scrolled.evaluate("document.body.offsetHeight"),
        height_before
    );
    // Browsers scroll by whole pixels.
    let [top_before, top_after] =
        [top_before, scrolled.evaluate(footer_top)].map(|top| top.as_f64().unwrap_or(f64::NAN));
    assert!(
        (top_after - top_before).abs() < 1.0,
        "from {top_before} to {top_after}"
    );

    // A page that becomes visible again is updated.
    assert_eq!(
        board.evaluate("document.querySelectorAll('.board th.team').length"),
        0
    );
    set_hidden(&board, false);
    board.wait_for(".board th.team a");
    assert_eq!(board.evaluate(open_streams), 1);
    assert!(was_not_reloaded(&board));
}
